"""Chapters on predicted motions, joint force and moments."""
