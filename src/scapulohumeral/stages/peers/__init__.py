"""What users would pick instead of this solver, measured on the same problem."""
