"""Solving with IPOPT: phases of Hessians, progress, warm starts and statistics.

The automatic strategy starts with a Gauss-Newton Hessian, which finds the region of the optimum
without inertia corrections, and hands over to the exact Hessian, warm-started with the
multipliers, which converges quadratically.
"""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ConfigError
from scapulohumeral.ocp.memory import keep_freed_memory
from scapulohumeral.ocp.problem import HESSIANS, Problem

STRATEGIES = ("automatic", *HESSIANS)
OPTIMAL = 0
# Ipopt's numbering of MUMPS orderings; with AMD or PORD a factorisation takes several times longer.
METIS = 5
WARM_START_OPTIONS = {
    "warm_start_init_point": "yes",
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_slack_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
}


@dataclass(frozen=True)
class SolverSettings:
    """How a problem is solved.

    Attributes
    ----------
    strategy : "automatic", "exact", "gauss-newton" or "limited-memory"
    tolerance : IPOPT's scaled optimality error
    max_iterations : over all phases
    gauss_newton_iterations : most iterations of the first phase of "automatic"
    barrier_start, barrier_exact : first barrier parameter of a cold start and of the exact phase
    barrier_target : slack times multiplier of every bound at the solution; above 0 the solution is
        that of the barrier problem, smooth where bounds change between active and inactive
    """

    strategy: str = "automatic"
    tolerance: float = 1e-6
    max_iterations: int = 1000
    gauss_newton_iterations: int = 25
    barrier_start: float = 1e-4
    barrier_exact: float = 1e-5
    barrier_target: float = 0.0

    def __post_init__(self) -> None:
        """Refuse what IPOPT would not understand."""
        if self.strategy not in STRATEGIES:
            raise ConfigError(f"hessian {self.strategy!r}: choose one of {', '.join(STRATEGIES)}")
        if not 0 < self.tolerance < 1:
            raise ConfigError(f"tolerance {self.tolerance}: expected a number between 0 and 1")
        if not 0 <= self.barrier_target < 1:
            raise ConfigError(
                f"barrier target {self.barrier_target}: expected 0, or a small number to smooth"
            )


@dataclass(frozen=True, eq=False)
class Start:
    """A point to start from; with multipliers it is a warm start.

    Attributes
    ----------
    free : free vector; multipliers, lower, upper : of constraints and bounds, or None
    """

    free: np.ndarray
    multipliers: np.ndarray | None = None
    lower: np.ndarray | None = None
    upper: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class Result:
    """Outcome of a solve.

    Attributes
    ----------
    point : last iterate with multipliers
    optimal : whether IPOPT reached its tolerance
    message : IPOPT's words
    objective, constraint_violation : at the last iterate
    iterations, seconds : over all phases
    history : one record per iteration
    """

    point: Start
    optimal: bool
    message: str
    objective: float
    constraint_violation: float
    iterations: int
    seconds: float
    history: list[dict] = field(repr=False)


def solve(
    make_problem: Callable[[str], Problem],
    start: Start,
    settings: SolverSettings,
    log: Path | None = None,
) -> Result:
    """Solve an optimal control problem.

    Parameters
    ----------
    make_problem : builds the problem for a Hessian mode
    start : starting point; with multipliers, the Gauss-Newton phase is skipped
    settings : strategy and tolerances
    log : progress, one JSON record per iteration
    """
    begin = time.perf_counter()
    keep_freed_memory()
    history: list[dict] = []
    point = start
    phases = _phases(settings, warm=start.multipliers is not None)
    with log.open("w", encoding="utf-8") if log else io.StringIO() as stream:
        for mode, options in phases:
            problem = make_problem(mode)
            problem.progress = _recorder(mode, history, stream, begin)
            point, info = _run(problem, point, {**_common(mode, settings), **options})
    return Result(
        point=point,
        optimal=info["status"] == OPTIMAL,
        message=info["status_msg"].decode(),
        objective=float(info["obj_val"]),
        constraint_violation=float(np.abs(info["g"]).max()),
        iterations=len(history) - len(phases),
        seconds=time.perf_counter() - begin,
        history=history,
    )


def _phases(settings: SolverSettings, warm: bool) -> list[tuple[str, dict]]:
    """Hessian modes in order, with the options that differ."""
    cold = {"mu_init": settings.barrier_start, "max_iter": settings.max_iterations}
    barrier = max(settings.barrier_exact, settings.barrier_target)
    exact = {"mu_init": barrier, "max_iter": settings.max_iterations}
    if settings.strategy != "automatic":
        return [(settings.strategy, exact if warm else cold)]
    if warm:
        return [("exact", exact)]
    first = {
        **cold,
        "max_iter": settings.gauss_newton_iterations,
        "tol": max(settings.tolerance, 1e-4),
    }
    return [("gauss-newton", first), ("exact", exact)]


def _common(mode: str, settings: SolverSettings) -> dict:
    options = {
        "sb": "yes",
        "print_level": 0,
        "linear_solver": "mumps",
        "mumps_pivot_order": METIS,
        "tol": settings.tolerance,
        "constr_viol_tol": settings.tolerance,
        "mu_target": settings.barrier_target,
    }
    if mode == "limited-memory":
        options |= {"hessian_approximation": "limited-memory", "limited_memory_max_history": 40}
    return options


def _run(problem: Problem, start: Start, options: dict) -> tuple[Start, dict]:
    warm: dict = {}
    if start.multipliers is not None:
        options = {**options, **WARM_START_OPTIONS}
        warm = {"lagrange": start.multipliers, "zl": start.lower, "zu": start.upper}
    for key, value in options.items():
        problem.add_option(key, value)
    free, info = problem.solve(start.free, **warm)
    return Start(free, info["mult_g"], info["mult_x_L"], info["mult_x_U"]), info


def _recorder(mode: str, history: list[dict], stream, begin: float) -> Callable[[dict], bool]:
    def record(step: dict) -> bool:
        entry = {
            "phase": mode,
            "iteration": step["iteration"],
            "objective": step["objective"],
            "primal_infeasibility": step["primal_infeasibility"],
            "dual_infeasibility": step["dual_infeasibility"],
            "barrier": step["barrier"],
            "regularisation": step["regularisation"],
            "seconds": time.perf_counter() - begin,
        }
        history.append(entry)
        stream.write(json.dumps(entry) + "\n")
        stream.flush()
        if step["iteration"] % 10 == 0:
            print(
                f"{mode:>14} {step['iteration']:4d}  objective {step['objective']:.6g}"
                f"  violation {step['primal_infeasibility']:.1e}"
                f"  {entry['seconds']:.0f} s",
                flush=True,
            )
        return True

    return record
