"""Refusal of trials in which nothing moves: a diagnosis compares movements."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording.observables import JOINT_QUATERNIONS
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    relative_angle,
    segment_orientations,
    trial_to_pose,
)

# ASSUME: a posture that is held sways by 1 to 2 deg, as much as repeated palpation differs.
LEAST_MOVEMENT_DEG = 5.0


def check_movement(path: Path, smooth: Motion) -> None:
    """Refuse a trial in which no joint, nor the humerus in the thorax, turns noticeably.

    Parameters
    ----------
    path : file; smooth : its movement, smoothed

    Raises
    ------
    DataError                        names file and largest turn
    """
    pose = trial_to_pose(smooth.angles_rad)
    joints = [pose[:, joint] for joint in JOINT_QUATERNIONS]
    joints.append(segment_orientations(pose)["humerus"])
    turns = [relative_angle(joint[:1], joint).max() for joint in joints]
    largest = np.rad2deg(max(*turns, np.ptp(pose[:, 12])))
    if largest < LEAST_MOVEMENT_DEG:
        raise DataError(
            f"{path}, columns {ANGLE_NAMES[0]} to {ANGLE_NAMES[-1]}: no joint turns by more than "
            f"{largest:.1f} deg; expected a movement of {LEAST_MOVEMENT_DEG:.0f} deg or more. "
            "Leave the trial out: a diagnosis compares movements. Angles in radians have to be "
            "multiplied by 180/pi."
        )
