"""Derivatives of an optimal solution by parameters, from one factorisation of the KKT matrix.

With R the derivative of the optimality conditions by the parameters at a fixed point, the implicit
function theorem gives d(w, lambda)/d theta = -K^-1 R (Fiacco 1983; Pirnay, Lopez-Negrete and
Biegler 2012). R is taken by central differences of the gradient of the Lagrangian and of the
constraints, so parameters may act anywhere in the equations, the objective or the bounds.

The derivatives belong to the active set of the solution: they are one-sided where a bound becomes
active or inactive. A barrier target (:class:`SolverSettings`) smooths such bounds: on a tracked
elevation, 1e-6 raises the objective by 0.3 %, 1e-5 by 3 %, 1e-4 by 31 %, and warm solves for nearby
parameters take 3 iterations at 1e-5 instead of 19.

Letters: n unknowns, m constraints, P parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scapulohumeral.ocp.objective import Objective
from scapulohumeral.ocp.optimality.kkt import KktSystem
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.ocp.transcription import Collocation

# Central differences of smooth functions: truncation 1e-10 and rounding stay far below 1e-6.
RELATIVE_STEP = 1e-5


@dataclass(frozen=True, eq=False)
class ProblemParts:
    """A problem for other parameters, without opty's set-up, which takes longer than a solve.

    Make it from a problem by :func:`parts_of` and :func:`dataclasses.replace`.

    Attributes
    ----------
    collocation : with other dynamics or muscle parameters
    objective : with other weights or references
    lower, upper : (n,) bounds
    """

    collocation: Collocation
    objective: Objective
    lower: np.ndarray
    upper: np.ndarray


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """Derivatives of a solution by parameters: free (n, P) and multipliers (m, P)."""

    free: np.ndarray
    multipliers: np.ndarray


def parts_of(problem: Problem) -> ProblemParts:
    """The parts of a problem that parameters can change."""
    return ProblemParts(
        problem.collocation, problem.objective_function, problem.lower_bound, problem.upper_bound
    )


def condition_derivatives(
    kkt: KktSystem,
    point: Start,
    parts_for: Callable[[np.ndarray], ProblemParts],
    theta: np.ndarray,
    steps: np.ndarray | None = None,
) -> np.ndarray:
    """Derivatives R of the optimality conditions by the parameters at a fixed point, (n + m, P).

    Parameters
    ----------
    kkt : at the point
    point : solution for theta
    parts_for : problem for parameters (P,); constraints at single instants must not depend on them
    theta : parameters (P,), each in its own unit
    steps : half widths of the differences (P,); by default 1e-5 max(1, abs(theta))
    """
    theta = np.asarray(theta, dtype=float)
    steps = RELATIVE_STEP * np.maximum(1.0, np.abs(theta)) if steps is None else steps
    derivatives = np.zeros((kkt.factors.order, theta.size))
    for column, step in enumerate(steps):
        shift = step * np.eye(theta.size)[column]
        above, below = parts_for(theta + shift), parts_for(theta - shift)
        change = _conditions(point, above) - _conditions(point, below)
        # A bound that moves takes its unknown along: dz = -Sigma (dw - dl).
        change[: kkt.unknowns] -= kkt.sigma_lower * (above.lower - below.lower)
        change[: kkt.unknowns] -= kkt.sigma_upper * (above.upper - below.upper)
        derivatives[: change.size, column] = change / (2 * step)
    derivatives[: kkt.unknowns][kkt.fixed] = 0.0
    return derivatives


def sensitivity(kkt: KktSystem, derivatives: np.ndarray) -> Sensitivity:
    """Derivatives of the solution from those of the conditions (n + m, P)."""
    steps = kkt.solve(-derivatives)
    return Sensitivity(steps[: kkt.unknowns], steps[kkt.unknowns :])


def _conditions(point: Start, changed: ProblemParts) -> np.ndarray:
    """Conditions that depend on parameters: (n,) and the collocation constraints."""
    free, collocation, layout = point.free, changed.collocation, changed.collocation.layout
    residual = collocation.constraints(free)
    gradient = layout.join_gradient(changed.objective.gradient(layout.split(free)))
    rows, columns = collocation.jacobian_structure
    pulled = collocation.jacobian(free) * np.asarray(point.multipliers)[rows]
    gradient += np.bincount(columns, pulled, free.size)
    return np.concatenate([gradient, residual])
