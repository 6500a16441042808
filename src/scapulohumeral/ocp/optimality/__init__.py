"""Certificates of solutions and their derivatives, from the KKT matrix."""
