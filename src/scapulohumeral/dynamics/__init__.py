"""Equations of motion: derived with SymPy Mechanics, evaluated with exact derivatives."""
