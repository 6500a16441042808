"""Chapter on daily tasks."""
