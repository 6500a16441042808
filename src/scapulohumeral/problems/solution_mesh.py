"""A solution on another mesh, or in another pose, as a start and a motion to follow.

Letters: N nodes.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import Array, continuous_angles, pose_to_trial, unit_pose
from scapulohumeral.ocp.solution import Solution

# Below this share of an interval a number of intervals counts as whole.
WHOLE_INTERVALS = 1e-6


def on_mesh(tracked: Solution, time_step_s: float) -> Solution:
    """A quaternion solution on a mesh of the same duration; without multipliers on another one.

    Raises
    ------
    ConfigError                      a mesh that does not end where the motion ends
    """
    duration = tracked.time_s[-1] - tracked.time_s[0]
    intervals = round(duration / time_step_s)
    if abs(duration / time_step_s - intervals) > WHOLE_INTERVALS * intervals:
        raise ConfigError(
            f"mesh interval {time_step_s:g} s: expected one that divides {duration:g} s, the time "
            f"of {tracked.header['trial']}. Choose the configured one divided by a whole number"
        )
    if intervals == len(tracked.time_s) - 1:
        return tracked
    time = tracked.time_s[0] + time_step_s * np.arange(intervals + 1)

    def smooth(values: Array) -> Array:
        return CubicSpline(tracked.time_s, values, axis=0)(time)

    def straight(values: Array) -> Array:
        columns = [np.interp(time, tracked.time_s, column) for column in values.T]
        return np.stack(columns, axis=1)

    straights = ("activation", "excitation", "muscle_force_N", "fibre_length", "reaction_N")
    kinked: dict[str, Any] = {name: straight(getattr(tracked, name)) for name in straights}
    reference = unit_pose(smooth(tracked.reference_pose))
    finer = replace(
        tracked,
        time_s=time,
        u=smooth(tracked.u),
        reference_rad=continuous_angles(pose_to_trial(reference), tracked.reference_rad[0]),
        reference_pose=reference,
        **kinked,
    )
    return with_pose(finer, unit_pose(smooth(tracked.q)))


def with_pose(tracked: Solution, pose: Array) -> Solution:
    """A solution in another pose; as a start it has no multipliers."""
    none = np.zeros(0)
    return replace(
        tracked,
        q=pose,
        pose=pose,
        angles_rad=pose_to_trial(pose),
        free=none,
        multipliers=none,
        lower=none,
        upper=none,
    )
