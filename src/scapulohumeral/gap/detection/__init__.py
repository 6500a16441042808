"""Whether there is a gap, and where it lies."""
