"""Ranges of the clavicle and scapula coordinates of a participant, beyond which joints resist.

DAS3's ranges are those of one body. A participant's own recorded motion lies inside the
participant's range, so each is widened to it, but for the lower end of clavicle elevation (SC_z):
with relaxed muscles the capsule of the sternoclavicular joint carries the hanging girdle (Bearn
1967, J Anat 101: 159-170), so that range ends where the clavicle is while the arm hangs.

Letters: F recorded frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from scapulohumeral.model.rotations import ANGLE_NAMES, Array, quaternion_to_matrix, trial_to_pose
from scapulohumeral.model.tables import Coordinate

# Coordinates of SC and AC.
GIRDLE = ANGLE_NAMES[:6]
DEPRESSION = "SC_z"
# The arm hangs in frames this close to its lowest elevation over the thorax.
HANGING_RAD = np.deg2rad(5.0)


def girdle_range(coordinates: Mapping[str, Coordinate], angles: Array) -> dict[str, list[float]]:
    """Least and largest angle [rad] of the six coordinates of SC and AC.

    Parameters
    ----------
    coordinates : of the base model, by name
    angles : (F, 10) [rad]           all recorded frames, in the order of ``rotations.ANGLE_NAMES``
    """
    elevation = arm_elevation(angles)
    hanging = elevation <= elevation.min() + HANGING_RAD
    ranges = {}
    for name, own in zip(GIRDLE, angles[:, : len(GIRDLE)].T, strict=True):
        base = coordinates[name]
        least = np.median(own[hanging]) if name == DEPRESSION else own.min()
        ranges[name] = [min(base.min_rad, float(least)), max(base.max_rad, float(own.max()))]
    return ranges


def arm_elevation(angles: Array) -> Array:
    """Angle (F,) [rad] between the long axes of humerus and thorax."""
    pose = trial_to_pose(angles)
    clavicle, scapula, humerus = (
        quaternion_to_matrix(pose[:, first:last]) for first, last in pairwise((0, 4, 8, 12))
    )
    return np.arccos(np.clip((clavicle @ scapula @ humerus)[:, 1, 1], -1.0, 1.0))
