"""Recorded motions with errors of measurement put in: segment frames turned, skin that slides."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from simulated_persons.observation import CHANNELS, perfect_measurement, turned_frames


def spoilt(
    angles_rad: np.ndarray, segment: str, axis: str, turn_deg: float, growing: bool
) -> np.ndarray:
    """Joint angles (T, 10) [rad] as recorded with a turned frame.

    Parameters
    ----------
    angles_rad : (T, 10) in the order of ``rotations.ANGLE_NAMES``
    segment : "thorax", "scapula" or "humerus"; axis : of its frame, "x", "y" or "z"
    turn_deg : rotation of the recorded frame [deg]
    growing : skin over the scapula: nothing below 60 deg of elevation, all of it at 120 deg

    Raises
    ------
    ValueError                       skin that slides over another segment
    """
    if growing and segment != "scapula":
        raise ValueError(f"growing error of the {segment}; expected that of the scapula")
    turn = np.deg2rad(turn_deg) * np.eye(3)["xyz".index(axis)]
    name = "artefact_rad" if growing else f"{segment}_rad"
    measurement = replace(perfect_measurement(np.ones(len(CHANNELS))), **{name: turn})
    pose = trial_to_pose(np.unwrap(angles_rad, axis=0))
    return np.unwrap(pose_to_trial(turned_frames(pose, measurement)), axis=0)
