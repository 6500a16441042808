"""Checks of a participant's model that no prediction needs."""
