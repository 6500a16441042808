"""Markers on the skin: files, landmarks, segment frames."""
