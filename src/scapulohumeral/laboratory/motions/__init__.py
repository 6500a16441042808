"""Motions of other OpenSim models, and orientations of segments."""
