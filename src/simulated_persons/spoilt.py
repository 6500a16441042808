"""Recorded motions with errors of measurement put in: segment frames turned, skin that slides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scapulohumeral.model.rotations import (
    pose_to_trial,
    quaternion_conjugate,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    segment_orientations,
    trial_to_pose,
)
from simulated_persons.observation import CHANNELS, perfect_measurement, turned_frames

# Skin of the upper arm loses the whole of an error at so much axial rotation.
FULL_ROTATION = np.deg2rad(60.0)


def spoilt(
    angles_rad: np.ndarray, segment: str, axis: str, turn_deg: float, growing: bool
) -> np.ndarray:
    """Joint angles (T, 10) [rad] as recorded with a turned frame.

    Parameters
    ----------
    angles_rad : (T, 10) in the order of ``rotations.ANGLE_NAMES``
    segment : "thorax", "scapula" or "humerus"; axis : of its frame, "x", "y" or "z"
    turn_deg : rotation of the recorded frame [deg]
    growing : skin over the scapula: nothing below 60 deg of elevation, all of it at 120 deg; or
        skin of the upper arm, axis y: in proportion to axial rotation since the start, all of it at
        60 deg, against it

    Raises
    ------
    ValueError                       skin that slides over another segment, or another axis
    """
    pose = trial_to_pose(np.unwrap(angles_rad, axis=0))
    turn = np.deg2rad(turn_deg) * np.eye(3)["xyz".index(axis)]
    if growing and (segment, axis) == ("humerus", "y"):
        slid = rotation_vector_to_quaternion(-_rolled(pose)[:, None] / FULL_ROTATION * turn)
        pose[:, 8:12] = quaternion_multiply(pose[:, 8:12], slid)
        return np.unwrap(pose_to_trial(pose), axis=0)
    if growing and segment != "scapula":
        raise ValueError(
            f"growing error of the {segment} about {axis}; expected that of the scapula, or of the "
            "humerus about y"
        )
    name = "artefact_rad" if growing else f"{segment}_rad"
    measurement = replace(perfect_measurement(np.ones(len(CHANNELS))), **{name: turn})
    return np.unwrap(pose_to_trial(turned_frames(pose, measurement)), axis=0)


def _rolled(pose: np.ndarray) -> np.ndarray:
    """Axial rotation (T,) [rad] of the humerus in the thorax since the start of poses (T, 13).

    With the long axis swung back the shortest way, what is left of the rotation is about it.
    """
    humerus = segment_orientations(pose)["humerus"]
    since = quaternion_multiply(quaternion_conjugate(humerus[:1]), humerus)
    return np.unwrap(2.0 * np.arctan2(since[:, 2], since[:, 0]))
