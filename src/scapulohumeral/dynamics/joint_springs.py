"""Passive springs of the joints: a linear law and an exponential one, toward one rest pose.

Both pull about the axis of the rotation away from rest, so they are the same in both formulations.
The linear one is k sin(angle), smooth for every rotation. The exponential one is the law of the
authors' program (zoufaond/Quaternion-Predictive-SHR, Python/equations.py), with torque t in N m:

    t (exp(2 angle / 0.6) - 1) / (exp(2) - 1)
"""

from __future__ import annotations

import sympy as sm

# Angle at which an exponential spring pulls with (e^2 - 1) / (e^2 - 1) = 1 of its torque [rad], and
# the growth of its exponent up to there [1].
FULL_ANGLE_RAD = 0.6
GROWTH = 2
# Rotations below it count with this angle about their axis [rad]: the axis of none is not defined.
SMOOTH_RAD = sm.Rational(1, 100)


def spring_torques(
    rotation: sm.Matrix, rest: sm.Matrix, stiffness: sm.Expr, torque: sm.Expr
) -> tuple[sm.Expr, ...]:
    """Torque of the springs on the child of a ball joint, in its own axes [N m].

    Parameters
    ----------
    rotation, rest : 3 x 3 symbols, child to parent, now and at rest
    stiffness : of the linear spring [N m/rad]; torque : of the exponential one [N m]
    """
    twist = rest.T * rotation
    axis = [twist[2, 1] - twist[1, 2], twist[0, 2] - twist[2, 0], twist[1, 0] - twist[0, 1]]
    sines = [component / 2 for component in axis]
    sine = sm.sqrt(sum(component**2 for component in sines) + SMOOTH_RAD**2)
    angle = sm.atan2(sine, (twist.trace() - 1) / 2)
    pull = stiffness + torque * _exponential(angle) / sine
    return tuple(-pull * component for component in sines)


def hinge_torque(turn: sm.Expr, stiffness: sm.Expr, torque: sm.Expr) -> sm.Expr:
    """Torque of the springs of a hinge turned away from rest by an angle [rad]."""
    angle = sm.sqrt(turn**2 + SMOOTH_RAD**2)
    return -(stiffness + torque * _exponential(angle) / angle) * turn


def _exponential(angle: sm.Expr) -> sm.Expr:
    growth = sm.exp(GROWTH * angle / sm.Float(FULL_ANGLE_RAD)) - 1
    return growth / (sm.exp(sm.Float(GROWTH)) - 1)
