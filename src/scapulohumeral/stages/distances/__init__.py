"""Distances of predictions to recordings and to published predictions, as tables of results."""
