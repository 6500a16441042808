"""Differences that were not recorded, judged by derivatives alone: what limits answers."""
