"""Which effect explains the gap, how large it is, and what else might."""
