"""Muscle activations that meet torques at least effort, for many simulations at once.

min sum c a^3 / 3 + c e a^2 / 2 + sum w (A a - b)^2 / 2 with low <= a <= high, solved in the dual:
with lambda = w (b - A a) each activation follows from A^T lambda alone, so that a Newton method in
the K multipliers replaces a quadratic program in M activations.

Letters: N simulations, K rows, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

QUADRATIC_SHARE = 0.05  # e: keeps the slope of a(lambda) finite at rest
NEWTON_STEPS = 12
BACKTRACKS = 6
SUFFICIENT_DECREASE = 1e-4


@dataclass(frozen=True, eq=False)
class Allocation:
    """One allocation problem per simulation.

    Attributes
    ----------
    matrix : A (N, K, M); target : b (N, K); weight : w (N, K)
    cost : c (N, M); low, high : bounds of the activations (N, M)
    """

    matrix: np.ndarray
    target: np.ndarray
    weight: np.ndarray
    cost: np.ndarray
    low: np.ndarray
    high: np.ndarray


def allocate(problem: Allocation, multipliers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Activations (N, M) and multipliers (N, K), from a guess of the latter."""
    lam = multipliers
    value, gradient, activation, slope = _dual(problem, lam)
    for _ in range(NEWTON_STEPS):
        hessian = np.matmul(problem.matrix * slope[:, None], problem.matrix.transpose(0, 2, 1))
        diagonal = np.arange(lam.shape[1])
        hessian[:, diagonal, diagonal] += 1.0 / problem.weight
        direction = -np.linalg.solve(hessian, gradient[..., None])[..., 0]
        descent = np.sum(direction * gradient, axis=1)
        length = np.ones(len(lam))
        for _ in range(BACKTRACKS):
            trial = lam + length[:, None] * direction
            new = _dual(problem, trial)
            good = new[0] <= value + SUFFICIENT_DECREASE * length * descent + 1e-12
            if good.all():
                break
            length = np.where(good, length, 0.4 * length)
        lam = trial
        value, gradient, activation, slope = new
        if np.abs(descent).max() < 1e-10:
            break
    return activation, lam


def _dual(
    problem: Allocation, lam: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Dual value (N,), gradient (N, K), activations (N, M) and their slope by A^T lambda."""
    pull = np.einsum("nkm,nk->nm", problem.matrix, lam)
    e, scaled = QUADRATIC_SHARE, pull / problem.cost
    root = np.sqrt(e**2 + 4.0 * np.maximum(scaled, 0.0))
    free = np.where(scaled > 0, 0.5 * (root - e), scaled / e)
    activation = np.clip(free, problem.low, problem.high)
    slope = np.where(activation == free, 1.0 / (problem.cost * root), 0.0)
    effort = problem.cost * (np.abs(activation) ** 3 / 3.0 + e * activation**2 / 2.0)
    value = 0.5 * np.sum(lam**2 / problem.weight, axis=1) - np.sum(lam * problem.target, axis=1)
    value += np.sum(pull * activation - effort, axis=1)
    gradient = lam / problem.weight - problem.target
    gradient += np.einsum("nkm,nm->nk", problem.matrix, activation)
    return value, gradient, activation, slope
