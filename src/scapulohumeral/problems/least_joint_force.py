"""The least glenohumeral force with which any activations hold a still pose.

No cost has a say in it: a limit on the joint force that lies below cannot be met at that pose,
whatever decides between muscles.

Letters: M muscles, D directions.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.optimize import linprog

from scapulohumeral.model.rotations import Array
from scapulohumeral.problems.static_posture import REACTION_COLUMNS, Posture

# The size of a force is its largest component along so many directions, which misses less than 2 %.
DIRECTIONS = 1000


@cache
def _directions() -> Array:
    """Unit vectors (D, 3), evenly over the sphere (Fibonacci's spiral)."""
    place = np.arange(DIRECTIONS) + 0.5
    height, turn = 1.0 - 2.0 * place / DIRECTIONS, np.pi * (1.0 + np.sqrt(5.0)) * place
    radius = np.sqrt(1.0 - height**2)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), height])


def least_joint_force(posture: Posture, pose: Array) -> float:
    """Least joint force [N] in static equilibrium at a pose (13,); not a number if none holds it.

    A linear programme: at a still pose joint moments are linear in activations and reaction.
    """
    q, u = pose[None], np.zeros((1, 10))
    still = np.concatenate([pose, np.zeros(23)])[None]
    forces, muscles = posture.forces, posture.muscles
    idle = np.zeros((1, len(muscles.names)))
    passive, _, by_activation = forces.jacobian(q, u, idle, muscles)
    balance = forces.dynamics.residual(still, posture.parameters) + passive
    by_reaction = forces.dynamics.jacobian(still, posture.parameters)[0][:, REACTION_COLUMNS]
    return least_force(balance[0], by_activation[0], by_reaction)


def least_force(balance: Array, by_activation: Array, by_reaction: Array) -> float:
    """Least norm of r (3,) with balance + by_activation a + by_reaction r = 0, 0 <= a <= 1."""
    rows, count = by_activation.shape
    directions = _directions()
    size = np.full((len(directions), 1), -1.0)
    result = linprog(
        np.concatenate([np.zeros(count + 3), [1.0]]),
        A_ub=np.hstack([np.zeros((len(directions), count)), directions, size]),
        b_ub=np.zeros(len(directions)),
        A_eq=np.hstack([by_activation, by_reaction, np.zeros((rows, 1))]),
        b_eq=-balance,
        bounds=[(0.0, 1.0)] * count + [(None, None)] * 3 + [(0.0, None)],
        method="highs",
    )
    if not result.success or result.x is None:
        return np.nan
    return float(np.linalg.norm(result.x[count : count + 3]))
