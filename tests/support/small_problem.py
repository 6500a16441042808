"""The optimal control problem of the small arm, and where its solves begin."""

import numpy as np
from small_arm import STEP, small_forces, small_motion, small_muscles, small_parameters

from scapulohumeral.ocp.objective import Objective, Trajectory
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving import initial_guess


def small_problem(equations, objective: Objective, hessian: str = "exact", **options) -> Problem:
    """The small arm with an objective; options as bounds and scalers of a problem."""
    parts = small_forces(equations), small_muscles(), small_parameters()
    return Problem(*parts, objective, hessian, **options)


def cold_guess(problem: Problem, nodes: int) -> Trajectory:
    """Where the slow elevation is looked for."""
    c = problem.collocation
    return initial_guess.from_motion(c.forces, c.muscles, c.parameters, small_motion(nodes), STEP)


def off_equalities(free: np.ndarray) -> np.ndarray:
    """A free vector nearby that meets no equality."""
    return free + 0.02 * np.random.default_rng(5).normal(size=free.size)
