"""How fast: this solver against a limited-memory Hessian, and against plain opty.

All figures of one record are measured side by side in one run on one machine; compare ratios, not
seconds of different machines.
"""

from __future__ import annotations

import dataclasses
import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.muscle_paths.geometry import MuscleGeometry
from scapulohumeral.ocp.opty_adapter import ConstraintCollocator
from scapulohumeral.ocp.plain_opty import symbolic_equations
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.solver import Result, Start
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.problems.posed_problem import PosedProblem, SolveSettings, solve_posed
from scapulohumeral.stages.tracking import pose_tracking, read_trial

OBJECTIVE_SHARE = 1e-4
FEASIBLE = 1e-4
# Ten times what the automatic strategy needs; what is not there by then counts with its full time.
LIMITED_MEMORY_ITERATIONS = 600
REPEATS = 5


def benchmark_solver(
    trial: str, files: ModelFiles, settings: SolveSettings, opty_muscles: int, output: Path
) -> None:
    """Measure and write ``solver.json``.

    Keys: tracking_seconds, limited_memory_seconds (to the same objective within 1e-4; null if it
    did not get there), ratio_limited_memory, build_seconds, opty_build_seconds, ratio_build,
    ratio_iteration (opty over ours, functions and derivatives that an iteration evaluates, same
    muscles), opty_muscles, the largest differences of constraints and Jacobian, and what the
    figures were measured on.
    """
    posed = pose_tracking(read_trial(files, trial), files, settings)
    record = {
        "trial": trial,
        "participant": files.participant.parent.name,
        "nodes": len(posed.target.time_s),
        **compare_hessians(posed, settings),
        **compare_with_opty(posed, opty_muscles),
    }
    output.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def compare_hessians(posed: PosedProblem, settings: SolveSettings) -> dict:
    """Time to the optimum with the automatic strategy and with a limited-memory Hessian."""
    start = time.perf_counter()
    guess = Start(posed.layout().join(posed.cold_start()))
    guess_seconds = time.perf_counter() - start

    def run(strategy: str, iterations: int) -> Result:
        options = dataclasses.replace(settings, hessian=strategy, max_iterations=iterations)
        return solve_posed(posed, guess, options, None)

    ours = run("automatic", settings.max_iterations)
    other = run("limited-memory", LIMITED_MEMORY_ITERATIONS)
    reached = [
        step["seconds"]
        for step in other.history
        if abs(step["objective"] / ours.objective - 1) <= OBJECTIVE_SHARE
        and step["primal_infeasibility"] <= FEASIBLE
    ]
    seconds = reached[0] if reached else None
    return {
        "tracking_seconds": ours.seconds,
        "initial_guess_seconds": guess_seconds,
        "tracking_objective": ours.objective,
        "tracking_optimal": ours.optimal,
        "limited_memory_seconds": seconds,
        "limited_memory_total_seconds": other.seconds,
        "limited_memory_iterations": other.iterations,
        "limited_memory_objective": other.objective,
        "ratio_limited_memory": (seconds or other.seconds) / ours.seconds,
    }


def compare_with_opty(posed: PosedProblem, count: int) -> dict:
    """Build and evaluation of the problem with a few muscles, by opty alone and by this package."""
    name = posed.model.forces.dynamics.name
    start = time.perf_counter()
    dynamics = compiled.build(name)
    build_seconds = time.perf_counter() - start
    chosen = np.linspace(0, len(posed.muscles.names) - 1, count).astype(int)
    geometry, muscles = muscle_subset(posed.model.forces.geometry, posed.muscles, chosen)
    problem = Problem(
        MuscleForces(dynamics, geometry), muscles, posed.parameters, posed.objective, "exact"
    )
    start = time.perf_counter()
    equations = symbolic_equations(name, geometry, muscles, posed.parameters)
    collocator = ConstraintCollocator(
        equations.rows,
        equations.states,
        len(posed.target.time_s),
        posed.objective.step,
        instance_constraints=problem.collocator.instance_constraints,
        integration_method="midpoint",
    )
    constraints = collocator.generate_constraint_function()
    jacobian = collocator.generate_jacobian_function()
    opty_seconds = time.perf_counter() - start
    free = np.random.default_rng(0).normal(0.3, 0.1, size=(problem.num_free,))
    theirs = _seconds(lambda: (constraints(free), jacobian(free)))
    ours = _seconds(lambda: (problem.constraints(free), problem.jacobian(free)))
    return {
        "build_seconds": build_seconds,
        "opty_build_seconds": opty_seconds,
        "ratio_build": opty_seconds / build_seconds,
        "ratio_iteration": theirs / ours,
        "opty_muscles": count,
        "constraint_difference": float(np.abs(constraints(free) - problem.constraints(free)).max()),
        "jacobian_difference": _jacobian_difference(
            problem, free, jacobian(free), collocator.jacobian_indices()
        ),
        "full_model_evaluation_seconds": _full_evaluation(posed),
    }


def muscle_subset(
    geometry: MuscleGeometry, muscles: MuscleParameters, chosen: np.ndarray
) -> tuple[MuscleGeometry, MuscleParameters]:
    """Geometry and parameters of some of the muscles, with the features that they use."""
    size = len(geometry.exponents)
    used = (geometry.length[chosen] != 0).any(axis=0)
    used |= (geometry.translation[:, chosen] != 0).any(axis=(0, 1))
    used[size:] = True
    names = tuple(muscles.names[i] for i in chosen)
    arrays = {
        field.name: getattr(muscles, field.name)[chosen]
        for field in dataclasses.fields(muscles)
        if isinstance(getattr(muscles, field.name), np.ndarray)
    }
    subset = MuscleGeometry(
        names,
        geometry.exponents[used[:size]],
        geometry.length[chosen][:, used],
        geometry.translation[:, chosen][:, :, used],
        geometry.squared[chosen],
    )
    return subset, dataclasses.replace(muscles, names=names, **arrays)


def _jacobian_difference(problem: Problem, free: np.ndarray, values, indices) -> float:
    """Largest difference between opty's Jacobian and ours."""
    shape = (problem.num_constraints, problem.num_free)
    theirs = sparse.coo_matrix((values, indices), shape=shape).tocsr()
    ours = sparse.coo_matrix((problem.jacobian(free), problem.jacobianstructure()), shape=shape)
    return float(np.abs((theirs - ours.tocsr()).data).max(initial=0.0))


def _full_evaluation(posed: PosedProblem) -> float:
    """Seconds for constraints, Jacobian and exact Hessian of the full model."""
    problem = posed.problem("exact")
    free = posed.layout().join(posed.cold_start())
    multipliers = np.ones(problem.num_constraints)
    return _seconds(
        lambda: (
            problem.constraints(free),
            problem.jacobian(free),
            problem.hessian(free, multipliers, 1.0),
        )
    )


def _seconds(function: Callable[[], Any]) -> float:
    """Median seconds of a call."""
    function()
    times = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return float(np.median(times))
