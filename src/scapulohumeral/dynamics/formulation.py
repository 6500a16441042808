"""Coordinates of the two formulations: unit quaternions and Euler angles.

The equations of motion are derived once in terms of rotation matrices and angular velocities;
a formulation says how both depend on its own coordinates.

Letters: Nq generalised coordinates (13 or 10), Nu generalised speeds (10).

Conventions: a joint rotation R maps child components to parent components, v_parent = R v_child;
angular velocities are those of the child relative to the parent in child axes; quaternions are
scalar first. Euler sequences are body-fixed: SC Y-Z-X, AC Y-Z-X, GH Y-Z-Y (DAS3, Chadwick et al.
2014).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

from scapulohumeral.dynamics.parameters import BALL_JOINTS
from scapulohumeral.errors import ConfigError

EULER_SEQUENCES = {"SC": "yzx", "AC": "yzx", "GH": "yzy"}
EULER_SUFFIXES = {"SC": ("y", "z", "x"), "AC": ("y", "z", "x"), "GH": ("y", "z", "yy")}
NAMES = ("quaternion", "euler")


@dataclass(frozen=True)
class Formulation:
    """Symbols of one formulation and their relation to rotations.

    Attributes
    ----------
    name : "quaternion" or "euler"
    q : generalised coordinates, Nq functions of time, joint by joint (SC, AC, GH, EL)
    u : generalised speeds, Nu functions of time, in the same joint order
    rotations : joint -> 3 x 3 rotation matrix, child to parent
    angular_velocity : joint -> 3 x 1 relative angular velocity, child axes
    kinematics : Nq x Nu matrix T(q), at most linear in q, with dq/dt = T(q) u
    polynomial_variables : indices into q of the ten variables of the muscle length polynomials
    """

    name: str
    q: tuple[sm.Expr, ...]
    u: tuple[sm.Expr, ...]
    rotations: dict[str, sm.Matrix]
    angular_velocity: dict[str, sm.Matrix]
    kinematics: sm.Matrix
    polynomial_variables: tuple[int, ...]

    @property
    def coordinate_names(self) -> tuple[str, ...]:
        """Names of the generalised coordinates."""
        return tuple(str(c.func) for c in self.q)

    @property
    def speed_names(self) -> tuple[str, ...]:
        """Names of the generalised speeds."""
        return tuple(str(c.func) for c in self.u)

    def kinematic_tensor(self) -> tuple[np.ndarray, np.ndarray]:
        """Constant and linear part of T(q): shapes (Nq, Nu) and (Nq, Nu, Nq)."""
        zero = dict.fromkeys(self.q, 0)
        constant = np.array(self.kinematics.subs(zero), dtype=float)
        linear = np.stack([np.array(self.kinematics.diff(c), dtype=float) for c in self.q], axis=-1)
        return constant, linear


def quaternion_matrix(q: tuple[sm.Expr, ...]) -> sm.Matrix:
    """Rotation matrix of a scalar-first unit quaternion, homogeneous form of degree two."""
    a, b, c, d = q
    return sm.Matrix(
        [
            [a**2 + b**2 - c**2 - d**2, 2 * (b * c - a * d), 2 * (a * c + b * d)],
            [2 * (b * c + a * d), a**2 - b**2 + c**2 - d**2, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (a * b + c * d), a**2 - b**2 - c**2 + d**2],
        ]
    )


def quaternion_rate_map(q: tuple[sm.Expr, ...]) -> sm.Matrix:
    """Map from body angular velocity to quaternion rate, 4 x 3 (paper, quaternion kinematics)."""
    a, b, c, d = q
    return sm.Matrix([[-b, -c, -d], [a, -d, c], [d, a, -b], [-c, b, a]]) / 2


def elementary_rotation(axis: str, angle: sm.Expr) -> sm.Matrix:
    """Rotation matrix about a coordinate axis, child to parent."""
    c, s = sm.cos(angle), sm.sin(angle)
    return {
        "x": sm.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]]),
        "y": sm.Matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
        "z": sm.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]]),
    }[axis]


def axis_rotation(axis: tuple[sm.Expr, ...], angle: sm.Expr) -> sm.Matrix:
    """Rodrigues' formula for a unit axis, child to parent."""
    n = sm.Matrix(axis)
    c, s = sm.cos(angle), sm.sin(angle)
    return c * sm.eye(3) + s * n.hat() + (1 - c) * n * n.T


def _elbow() -> tuple[sm.Expr, sm.Expr, sm.Matrix]:
    q, u = me.dynamicsymbols("q_EL u_EL")
    axis = sm.symbols("axis_EL_0 axis_EL_1 axis_EL_2", real=True)
    return q, u, axis_rotation(axis, q)


def quaternion_formulation() -> Formulation:
    """Spherical joints by unit quaternions, speeds are relative angular velocities."""
    q: list[sm.Expr] = []
    u: list[sm.Expr] = []
    rotations, omegas, maps = {}, {}, []
    for joint in BALL_JOINTS:
        qj = tuple(me.dynamicsymbols(f"q_{joint}_{i}") for i in range(4))
        uj = tuple(me.dynamicsymbols(f"u_{joint}_{i}") for i in "xyz")
        rotations[joint] = quaternion_matrix(qj)
        omegas[joint] = sm.Matrix(uj)
        maps.append(quaternion_rate_map(qj))
        q.extend(qj)
        u.extend(uj)
    q_el, u_el, rotations["EL"] = _elbow()
    return Formulation(
        name="quaternion",
        q=(*q, q_el),
        u=(*u, u_el),
        rotations=rotations,
        angular_velocity=omegas,
        kinematics=sm.diag(*maps, 1),
        polynomial_variables=(1, 2, 3, 5, 6, 7, 9, 10, 11, 12),
    )


def euler_formulation() -> Formulation:
    """Spherical joints by three Euler angles, speeds are the angle rates."""
    q: list[sm.Expr] = []
    u: list[sm.Expr] = []
    rotations, omegas = {}, {}
    for joint, sequence in EULER_SEQUENCES.items():
        qj = tuple(me.dynamicsymbols(f"q_{joint}_{s}") for s in EULER_SUFFIXES[joint])
        uj = tuple(me.dynamicsymbols(f"u_{joint}_{s}") for s in EULER_SUFFIXES[joint])
        steps = [elementary_rotation(axis, angle) for axis, angle in zip(sequence, qj, strict=True)]
        rotations[joint] = steps[0] * steps[1] * steps[2]
        axes = [sm.eye(3)["xyz".index(axis), :].T for axis in sequence]
        omegas[joint] = (
            steps[2].T * (steps[1].T * axes[0] * uj[0] + axes[1] * uj[1]) + axes[2] * uj[2]
        )
        q.extend(qj)
        u.extend(uj)
    q_el, u_el, rotations["EL"] = _elbow()
    return Formulation(
        name="euler",
        q=(*q, q_el),
        u=(*u, u_el),
        rotations=rotations,
        angular_velocity=omegas,
        kinematics=sm.eye(10),
        polynomial_variables=tuple(range(10)),
    )


def get_formulation(name: str) -> Formulation:
    """Formulation by name.

    Raises
    ------
    ConfigError
        If the name is neither "quaternion" nor "euler".
    """
    if name == "quaternion":
        return quaternion_formulation()
    if name == "euler":
        return euler_formulation()
    raise ConfigError(f"unknown formulation {name!r}: choose one of {', '.join(NAMES)}")
