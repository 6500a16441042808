"""Frames of a movement in the coordinates of the plant, and what OpenSim says about them.

Coordinates are those of clavicle and scapula (Y-Z-X), three of the humerus in the scapula, and the
elbow angle. The recorded sequence of the humerus, Y-Z-Y, is singular with the arm hanging, where
accelerations of its angles mean nothing; here the humerus turns about Z, X and Y, which is singular
only where it is lifted by 90 deg against the scapula, forward or backward.

Letters: F frames, M muscles, A activations.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.errors import SolveError
from scapulohumeral.model.rotations import (
    euler_to_quaternion,
    make_continuous,
    quaternion_to_euler,
)

GH_SEQUENCE: Literal["ZXY"] = "ZXY"
# Activations at which the force of each muscle is asked for; between them it is hardly curved.
ACTIVATIONS = np.array([0.01, 0.1, 0.3, 0.6, 1.0])


@dataclass(frozen=True, eq=False)
class Mechanics:
    """Frames of a movement as OpenSim sees them.

    Attributes
    ----------
    torque : (F, 10) of OpenSim's inverse dynamics less forces from outside, on the coordinates
    arms : (F, M, 10) torque per unit of tendon force [m]
    force : (F, A, M) tendon force at `ACTIVATIONS`, in equilibrium with the fibres [N]
    support : (F, 3, 10) torque per unit force of the thorax on the scapula at its two contact
        points, along the normal of the surface, and per unit tension of the conoid ligament [m]
    pull : (F, M, 3) force on the arm below the shoulder per unit of tendon force, scapula axes [1]
    burden : (F, 3) weight and forces from outside on that arm, scapula axes [N]
    """

    torque: np.ndarray
    arms: np.ndarray
    force: np.ndarray
    support: np.ndarray
    pull: np.ndarray
    burden: np.ndarray

    def __post_init__(self) -> None:
        """Refuse what OpenSim could not compute: fibres without an equilibrium are not a number.

        Raises
        ------
        SolveError                       a value is not finite
        """
        for name, part in vars(self).items():
            frames = np.flatnonzero(~np.isfinite(part).reshape(len(part), -1).all(axis=1))
            if frames.size:
                raise SolveError(
                    f"OpenSim gives no number for {name} in {frames.size} frames, first in frame "
                    f"{frames[0]}; expected finite values. Look at the pose: fibres may be "
                    "stretched beyond what their muscle model holds for."
                )

    def at(self, frame: int) -> Mechanics:
        """One frame."""
        return Mechanics(*(part[frame : frame + 1] for part in vars(self).values()))


def coordinates_of(pose: np.ndarray) -> np.ndarray:
    """Coordinates (F, 10) [rad] of successive poses (F, 13), without jumps of full turns."""
    girdle = [quaternion_to_euler(pose[:, k : k + 4], "YZX") for k in (0, 4)]
    humerus = Rotation.from_quat(pose[:, 8:12], scalar_first=True).as_euler(GH_SEQUENCE)
    return np.unwrap(np.hstack([*girdle, humerus, pose[:, 12:]]), axis=0)


def pose_of(coordinates: np.ndarray) -> np.ndarray:
    """Poses (F, 13) of successive coordinates (F, 10)."""
    girdle = [euler_to_quaternion(coordinates[:, k : k + 3], "YZX") for k in (0, 3)]
    turn = Rotation.from_euler(GH_SEQUENCE, coordinates[:, 6:9])
    joints = (*girdle, turn.as_quat(scalar_first=True))
    return np.hstack([*(make_continuous(joint) for joint in joints), coordinates[:, 9:]])
