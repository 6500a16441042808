"""Plants: systems that generate the trials of blind cases, with other numerics than the diagnosis.

Nothing here is imported by the package, and nothing here imports ``scapulohumeral.gap``.
"""
