"""How fast: this solver against itself with a limited-memory Hessian.

All figures of one record are measured side by side in one run on one machine; compare ratios, not
seconds of different machines.
"""

from __future__ import annotations

import dataclasses
import json
import time
from pathlib import Path

import numpy as np

from scapulohumeral.ocp.solving.solver import Result, Start
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.problems.posed_problem import PosedProblem, SolveSettings, solve_posed
from scapulohumeral.stages.peers.opty_alone import median_seconds
from scapulohumeral.stages.tracking import pose_tracking, read_trial

OBJECTIVE_SHARE = 1e-4
FEASIBLE = 1e-4
# Ten times what the automatic strategy needs; what is not there by then counts with its full time.
LIMITED_MEMORY_ITERATIONS = 600


def benchmark_solver(trial: str, files: ModelFiles, settings: SolveSettings, output: Path) -> None:
    """Measure and write ``solver.json``.

    Keys: tracking_seconds, limited_memory_seconds (to the same objective within 1e-4; null if it
    did not get there), ratio_limited_memory, full_model_evaluation_seconds (constraints, Jacobian
    and exact Hessian), and what the figures were measured on.
    """
    posed = pose_tracking(read_trial(files, trial), files, settings)
    record = {
        "trial": trial,
        "participant": files.participant.parent.name,
        "nodes": len(posed.target.time_s),
        **compare_hessians(posed, settings),
        "full_model_evaluation_seconds": _full_evaluation(posed),
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

    clock = [time.process_time()]
    ours = run("automatic", settings.max_iterations)
    clock.append(time.process_time())
    other = run("limited-memory", LIMITED_MEMORY_ITERATIONS)
    clock.append(time.process_time())
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
        "tracking_processor_seconds": clock[1] - clock[0],
        "tracking_iterations": ours.iterations,
        "tracking_objective": ours.objective,
        "tracking_optimal": ours.optimal,
        "limited_memory_seconds": seconds,
        "limited_memory_total_seconds": other.seconds,
        "limited_memory_processor_seconds": clock[2] - clock[1],
        "limited_memory_iterations": other.iterations,
        "limited_memory_objective": other.objective,
        "ratio_limited_memory": (seconds or other.seconds) / ours.seconds,
    }


def _full_evaluation(posed: PosedProblem) -> float:
    """Seconds for constraints, Jacobian and exact Hessian of the full model."""
    problem = posed.problem("exact")
    free = posed.layout().join(posed.cold_start())
    multipliers = np.ones(problem.num_constraints)
    return median_seconds(
        lambda: (
            problem.constraints(free),
            problem.jacobian(free),
            problem.hessian(free, multipliers, 1.0),
        )
    )
