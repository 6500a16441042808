"""Ranges of the clavicle and scapula coordinates of a participant, beyond which joints resist.

DAS3's ranges are those of one body. A participant's own recorded motion lies inside the
participant's range, so each is widened to it, and there are two kinds of stops (``ModelChoices``):

wide     every end lies a margin beyond what was recorded. Stops are a fence then, against motion
         that no shoulder makes, and bear nothing while the arm moves.
hanging  the recorded ends themselves, but for the lower end of clavicle elevation (SC_z): with
         relaxed muscles the capsule of the sternoclavicular joint carries the hanging girdle (Bearn
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


def girdle_range(
    coordinates: Mapping[str, Coordinate], angles: Array, stops: str, margin_rad: float
) -> dict[str, tuple[float, float]]:
    """Least and largest angle [rad] of the six coordinates of SC and AC.

    Parameters
    ----------
    coordinates : of the base model, by name
    angles : (F, 10) [rad]           all recorded frames, in the order of ``rotations.ANGLE_NAMES``
    stops : "wide" or "hanging"
    margin_rad : how far wide stops lie beyond DAS3's range and the recorded one
    """
    margin = margin_rad if stops == "wide" else 0.0
    hanging = resting(angles)
    ranges = {}
    for name, own in zip(GIRDLE, angles[:, : len(GIRDLE)].T, strict=True):
        base = coordinates[name]
        held = stops == "hanging" and name == DEPRESSION
        least = min(base.min_rad, float(np.median(own[hanging]) if held else own.min()))
        ranges[name] = (least - margin, max(base.max_rad, float(own.max())) + margin)
    return ranges


def resting(angles: Array) -> np.ndarray:
    """Whether the arm hangs in recorded frames: (F,) bool for angles (F, 10) [rad]."""
    elevation = arm_elevation(angles)
    return elevation <= elevation.min() + HANGING_RAD


def arm_elevation(angles: Array) -> Array:
    """Angle (F,) [rad] between the long axes of humerus and thorax."""
    pose = trial_to_pose(angles)
    clavicle, scapula, humerus = (
        quaternion_to_matrix(pose[:, first:last]) for first, last in pairwise((0, 4, 8, 12))
    )
    return np.arccos(np.clip((clavicle @ scapula @ humerus)[:, 1, 1], -1.0, 1.0))
