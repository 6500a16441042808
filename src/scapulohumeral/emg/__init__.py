"""Electromyography: recordings, envelopes, their quality, and simulated signals.

Letters of the package: T samples, C channels, G virtual muscle groups, M muscle elements.
"""
