"""Recorded poses with turned segment frames. Letters: N nodes."""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
    segment_orientations,
)

SC, AC, GH = slice(0, 4), slice(4, 8), slice(8, 12)
# Joint that carries each segment, and the one between it and the next segment.
CARRIED_BY = {
    "thorax": (None, SC),
    "clavicle": (SC, AC),
    "scapula": (AC, GH),
    "humerus": (GH, None),
}
VERTICAL = 1


def turn_frame(pose: Array, segment: str, vector: Array) -> Array:
    """Poses (N, 13) with one recorded segment frame turned; the other segments stay.

    Parameters
    ----------
    pose : array, shape (N, 13)
    segment : "thorax", "clavicle", "scapula" or "humerus"
    vector : array, shape (3,) or (N, 3)     rotation vector about the frame's own axes [rad]
    """
    turn = rotation_vector_to_quaternion(vector)
    carrier, next_joint = CARRIED_BY[segment]
    turned = np.array(pose, dtype=float)
    if carrier is not None:
        turned[:, carrier] = quaternion_multiply(pose[:, carrier], turn)
    if next_joint is not None:
        turned[:, next_joint] = quaternion_multiply(quaternion_conjugate(turn), pose[:, next_joint])
    return turned


def elevation(pose: Array) -> Array:
    """Angle (N,) [rad] between the long axes of humerus and thorax, 0 with the arm hanging."""
    humerus = segment_orientations(pose)["humerus"]
    cosine = quaternion_to_matrix(humerus)[:, VERTICAL, VERTICAL]
    return np.arccos(np.clip(cosine, -1.0, 1.0))
