"""Muscle lengths: sampled in OpenSim, fitted as functions of the pose."""
