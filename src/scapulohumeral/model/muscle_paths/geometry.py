"""Muscle-tendon lengths as functions of the coordinates, linear in features that muscles share.

Features are monomials of the ten polynomial variables (quaternion vector parts and elbow angle, or
Euler angles and elbow angle), followed by the 36 entries of four rotation matrices. Straight paths
are exact: their squared length is affine in the entries of rotation matrices. Wrapping paths are
polynomials, some of them of the squared length too; ``fit`` finds them.

Letters: M muscles, V = 10 variables, Fm monomials, F = Fm + 36 features.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ModelError
from scapulohumeral.model.record import ModelRecord, MuscleRecord
from scapulohumeral.model.rotations import Array

BODY_JOINTS: dict[str, tuple[str, ...]] = {
    "thorax": (),
    "clavicle_r": ("SC",),
    "scapula_r": ("SC", "AC"),
    "humerus_r": ("SC", "AC", "GH"),
    "ulna_r": ("SC", "AC", "GH", "EL"),
    "radius_r": ("SC", "AC", "GH", "EL"),
}
JOINT_VARIABLES = {"SC": (0, 1, 2), "AC": (3, 4, 5), "GH": (6, 7, 8), "EL": (9,)}
ROTATION_BLOCKS = ("SC", "AC", "TS", "GH")
# Which rotation matrix turns vectors of a later body of the chain into an earlier one; TS is that
# of the scapula in the thorax.
CHAIN = ("thorax", "clavicle_r", "scapula_r", "humerus_r")
CHAIN_JOINTS = ("sc1", "ac1", "gh1")
BLOCK_BETWEEN = {
    ("thorax", "clavicle_r"): "SC",
    ("clavicle_r", "scapula_r"): "AC",
    ("thorax", "scapula_r"): "TS",
    ("scapula_r", "humerus_r"): "GH",
}
ROTATION_FEATURES = 9 * len(ROTATION_BLOCKS)


@dataclass(frozen=True, eq=False)
class MuscleGeometry:
    """Lengths and joint-centre derivatives of all muscles, linear in shared features.

    Attributes
    ----------
    names : M muscle names
    exponents : (Fm, V) exponents of the monomials; the first is the constant
    length : (M, F) coefficients C; y = C f is the length [m], or its square [m^2] if squared
    translation : (3, M, F) coefficients D; dL/dt_k = D_k f, or D_k f / L if squared; t moves the
        humeral head along scapula axes [m]
    squared : (M,) bool
    """

    names: tuple[str, ...]
    exponents: Array
    length: Array
    translation: Array
    squared: Array


def crossed_joints(muscle: MuscleRecord) -> tuple[str, ...]:
    """Joints between the bodies that a muscle's path points lie on."""
    chains = [set(BODY_JOINTS[point.body]) for point in muscle.points]
    crossed = chains[0].union(*chains) - chains[0].intersection(*chains)
    return tuple(joint for joint in JOINT_VARIABLES if joint in crossed)


def is_straight(muscle: MuscleRecord) -> bool:
    """Whether a muscle runs straight from origin to insertion."""
    return not muscle.wraps and len(muscle.points) == 2


def straight_coefficients(record: ModelRecord, muscle: MuscleRecord) -> tuple[Array, Array]:
    """Exact coefficients of a straight path between two bodies of the chain.

    The line from origin to insertion is a sum of vectors c_k, each fixed in one body: from the
    origin to the next joint, from joint to joint, from the last joint to the insertion. So its
    squared length is sum |c_k|^2 + 2 sum c_k . R_kl c_l, affine in rotation matrices R_kl.

    Returns
    -------
    squared : array, shape (1 + 36,)   constant and rotation-feature coefficients of L^2 [m^2]
    arms : array, shape (3, 1 + 36)    the same of L dL/dt [m], t along scapula axes

    Raises
    ------
    ModelError                         if the squared length needs other rotation matrices
    """
    ends = sorted(muscle.points, key=lambda point: len(BODY_JOINTS[point.body]))
    names = [point.body for point in ends]
    origin, insertion = (np.array(point.location_m) for point in ends)
    start, stop = (CHAIN.index(name) if name in CHAIN else -1 for name in names)
    bodies = CHAIN[start : stop + 1]
    pairs = list(combinations(bodies, 2))
    if not pairs or not set(pairs) <= set(BLOCK_BETWEEN):
        raise ModelError(
            f"muscle {muscle.name}: no exact straight path from {names[0]} to {names[1]}; "
            f"expected one of {', '.join(' to '.join(pair) for pair in BLOCK_BETWEEN)}. "
            "Give it a wrapping surface or a third path point."
        )
    joints = [np.array(record.joints[name].location_m) for name in CHAIN_JOINTS[start:stop]]
    vectors = dict(zip(bodies, [joints[0] - origin, *joints[1:], insertion], strict=True))
    squared, arms = np.zeros(1 + ROTATION_FEATURES), np.zeros((3, 1 + ROTATION_FEATURES))
    squared[0] = sum(vector @ vector for vector in vectors.values())
    for pair in pairs:
        entries = 1 + 9 * ROTATION_BLOCKS.index(BLOCK_BETWEEN[pair]) + np.arange(9)
        squared[entries] = 2.0 * np.outer(vectors[pair[0]], vectors[pair[1]]).ravel()
        if pair[1] == "humerus_r":
            arms[:, 0] = vectors["scapula_r"]
            for row in range(3):
                arms[row, entries[3 * row : 3 * row + 3]] = vectors["humerus_r"]
    return squared, arms


def save_geometry(geometry: MuscleGeometry, path: Path) -> None:
    """Write a geometry as ``.npz``."""
    np.savez_compressed(
        path,
        names=np.array(geometry.names),
        exponents=geometry.exponents,
        length=geometry.length,
        translation=geometry.translation,
        squared=geometry.squared,
    )


def load_geometry(path: Path) -> MuscleGeometry:
    """Read what :func:`save_geometry` wrote."""
    with np.load(path, allow_pickle=False) as data:
        return MuscleGeometry(
            tuple(str(n) for n in data["names"]),
            data["exponents"],
            data["length"],
            data["translation"],
            data["squared"],
        )
