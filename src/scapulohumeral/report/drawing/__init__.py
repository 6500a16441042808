"""Figures as SVG, and curves prepared for them."""
