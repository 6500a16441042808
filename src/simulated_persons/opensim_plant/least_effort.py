"""Least effort that meets torques: muscles at cubed activation, unknown forces almost for nothing.

min sum c a^3 / 3 + c e a^2 / 2 + sum d s^2 / 2 + sum w (A [a, s] - b)^2 / 2 within bounds. It is
solved in the dual, whose gradient is what each row misses: convex, smooth, and with one unknown per
row instead of one per muscle, so that a trust-region method of scipy takes some milliseconds.

Letters: K rows, M muscles, U unknown forces, N = M + U.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.optimize import minimize

from scapulohumeral.errors import SolveError
from scapulohumeral.model.rotations import Array

Vector = np.ndarray[tuple[int], np.dtype[np.float64]]

QUADRATIC_SHARE = 0.05  # e: effort of small activations is not quite flat
UNKNOWN_COST = 1e-3  # d
LARGEST_MISS = 1e-3  # of a row, in its unit


@dataclass(frozen=True, eq=False)
class Demand:
    """What is asked of one frame.

    Attributes
    ----------
    matrix : A (K, N), muscles first; target : b (K,); weight : w (K,)
    cost : c (M,); low, high : bounds (N,)
    """

    matrix: Array
    target: Array
    weight: Array
    cost: Array
    low: Array
    high: Array


def least_effort(demand: Demand, multipliers: Vector) -> tuple[Array, Vector]:
    """Activations and unknown forces (N,), and multipliers (K,), from a guess of the latter.

    Raises
    ------
    SolveError                       no solution was found
    """
    value: Any = partial(_dual, demand)
    options = {"initial_trust_radius": 0.1, "max_trust_radius": 10.0, "gtol": 1e-5}
    settings: dict[str, Any] = {"hess": partial(_curvature, demand), "options": options}
    found = minimize(value, multipliers, jac=True, method="trust-exact", **settings)
    # A step too small for the digits of the value ends the search as well.
    if not np.abs(found.jac).max() <= LARGEST_MISS:
        raise SolveError(
            f"sharing of a load: a row is missed by {np.abs(found.jac).max():.2g} after "
            f"{found.nit} steps ({found.message}); expected {LARGEST_MISS}. Look at the pose: a "
            "muscle path may have jumped."
        )
    return _answer(demand, found.x)[0], found.x


def _dual(demand: Demand, multipliers: Array) -> tuple[float, Array]:
    """Value and gradient (K,) of the dual."""
    pull = demand.matrix.T @ multipliers
    answer, _ = _answer(demand, multipliers)
    count = len(demand.cost)
    a, s = answer[:count], answer[count:]
    effort = demand.cost @ (a**3 / 3.0 + QUADRATIC_SHARE * a**2 / 2.0) + UNKNOWN_COST * s @ s / 2.0
    value = 0.5 * multipliers @ (multipliers / demand.weight) - multipliers @ demand.target
    gradient = multipliers / demand.weight - demand.target + demand.matrix @ answer
    return float(value + pull @ answer - effort), gradient


def _curvature(demand: Demand, multipliers: Array) -> Array:
    """Second derivative (K, K) of the dual, where it has one."""
    slope = _answer(demand, multipliers)[1]
    return np.diag(1.0 / demand.weight) + (demand.matrix * slope) @ demand.matrix.T


def _answer(demand: Demand, multipliers: Array) -> tuple[Array, Array]:
    """Best activations and unknown forces (N,) at multipliers, and their slope by the pull."""
    pull, count, e = demand.matrix.T @ multipliers, len(demand.cost), QUADRATIC_SHARE
    scaled = pull[:count] / demand.cost
    root = np.sqrt(e**2 + 4.0 * np.maximum(scaled, 0.0))
    activation = np.where(scaled > 0.0, 0.5 * (root - e), scaled / e)
    free = np.concatenate([activation, pull[count:] / UNKNOWN_COST])
    yielding = np.full(len(pull) - count, 1.0 / UNKNOWN_COST)
    slope = np.concatenate([1.0 / (demand.cost * root), yielding])
    bounded = np.clip(free, demand.low, demand.high)
    return bounded, np.where(bounded == free, slope, 0.0)
