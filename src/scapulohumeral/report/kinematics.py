"""Curves to draw: segment angles in the thorax, group means, and measures of a spike.

Letters: N nodes, T frames, M muscles, G groups.
"""

from __future__ import annotations

import warnings

import numpy as np

from scapulohumeral.model.rotations import Array, EulerSequence, quaternion_to_euler, relative_angle
from scapulohumeral.report.paper import SINGULAR_ELEVATION_DEG
from scapulohumeral.stages.tracking_metrics import segment_orientations

SEGMENT_SEQUENCES: dict[str, EulerSequence] = {
    "clavicle": "YZX",
    "scapula": "YZX",
    "humerus": "YZY",
}
# Columns of `thorax_angles` that mean nothing while the arm hangs: first and third humeral angle.
SINGULAR_COLUMNS = (6, 8)
ELEVATION_COLUMN = 7


def thorax_angles(pose: Array) -> Array:
    """Angles of clavicle, scapula and humerus in the thorax, and of the elbow.

    The first and third angle of the humerus are not a number below the elevation at which the
    sequence Y-Z-Y is called singular in the paper.

    Parameters
    ----------
    pose : array, shape (T, 13)      unit quaternions SC, AC, GH and elbow angle [rad]

    Returns
    -------
    array, shape (T, 10)             [deg], clavicle Y-Z-X, scapula Y-Z-X, humerus Y-Z-Y, elbow
    """
    with warnings.catch_warnings():
        # scipy warns at exact gimbal lock, where these angles are masked below.
        warnings.filterwarnings("ignore", message="Gimbal lock")
        angles = [
            quaternion_to_euler(orientation, SEGMENT_SEQUENCES[segment])
            for segment, orientation in segment_orientations(pose).items()
        ]
    result = np.rad2deg(np.hstack([*angles, pose[:, 12:]]))
    singular = result[:, ELEVATION_COLUMN] < SINGULAR_ELEVATION_DEG
    for column in SINGULAR_COLUMNS:
        result[singular, column] = np.nan
    return result


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
