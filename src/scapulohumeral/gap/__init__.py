"""Diagnosis of the gap between recorded trials and the model: where, which effect, how far."""
