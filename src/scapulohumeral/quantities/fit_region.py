"""Which poses of a solution lie among those that muscle paths were fitted to.

The fit draws a recorded frame, turns clavicle and scapula under the arm and then every joint by a
margin (scapulohumeral.model.muscle_paths.pose_region). A pose is inside if some frame and turns
reach it.

Letters: N nodes, F recorded frames.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    relative_angle,
    rotation_vector_to_quaternion,
    segment_orientations,
)


def outside_region(pose: Array, recorded: Array, region: Region) -> Array:
    """Whether poses (N, 13) lie outside of what the fit drew from recorded poses (F, 13).

    Elbow flexion counts as a joint, as it does in the fit. Clavicle and scapula are put where the
    three joints are equally far from the pose, as nearly as they may turn there from a frame. So a
    pose that is called inside is inside, and one at the border may be called outside.
    """
    girdle = np.deg2rad(region.girdle_turn_deg)
    clavicle, scapula, _ = segment_orientations(pose[:, None]).values()
    own_clavicle, own_scapula, humerus = segment_orientations(recorded).values()
    # Where the scapula would be with the glenohumeral joint of the pose under the recorded arm.
    under_arm = quaternion_multiply(humerus, quaternion_conjugate(pose[:, None, 8:12]))
    placed = _turned(scapula, _turn(scapula, under_arm) * 2.0 / 3.0)
    turn = _turn(own_scapula, placed)
    tilt = _shortened(turn[..., :2], girdle)
    upward = np.clip(turn[..., 2:], *np.deg2rad(region.scapula_turn_deg))
    placed = _turned(own_scapula, np.concatenate([tilt, upward], axis=-1))
    # Where the clavicle would be with the acromioclavicular joint of the pose.
    carried = quaternion_multiply(placed, quaternion_conjugate(pose[:, None, 4:8]))
    between = _turned(clavicle, _turn(clavicle, carried) / 2.0)
    held = _turned(own_clavicle, _shortened(_turn(own_clavicle, between), girdle))
    joints = [
        relative_angle(held, clavicle),
        relative_angle(held, carried),
        relative_angle(placed, under_arm),
        np.abs(pose[:, None, 12] - recorded[:, 12]),
    ]
    return np.max(joints, axis=0).min(axis=1) > np.deg2rad(region.margin_deg)


def _turn(start: Array, end: Array) -> Array:
    """Rotation vectors (..., 3) [rad] from one orientation to another, in its own axes."""
    way = quaternion_multiply(quaternion_conjugate(start), end)
    way = way * np.where(way[..., :1] < 0.0, -1.0, 1.0)
    sine = np.linalg.norm(way[..., 1:], axis=-1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, way[..., :1])
    return angle * way[..., 1:] / np.maximum(sine, np.finfo(float).tiny)


def _turned(start: Array, turn: Array) -> Array:
    return quaternion_multiply(start, rotation_vector_to_quaternion(turn))


def _shortened(vectors: Array, longest: float) -> Array:
    """Vectors that are too long, made as long as allowed."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors * np.minimum(1.0, longest / np.maximum(size, np.finfo(float).tiny))
