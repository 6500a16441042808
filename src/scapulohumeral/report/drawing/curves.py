"""Curves to draw: angles without jumps, group means, and measures of a spike.

Letters: N nodes, T frames, M muscles, G groups.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.rotations import Array, relative_angle, segment_orientations
from scapulohumeral.quantities.segment_angles import SINGULAR_ELEVATION_DEG


def unwrap_deg(angles: Array) -> Array:
    """Angles (T, K) [deg] without full turns between neighbouring numbers; gaps stay gaps."""
    result = angles.copy()
    for column in range(result.shape[1]):
        given = np.isfinite(result[:, column])
        result[given, column] = np.unwrap(result[given, column], period=360.0)
    return result


def on_branch(angles: Array, time_s: Array, reference: Array, reference_time_s: Array) -> Array:
    """Angles (T, K) [deg], shifted by full turns to be nearest to reference angles (N, K)."""
    result = angles.copy()
    for column in range(result.shape[1]):
        given = np.isfinite(reference[:, column])
        if given.any():
            near = np.interp(time_s, reference_time_s[given], reference[given, column])
            result[:, column] -= 360.0 * np.round((result[:, column] - near) / 360.0)
    return result


def orientation_error(pose: Array, reference_pose: Array, segment: str) -> Array:
    """Angle of the rotation between a segment's orientations in two motions, (T,) [deg]."""
    ours, recorded = (segment_orientations(p)[segment] for p in (pose, reference_pose))
    return np.rad2deg(relative_angle(ours, recorded))


def group_means(values: Array, groups: Array) -> dict[str, Array]:
    """Mean (N,) over the muscle elements of each group, of values (N, M), groups (M,)."""
    return {str(g): values[:, groups == g].mean(axis=1) for g in dict.fromkeys(groups.tolist())}


def largest_step(values: Array) -> float:
    """Largest change between neighbouring nodes of values (N, ...)."""
    return float(np.abs(np.diff(values, axis=0)).max())


def largest_bend(values: Array) -> float:
    """Largest second difference of values (N, ...): a spike of one node counts twice its height."""
    return float(np.abs(np.diff(values, n=2, axis=0)).max())


def passes_gimbal_lock(glenohumeral_rad: Array) -> bool:
    """Whether the second angle of the sequence Y-Z-Y (N,) [rad] comes close to zero."""
    return bool((np.abs(np.rad2deg(glenohumeral_rad)) < SINGULAR_ELEVATION_DEG).any())
