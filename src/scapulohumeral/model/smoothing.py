"""Low-pass filter for raw recordings of joint angles.

The study's own recordings are smooth already; this serves recordings that users add.
Letters: T frames.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import Array, pose_to_trial, trial_to_pose

FILTER_ORDER = 2
# A second-order filter run twice loses 6 dB at its corner; a corner raised by this, 3 dB at the
# cut-off.
CORNER_FACTOR = (np.sqrt(2.0) - 1.0) ** 0.25
# The filter extends both ends by mirrored frames.
FEWEST_FRAMES = 10
# Time steps may differ by this share of their mean, as rounded time stamps do.
STEP_TOLERANCE = 0.02


def smooth_recording(motion: Motion, cutoff_hz: float) -> Motion:
    """Smooth a recording with a zero-phase Butterworth filter, forwards and backwards.

    Rotations are filtered as quaternions, with signs continuous in time, and normalised again:
    Euler angles jump at gimbal lock and at +-180 degrees, and may not be filtered. The corner is
    raised so that both passes together have half power (-3 dB) at `cutoff_hz`
    (Winter 2009, Biomechanics and Motor Control of Human Movement, section 3.4.4.2).

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
    from scipy.signal import butter, sosfiltfilt

    rate_hz = _sampling_rate(motion.time_s)
    highest_hz = 0.5 * rate_hz * CORNER_FACTOR
    if not 0.0 < cutoff_hz < highest_hz:
        raise ConfigError(
            f"cut-off {cutoff_hz} Hz; expected above 0 and below {highest_hz:.1f} Hz "
            f"for a recording at {rate_hz:.1f} Hz."
        )
    sections = butter(FILTER_ORDER, cutoff_hz / CORNER_FACTOR, fs=rate_hz, output="sos")
    pose = sosfiltfilt(sections, trial_to_pose(motion.angles_rad), axis=0)
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
