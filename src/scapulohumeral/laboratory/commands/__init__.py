"""The commands of ``scapulohumeral`` beside the diagnosis: arguments only."""
