"""Rows that are missing inside a recording, because markers were lost and somebody cut them.

A spline through the frames beside a hole follows their noise: with 0.5 deg of it, 0.3 s of an arm
elevation were off by 12 deg (median of eight). A hole is filled before anything is filtered, by a
curve that many frames beside it agree on: 2 deg. Of 0.6 s nothing knows better than to 5 deg.

Letters: T frames.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    Array,
    continuous_angles,
    make_continuous,
    pose_to_trial,
    trial_to_pose,
    unit_pose,
)

# A step this many times the usual one is a hole, and no rate that wavers.
HOLE_STEPS = 3.5
# Frames this near to a hole say how the motion goes on in it [s].
BESIDE_S = 0.3
# Position, speed and acceleration at both ends of a hole.
DEGREE = 5


def holes(time_s: Array) -> list[tuple[float, float]]:
    """Times of the frames before and after each hole [s]."""
    steps = np.diff(time_s)
    found = np.flatnonzero(steps > HOLE_STEPS * np.median(steps))
    return [(float(time_s[i]), float(time_s[i + 1])) for i in found]


def in_words(name: str, time_s: Array, window_s: tuple[float, float]) -> list[str]:
    """Which times of a movement nobody recorded, a sentence for all; none without holes."""
    inside = [
        f"{start:.2f} to {end:.2f} s"
        for start, end in holes(time_s)
        if end > window_s[0] and start < window_s[1]
    ]
    if not inside:
        return []
    return [
        f"{name}: no rows from {', '.join(inside)}; a smooth curve stands there, which may be off "
        "by degrees: look at it, or leave the trial out"
    ]


def filled(motion: Motion) -> Motion:
    """A recording with frames in its holes; the same if it has none."""
    time_s, pose = motion.time_s, trial_to_pose(motion.angles_rad)
    for joint in (slice(0, 4), slice(4, 8), slice(8, 12)):
        pose[:, joint] = make_continuous(pose[:, joint])
    step = float(np.median(np.diff(time_s)))
    times, poses = [time_s], [pose]
    for start, end in holes(time_s):
        beside = (time_s >= start - BESIDE_S) & (time_s <= end + BESIDE_S)
        inside = np.linspace(start, end, round((end - start) / step) + 1)[1:-1]
        times.append(inside)
        poses.append(_through(time_s[beside], pose[beside], inside))
    if len(times) == 1:
        return motion
    order = np.argsort(np.concatenate(times))
    whole = unit_pose(np.concatenate(poses)[order])
    angles = continuous_angles(pose_to_trial(whole), motion.angles_rad[0])
    return Motion(np.concatenate(times)[order], angles)


def _through(time_s: Array, pose: Array, inside: Array) -> Array:
    """Least-squares polynomial of each component of poses (T, 13), at times inside a hole."""
    middle, scale = 0.5 * (time_s[0] + time_s[-1]), 0.5 * (time_s[-1] - time_s[0])
    powers, wanted = (np.vander((times - middle) / scale, DEGREE + 1) for times in (time_s, inside))
    return wanted @ np.linalg.lstsq(powers, pose, rcond=None)[0]
