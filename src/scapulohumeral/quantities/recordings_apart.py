"""How far two recordings of one person lie apart where the arm points the same way.

No model meets a person in two sessions whose scapula was recorded otherwise in each: landmarks that
are found anew, or another posture of the trunk, turn the recorded scapula by the same amount in all
motions of a session. A model that was made from the one misses the other by about as much.

Letters: N nodes, T frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.model.rotations import Array, segment_orientations
from scapulohumeral.quantities.recording_distance import task_distance

# Long axes of the humerus nearer than this are one direction of the arm [deg]. Over it a rhythm of
# two to one turns the scapula up by 3 deg, which the nearest frame mostly stays below.
SAME_DIRECTION_DEG = 10.0
# From the elbow to the head, in the humerus (ISB).
LONG_AXIS = (0.0, 1.0, 0.0)


@dataclass(frozen=True)
class Apart:
    """Angles of the one recording minus those of the other, root mean squares over matched nodes.

    Attributes
    ----------
    matched_share : nodes of the one whose direction of the arm the other has, too [1]
    ur_rmse_deg, tilt_rmse_deg, internal_rotation_rmse_deg, clavicle_elevation_rmse_deg : as in
        :class:`~scapulohumeral.quantities.recording_distance.TaskDistance`; not a number if no node
        is matched
    turn_deg : angle of the mean turn of the scapula about its own axes, which another frame gives
    turn_sd_deg : scatter of that turn over the nodes, root mean square distance from the mean
    """

    matched_share: float
    ur_rmse_deg: float = np.nan
    tilt_rmse_deg: float = np.nan
    internal_rotation_rmse_deg: float = np.nan
    clavicle_elevation_rmse_deg: float = np.nan
    turn_deg: float = np.nan
    turn_sd_deg: float = np.nan


def recordings_apart(pose: Array, other: Array) -> Apart:
    """Distance of a recording (N, 13) from another (T, 13) of the same person, as poses.

    Each node is compared with the frame of the other whose humerus points nearest to its direction;
    axial rotation of the humerus, which skin hides, does not count.
    """
    cosine = np.clip(_direction(pose) @ _direction(other).T, -1.0, 1.0)
    same = np.rad2deg(np.arccos(cosine.max(axis=1))) < SAME_DIRECTION_DEG
    if not same.any():
        return Apart(matched_share=0.0)
    here, there = pose[same], other[cosine.argmax(axis=1)[same]]
    distance = task_distance(here, there)
    turns = (_segment(there, "scapula").inv() * _segment(here, "scapula")).as_rotvec(degrees=True)
    mean = turns.mean(axis=0)
    return Apart(
        matched_share=float(same.mean()),
        ur_rmse_deg=distance.ur_rmse_deg,
        tilt_rmse_deg=distance.tilt_rmse_deg,
        internal_rotation_rmse_deg=distance.internal_rotation_rmse_deg,
        clavicle_elevation_rmse_deg=distance.clavicle_elevation_rmse_deg,
        turn_deg=float(np.linalg.norm(mean)),
        turn_sd_deg=float(np.sqrt(np.mean(np.sum((turns - mean) ** 2, axis=1)))),
    )


def _segment(pose: Array, name: str) -> Rotation:
    return Rotation.from_quat(segment_orientations(pose)[name], scalar_first=True)


def _direction(pose: Array) -> Array:
    """Unit vectors along the humerus in the thorax, shape (N, 3)."""
    return _segment(pose, "humerus").apply(LONG_AXIS)
