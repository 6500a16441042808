"""Published numbers beside the reproduced ones, and why they differ."""
