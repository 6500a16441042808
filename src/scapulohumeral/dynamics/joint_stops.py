"""Stops of the shoulder girdle: what resists a rotation beyond the range of a joint.

DAS3 (Chadwick et al. 2014) gives every joint angle a range, and beyond it a moment that grows with
the square of the excess. Here it acts on the Y-Z-X angles of SC and AC, expressed by the joint's
rotation matrix, so that both formulations have the same stops. The glenohumeral joint has none:
its Y-Z-Y angles are singular in the hanging arm.
"""

from __future__ import annotations

from collections.abc import Sequence

import sympy as sm


def stop_torques(
    rotation: sm.Matrix,
    limits: tuple[Sequence[sm.Expr], Sequence[sm.Expr]],
    stiffness: sm.Expr,
    eps: sm.Expr,
) -> tuple[sm.Expr, ...]:
    """Torque of the stops on the child of a joint, in its own axes [N m].

    The moment of an angle is ``stiffness`` (e- ^2 - e+ ^2) with the smooth excess
    e = (x + sqrt(x^2 + eps^2)) / 2 of x, the angle beyond an end of its range.

    Parameters
    ----------
    rotation : 3 x 3 symbols, child to parent
    limits : least and largest angles about Y, Z, X [rad]
    stiffness : N m/rad^2
    eps : rad
    """
    entries = list(rotation)
    torques = [sm.Integer(0)] * 3
    for angle, least, largest in zip(_angles_yzx(rotation), *limits, strict=True):
        moment = stiffness * (_excess(least - angle, eps) ** 2 - _excess(angle - largest, eps) ** 2)
        gradient = sm.Matrix(3, 3, [angle.diff(entry) for entry in entries])
        for axis in range(3):
            turn = rotation * sm.eye(3)[:, axis].hat()
            torques[axis] += moment * sum(g * t for g, t in zip(gradient, turn, strict=True))
    return tuple(torques)


def _angles_yzx(r: sm.Matrix) -> tuple[sm.Expr, ...]:
    """Body-fixed Y-Z-X angles of a rotation matrix, also of a scaled one."""
    return (
        sm.atan2(-r[2, 0], r[0, 0]),
        sm.atan2(r[1, 0], sm.sqrt(r[0, 0] ** 2 + r[2, 0] ** 2)),
        sm.atan2(-r[1, 2], r[1, 1]),
    )


def _excess(beyond: sm.Expr, eps: sm.Expr) -> sm.Expr:
    return (beyond + sm.sqrt(beyond**2 + eps**2)) / 2
