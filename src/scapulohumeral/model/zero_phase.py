"""Butterworth filters run forwards and backwards, which do not delay, at any sampling rate.

Their corners are moved so that both passes together have half power at the frequencies asked for
(Winter 2009, Biomechanics and Motor Control of Human Movement, section 3.4.4.2).
Letters: T samples.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from scapulohumeral.model.rotations import Array

# Each pass is of second order: both together fall off like one of fourth order.
FILTER_ORDER = 2
# A second-order filter run twice loses 6 dB at its corner; a corner raised by this, 3 dB at the
# cut-off of a low-pass, or lowered by it, at that of a high-pass.
CORNER_FACTOR = (np.sqrt(2.0) - 1.0) ** 0.25
# Both ends are extended by this much of the signal, whatever the sampling rate [s].
EXTENSION_S = 0.5


def pass_corner(frequency_hz: float, rate_hz: float, factor: float = CORNER_FACTOR) -> float:
    """Corner [Hz] of one pass, so that both have half power at a frequency below half the rate.

    The factor applies to the frequencies of the analog filter, which the bilinear transform warps.
    """
    warped = np.tan(np.pi * frequency_hz / rate_hz) / factor
    return float(np.arctan(warped) * rate_hz / np.pi)


def both_ways(
    sections: Array, signals: Array, rate_hz: float, ends: Literal["odd", "even"]
) -> Array:
    """Signals (T, ...) through second-order sections, forwards and backwards: (T, ...).

    `ends`: extended through the end point ("odd"), which keeps a slope there, or mirrored
    ("even"), which keeps a level.
    """
    # Takes longer to load than most input to be refused, which needs no filter.
    from scipy.signal import sosfiltfilt

    extension = min(round(EXTENSION_S * rate_hz), len(signals) - 1)
    return sosfiltfilt(sections, signals, axis=0, padtype=ends, padlen=extension)
