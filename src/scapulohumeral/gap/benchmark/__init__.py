"""Simulated cases with sealed causes: drawn, answered, scored."""
