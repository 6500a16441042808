"""Segment frames from bony landmarks, as the ISB recommends (Wu et al. 2005, J Biomech 38:981).

The axes are those of the model: x to the right, y up, z to the back in the thorax, so that the
ISB's (X, Y, Z) are (-z, y, x) here. Carried over to DAS3's own landmarks these frames coincide with
its segments: the joint angles need no offsets.

Letters: T frames in time. A matrix R maps vectors from segment to laboratory, columns are axes.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array

THORAX = ("IJ", "PX", "C7", "T8")
SCAPULA = ("AA", "TS", "AI")
HUMERUS = ("GH", "EL", "EM")
CLAVICLE = ("SC", "AC")
FOREARM = ("US",)
Points = Mapping[str, Array]


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) at length one."""
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def axes_matrix(x: Array, y: Array) -> Array:
    """Rotation matrices (T, 3, 3) with orthogonal axes x, y (T, 3), and z = x cross y."""
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def thorax_frame(points: Points, first_frame: int = 1) -> Array:
    """Thorax (T, 3, 3): y from mid(PX, T8) to mid(IJ, C7), x normal to IJ, C7 and mid(PX, T8).

    Raises
    ------
    DataError                        the landmarks lie on a line in some frame, which is named as
                                     frames of the file count, from `first_frame` on
    """
    low, high = (points["PX"] + points["T8"]) / 2.0, (points["IJ"] + points["C7"]) / 2.0
    up = high - low
    right = np.cross(points["IJ"] - low, points["C7"] - low)
    return _frame("thorax", THORAX, right, up, "y", first_frame)


def scapula_frame(points: Points, first_frame: int = 1) -> Array:
    """Scapula (T, 3, 3): x from TS to AA, z normal to AA, TS and AI, to the back.

    Raises
    ------
    DataError                        as `thorax_frame`
    """
    x = points["AA"] - points["TS"]
    return _frame("scapula", SCAPULA, x, points["AA"] - points["AI"], "x", first_frame)


def humerus_frame(points: Points, first_frame: int = 1) -> Array:
    """Humerus (T, 3, 3): y from mid(EL, EM) to GH, x in the plane of GH, EL and EM, to EL.

    This is the ISB's first definition, which needs no forearm.

    Raises
    ------
    DataError                        as `thorax_frame`
    """
    y = points["GH"] - elbow_centre(points)
    return _frame("humerus", HUMERUS, points["EL"] - points["EM"], y, "y", first_frame)


def elbow_centre(points: Points) -> Array:
    """Midpoint of the epicondyles, (T, 3)."""
    return (points["EL"] + points["EM"]) / 2.0


def _frame(
    segment: str, landmarks: tuple[str, ...], x: Array, y: Array, keep: str, first_frame: int
) -> Array:
    """Frame with one of two axes as it is and the other in their plane."""
    # Landmarks on a line leave the turn about it undefined; a degree of noise is 0.02.
    with np.errstate(invalid="ignore"):
        slant = np.linalg.norm(np.cross(unit(x), unit(y)), axis=-1)
    flat = np.flatnonzero(~(slant > 0.02))
    if flat.size:
        raise DataError(
            f"frame {flat[0] + first_frame}: landmarks {', '.join(landmarks)} of the {segment} lie "
            "on a line or coincide; expected a triangle. Look for swapped or merged markers there."
        )
    if keep == "x":
        first = unit(x)
        second = unit(y - np.sum(y * first, axis=-1, keepdims=True) * first)
        return axes_matrix(first, second)
    second = unit(y)
    first = unit(x - np.sum(x * second, axis=-1, keepdims=True) * second)
    return axes_matrix(first, second)
