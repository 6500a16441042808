"""Which poses of a solution lie among those that muscle paths were fitted to.

The fit draws a recorded frame, turns the scapula under the arm within an interval and every joint
by a margin (scapulohumeral.model.muscle_paths.pose_region). A pose is inside if some frame and turn
reach it.

Letters: N nodes, F recorded frames, K turns.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    rotation_vector_to_quaternion,
)

# Turns of the scapula that are tried [deg]: half a step misses a pose by less than a degree.
TURN_STEP_DEG = 2.0
JOINTS = (slice(0, 4), slice(4, 8), slice(8, 12))


def outside_region(pose: Array, recorded: Array, region: Region) -> Array:
    """Whether poses (N, 13) lie outside of what the fit drew from recorded poses (F, 13).

    Elbow flexion counts as a joint, as it does in the fit.
    """
    low, high = region.scapula_turn_deg
    count = int(np.ceil((high - low) / TURN_STEP_DEG)) + 1
    distance = np.full(len(pose), np.inf)
    for turn in np.deg2rad(np.linspace(low, high, count)):
        turned = _scapula_turned(recorded, turn)
        largest = np.abs(pose[:, None, 12] - turned[None, :, 12])
        for joint in JOINTS:
            agreement = np.abs(pose[:, joint] @ turned[:, joint].T)
            largest = np.maximum(largest, 2.0 * np.arccos(np.clip(agreement, 0.0, 1.0)))
        distance = np.minimum(distance, largest.min(axis=1))
    return distance > np.deg2rad(region.margin_deg)


def _scapula_turned(pose: Array, upward: float) -> Array:
    """Poses (F, 13) with the scapula turned about its own z axis [rad] under clavicle and arm."""
    turn = rotation_vector_to_quaternion(np.array([0.0, 0.0, upward]))
    turned = pose.copy()
    turned[:, 4:8] = quaternion_multiply(pose[:, 4:8], turn)
    turned[:, 8:12] = quaternion_multiply(quaternion_conjugate(turn), pose[:, 8:12])
    return turned
