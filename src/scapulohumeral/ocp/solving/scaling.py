"""The scaling that IPOPT takes from the point it starts at.

It scales objective and constraints so that no gradient there exceeds a limit (Waechter and Biegler
2006, section 3.8). A barrier is one of the scaled problem, so it means the same in several solves
only if all have one scaling.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.ocp.problem import Problem

# IPOPT's default: gradients above it are scaled down.
MAX_GRADIENT = 100.0


def gradient_scaling(largest: float | np.ndarray) -> np.ndarray:
    """Factors of functions by the largest components of their gradients."""
    return np.minimum(1.0, MAX_GRADIENT / np.maximum(largest, 1e-300))


def start_scaling(problem: Problem, free: np.ndarray) -> tuple[float, np.ndarray]:
    """Factors of the objective, and of the constraints (m,), of a solve from a point (n,)."""
    rows, _ = problem.jacobianstructure()
    largest = np.zeros(problem.num_constraints)
    np.maximum.at(largest, rows, np.abs(problem.jacobian(free)))
    objective = gradient_scaling(np.abs(problem.gradient(free)).max())
    return float(objective), gradient_scaling(largest)
