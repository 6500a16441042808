"""Angles of clavicle, scapula and humerus in the thorax, in the sequences of the paper."""

from __future__ import annotations

import warnings

import numpy as np

from scapulohumeral.model.rotations import (
    Array,
    EulerSequence,
    quaternion_to_euler,
    segment_orientations,
)

SEGMENT_SEQUENCES: dict[str, EulerSequence] = {
    "clavicle": "YZX",
    "scapula": "YZX",
    "humerus": "YZY",
}
# Columns of `thorax_angles`: thoracoscapular upward rotation, thoracohumeral elevation.
UPWARD_ROTATION_COLUMN = 4
ELEVATION_COLUMN = 7
# Columns that mean nothing while the arm hangs: first and third humeral angle.
SINGULAR_COLUMNS = (6, 8)
# Below this elevation the paper does not show them (caption of the figure of predicted
# rotations) [deg].
SINGULAR_ELEVATION_DEG = 8.0


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
