"""When the arm moves, and recordings made smooth. Letters: T frames."""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.motion import Motion, resampled
from scapulohumeral.model.rotations import (
    Array,
    relative_angle,
    segment_orientations,
    trial_to_pose,
)
from scapulohumeral.model.smoothing import smooth_recording

# Share of the peak speed at which a movement starts and ends.
SPEED_SHARE = 0.05
# ASSUME: a spell above that share which never reaches this one is sway or noise at rest.
MOVING_SHARE = 0.2
# ASSUME: an arm that never turns faster is held still, and the whole trial counts as movement.
STILL_RAD_S = np.deg2rad(5.0)
# Human arm motion is below 6 Hz, marker noise above (Winter 2009, section 3.4.4.2).
CUTOFF_HZ = 6.0


def movement_window(smooth: Motion) -> tuple[float, float]:
    """Start and end of a movement [s]: where humerothoracic speed crosses 5 % of its peak.

    Parameters
    ----------
    smooth : a smoothed recording: the speed of a raw one at rest is all noise

    Returns
    -------
    start, end                       first and last crossing, spells of sway left out; the whole
                                     trial if the arm is still
    """
    time_s, speed = smooth.time_s, humerothoracic_speed(smooth)
    if speed.max() < STILL_RAD_S:
        return float(time_s[0]), float(time_s[-1])
    slow = np.flatnonzero(speed < SPEED_SHARE * speed.max())
    moving = np.flatnonzero(speed >= MOVING_SHARE * speed.max())
    # Speed k is that between frames k and k + 1.
    start = slow[slow < moving[0]].max(initial=-1) + 1
    end = slow[slow > moving[-1]].min(initial=len(speed))
    return float(time_s[start]), float(time_s[end])


def humerothoracic_speed(motion: Motion) -> Array:
    """Angular speed of the humerus in the thorax [rad/s] between neighbouring frames, (T - 1,)."""
    pose = trial_to_pose(motion.angles_rad)
    humerus = segment_orientations(pose)["humerus"]
    return relative_angle(humerus[:-1], humerus[1:]) / np.diff(motion.time_s)


def smoothed(motion: Motion, cutoff_hz: float = CUTOFF_HZ) -> Motion:
    """A recording low-pass filtered at its own times; unchanged if sampled too slowly for it.

    Time steps may differ: the filter runs on a uniform grid of the mean step. Below four times the
    cut-off rate the recording holds hardly anything that the filter would remove.
    """
    uniform = np.linspace(motion.time_s[0], motion.time_s[-1], len(motion.time_s))
    if len(uniform) < 2 or 1.0 / (uniform[1] - uniform[0]) < 4.0 * cutoff_hz:
        return motion
    on_grid = Motion(uniform, resampled(motion, uniform))
    return Motion(motion.time_s, resampled(smooth_recording(on_grid, cutoff_hz), motion.time_s))
