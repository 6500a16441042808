"""Predictive simulation of the human shoulder with unit quaternions, and diagnosis of its gap."""

__version__ = "0.1.0"
