"""Low-pass filter for raw recordings of joint angles.

The study's own recordings are smooth already; this serves recordings that users add.
Letters: T frames.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import Array, pose_to_trial, trial_to_pose
from scapulohumeral.model.zero_phase import FILTER_ORDER, both_ways, pass_corner

# Fewer frames tell no noise from motion.
FEWEST_FRAMES = 10
# Time steps may differ by this share of their mean, as rounded time stamps do.
STEP_TOLERANCE = 0.02


def smooth_recording(motion: Motion, cutoff_hz: float) -> Motion:
    """Smooth a recording with a zero-phase Butterworth filter, forwards and backwards.

    Rotations are filtered as quaternions, with signs continuous in time, and normalised again:
    Euler angles jump at gimbal lock and at +-180 degrees, and may not be filtered. Both passes
    together have half power (-3 dB) at `cutoff_hz` (see `zero_phase`).

    Parameters
    ----------
    motion : Motion                  uniform time steps
    cutoff_hz : float                human arm motion is below 6 Hz, its measurement noise above

    Returns
    -------
    Motion                           same times

    Raises
    ------
    DataError                        time steps are not uniform, or there are too few frames
    ConfigError                      the cut-off is not between zero and half the sampling rate
    """
    # Takes longer to load than most input to be refused, which needs no filter.
    from scipy.signal import butter

    rate_hz = _sampling_rate(motion.time_s)
    if not 0.0 < cutoff_hz < 0.5 * rate_hz:
        raise ConfigError(
            f"cut-off {cutoff_hz} Hz; expected above 0 and below {0.5 * rate_hz:.1f} Hz "
            f"for a recording at {rate_hz:.1f} Hz."
        )
    corner_hz = pass_corner(cutoff_hz, rate_hz)
    sections = butter(FILTER_ORDER, corner_hz, fs=rate_hz, output="sos")
    pose = both_ways(sections, trial_to_pose(motion.angles_rad), rate_hz, "odd")
    for quaternion in (pose[:, 0:4], pose[:, 4:8], pose[:, 8:12]):
        quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    return Motion(motion.time_s, pose_to_trial(pose))


def _sampling_rate(time_s: Array) -> float:
    steps = np.diff(time_s)
    if len(time_s) < FEWEST_FRAMES:
        raise DataError(
            f"{len(time_s)} frames; the filter needs {FEWEST_FRAMES}. Use a longer recording."
        )
    if np.ptp(steps) > STEP_TOLERANCE * steps.mean():
        worst = int(np.abs(steps - steps.mean()).argmax())
        raise DataError(
            f"frame {worst + 1}, t = {time_s[worst]:.4f} s: time step {steps[worst]:.4f} s; "
            f"expected {steps.mean():.4f} s throughout. Resample the recording first."
        )
    return float(1.0 / steps.mean())
