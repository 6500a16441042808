"""Optimal control problems of the study: posed from a participant's model, solved, stored."""
