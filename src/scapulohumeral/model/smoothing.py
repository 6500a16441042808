"""Zero-phase Butterworth filters, at any sampling rate, and raw joint angles through one.

Filters run forwards and backwards, so that they do not delay. Their corners are moved so that both
passes together have half power at the frequencies asked for (Winter 2009, Biomechanics and Motor
Control of Human Movement, section 3.4.4.2). The study's own recordings are smooth already; joint
angles are smoothed for recordings that users add.
Letters: T frames or samples.
"""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.csv_table import uniform_rate
from scapulohumeral.model.motion import TIME_COLUMN, Motion
from scapulohumeral.model.rotations import (
    Array,
    continuous_angles,
    pose_to_trial,
    trial_to_pose,
    unit_pose,
)

# Each pass is of second order: both together fall off like one of fourth order.
FILTER_ORDER = 2
# A second-order filter run twice loses 6 dB at its corner; a corner raised by this, 3 dB at the
# cut-off of a low-pass, or lowered by it, at that of a high-pass.
CORNER_FACTOR = (np.sqrt(2.0) - 1.0) ** 0.25
# Both ends are extended by this much of the signal, whatever the sampling rate [s].
EXTENSION_S = 0.5
# Fewer frames tell no noise from motion.
FEWEST_FRAMES = 10


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


def low_pass(
    signals: Array, rate_hz: float, cutoff_hz: float, ends: Literal["odd", "even"]
) -> Array:
    """Signals (T, ...) without what is above a cut-off; `ends` as of :func:`both_ways`."""
    # Takes longer to load than most input to be refused, which needs no filter.
    from scipy.signal import butter

    corner_hz = pass_corner(cutoff_hz, rate_hz)
    sections = butter(FILTER_ORDER, corner_hz, fs=rate_hz, output="sos")
    return both_ways(sections, signals, rate_hz, ends)


def smooth_recording(motion: Motion, cutoff_hz: float, source: Path | None = None) -> Motion:
    """Smooth a recording with a zero-phase Butterworth filter, forwards and backwards.

    Rotations are filtered as quaternions, with signs continuous in time, and normalised again:
    Euler angles jump at gimbal lock and at +-180 degrees, and may not be filtered. Both passes
    together have half power (-3 dB) at `cutoff_hz`.

    Parameters
    ----------
    motion : Motion                  uniform time steps, or such that were rounded for a table
    cutoff_hz : float                human arm motion is below 6 Hz, its measurement noise above
    source : Path | None             the table that it is from, for messages

    Returns
    -------
    Motion                           same times

    Raises
    ------
    DataError                        time steps are not uniform, which names the row, or there are
                                     too few frames
    ConfigError                      the cut-off is not between zero and half the sampling rate
    """
    named = f"{source}: " if source else ""
    if len(motion.time_s) < FEWEST_FRAMES:
        raise DataError(
            f"{named}{len(motion.time_s)} frames; the filter needs {FEWEST_FRAMES}. Use a "
            "longer recording."
        )
    rate_hz = uniform_rate(source or Path("recording"), TIME_COLUMN, motion.time_s)
    if not 0.0 < cutoff_hz < 0.5 * rate_hz:
        raise ConfigError(
            f"{named}cut-off {cutoff_hz} Hz; expected above 0 and below {0.5 * rate_hz:.1f} Hz "
            f"for a recording at {rate_hz:.1f} Hz."
        )
    pose = unit_pose(low_pass(trial_to_pose(motion.angles_rad), rate_hz, cutoff_hz, "odd"))
    angles = continuous_angles(pose_to_trial(pose), motion.angles_rad[0])
    return Motion(motion.time_s, angles)
