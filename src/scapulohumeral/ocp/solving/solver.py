"""Solving with IPOPT: phases of Hessians, progress, warm starts and statistics.

The automatic strategy starts with a Gauss-Newton Hessian, which finds the region of the optimum
without inertia corrections, and hands over to the exact Hessian, warm-started with the
multipliers, which converges quadratically; :mod:`coarse_to_fine` does so on several meshes, and
takes the lumped Hessian on the last one if that is large.
"""

from __future__ import annotations

import io
import json
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TextIO

import numpy as np

from scapulohumeral.errors import ConfigError, StoppedError
from scapulohumeral.ocp.lagrangian import LUMPED
from scapulohumeral.ocp.problem import HESSIANS, Problem
from scapulohumeral.ocp.solving.checkpoint import Checkpoint, Iterate, Stop, stop_on_sigterm
from scapulohumeral.ocp.solving.memory import keep_freed_memory
from scapulohumeral.ocp.solving.scaling import start_scaling

STRATEGIES = ("automatic", *HESSIANS)
OPTIMAL = 0
# Ipopt's numbering of MUMPS orderings; with AMD or PORD a factorisation takes several times longer.
METIS = 5
# IPOPT's number for iterations outside of its restoration phase.
REGULAR = 0
STRAYED = "IPOPT needed its restoration phase, which may end in another optimum."
# Most iterations with a lumped Hessian. In some problems they reach the tolerance before; in others
# the last digits come slowly, and the exact Hessian brings them in two or three.
LUMPED_ITERATIONS = 16
# Barrier of the Gauss-Newton iterations that close in from the solution of a coarser mesh.
CLOSING_IN_BARRIER = 1e-6
# What is recorded of every iteration, beside phase, mesh and time.
RECORDED = (
    "iteration",
    "objective",
    "primal_infeasibility",
    "dual_infeasibility",
    "barrier",
    "regularisation",
)
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
    strategy : one of :data:`STRATEGIES`
    tolerance : IPOPT's scaled optimality error
    max_iterations : of the last phase, on each mesh; phases before it have fewer of their own
    gauss_newton_iterations : most iterations of the first phase of "automatic"
    barrier_start, barrier_exact : first barrier parameter of a cold start and of the exact phase
    barrier_target : slack times multiplier of every bound at the solution; above 0 the solution is
        that of the barrier problem, smooth where bounds change between active and inactive
    coarse : nodes of the meshes on the way to that of the problem, coarsest first
    barrier_least : if above 0, the barrier of the exact phase falls by IPOPT's quality function,
        from `barrier_exact` at most to this
    closing_in : Gauss-Newton iterations from the solution of a coarser mesh, before the lumped
        Hessian takes over; 0 takes the exact one at once
    stays_near : whether a solve fails where IPOPT needs its restoration phase, which looks for a
        feasible point far and wide and may end in another optimum than that near the start
    far : whether a start is the solution of a neighbour so far away that its multipliers are no
        help: "automatic" then begins with Gauss-Newton, and all phases have the scaling of the
        start, so that `barrier_target` means the same as in the start's own solution
    """

    strategy: str = "automatic"
    tolerance: float = 1e-6
    max_iterations: int = 1000
    gauss_newton_iterations: int = 25
    barrier_start: float = 1e-4
    barrier_exact: float = 1e-5
    barrier_target: float = 0.0
    coarse: tuple[int, ...] = ()
    barrier_least: float = 0.0
    closing_in: int = 0
    stays_near: bool = False
    far: bool = False

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
    iterations, seconds : over all phases, with those of interrupted solves that it went on from
    history : one record per iteration of this process
    meshes : numbers of nodes of the meshes solved on, the last that of the problem
    remark : why the meshes are not those of the settings, or where an interrupted solve was taken
        up; empty if nothing is to be said
    """

    point: Start
    optimal: bool
    message: str
    objective: float
    constraint_violation: float
    iterations: int
    seconds: float
    history: list[dict] = field(repr=False)
    meshes: tuple[int, ...] = ()
    remark: str = ""


@dataclass
class Recorder:
    """Progress of one or several solves that belong together: history, log and clock.

    Attributes
    ----------
    stream : receives one JSON record per iteration
    history : the same records; phases : number of phases so far
    checkpoint : where iterates are kept, or None; stop : whether to end early
    strayed : whether the last phase was ended because it would have left the start's neighbourhood
    resumed : iterate of an interrupted solve that this one goes on from, or None
    """

    stream: TextIO
    checkpoint: Checkpoint | None = None
    stop: Stop = field(default_factory=Stop)
    history: list[dict] = field(default_factory=list)
    phases: int = 0
    strayed: bool = False
    resumed: Iterate | None = None
    begin: float = field(default_factory=time.perf_counter)

    @classmethod
    @contextmanager
    def to(cls, log: Path | None, checkpoint: Checkpoint | None = None) -> Iterator[Recorder]:
        """A recorder that writes to a file, or nowhere; SIGTERM ends what it records."""
        with (
            log.open("w", encoding="utf-8") if log else io.StringIO() as stream,
            stop_on_sigterm() as stop,
        ):
            yield cls(stream, checkpoint, stop)

    @property
    def seconds(self) -> float:
        """Time since the first solve began, with that of an interrupted one."""
        before = self.resumed.seconds if self.resumed else 0.0
        return before + time.perf_counter() - self.begin

    @property
    def iterations(self) -> int:
        """Iterations of all phases, with those of an interrupted solve."""
        before = self.resumed.iterations if self.resumed else 0
        # The first record of a phase is its start.
        return before + len(self.history) - self.phases

    def say(self, sentence: str) -> None:
        """A sentence for the log and the reader of the terminal."""
        self.stream.write(json.dumps({"remark": sentence}) + "\n")
        print(sentence, flush=True)

    def phase(
        self, mode: str, problem: Problem, stays_near: bool = False
    ) -> Callable[[dict], bool]:
        """What IPOPT calls after every iteration of the next phase; False asks it to stop."""
        self.phases += 1
        self.strayed = False
        about = {"phase": mode, "nodes": problem.layout.nodes}

        def record(step: dict) -> bool:
            self._write(about, step)
            regular = step["mode"] == REGULAR
            if self.checkpoint and regular and (self.checkpoint.is_due or self.stop.requested):
                self.checkpoint.write(_iterate(problem, mode, step["barrier"], self))
            self.strayed = stays_near and not regular
            return not (self.stop.requested or self.strayed)

        return record

    def refuse_to_go_on_if_stopped(self) -> None:
        """Raise a StoppedError if the process was asked to end."""
        if not self.stop.requested:
            return
        kept = self.checkpoint.folder if self.checkpoint else None
        where = f"last iterate in {kept}; run the same again to go on from it" if kept else "lost"
        raise StoppedError(
            f"stopped by SIGTERM after {self.iterations} iterations and {self.seconds:.0f} s: "
            f"{where}"
        )

    def _write(self, about: dict, step: dict) -> None:
        kept = {name: step[name] for name in RECORDED}
        entry = {**about, **kept, "seconds": self.seconds}
        self.history.append(entry)
        self.stream.write(json.dumps(entry) + "\n")
        self.stream.flush()
        if step["iteration"] % 10 == 0:
            print(
                f"{about['phase']:>14} {about['nodes']:4d} nodes {step['iteration']:4d}"
                f"  objective {step['objective']:.6g}"
                f"  violation {step['primal_infeasibility']:.1e}"
                f"  {entry['seconds']:.0f} s",
                flush=True,
            )


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
    start : starting point; with multipliers, the Gauss-Newton phase is skipped unless it is far
    settings : strategy and tolerances
    log : progress, one JSON record per iteration
    """
    with Recorder.to(log) as recorder:
        return run_phases(make_problem, start, settings, recorder)


def run_phases(
    make_problem: Callable[[str], Problem],
    start: Start,
    settings: SolverSettings,
    recorder: Recorder,
) -> Result:
    """As :func:`solve`, on the record of several solves."""
    keep_freed_memory()
    point = Start(start.free) if settings.far else start
    for mode, options in _phases(settings, warm=point.multipliers is not None):
        problem = make_problem(mode)
        if settings.far:
            objective, constraints = start_scaling(problem, start.free)
            problem.set_problem_scaling(objective, g_scaling=constraints)
            options["nlp_scaling_method"] = "user-scaling"
        problem.progress = recorder.phase(mode, problem, settings.stays_near)
        point, info = _run(problem, point, {**_common(mode, settings), **options})
        recorder.refuse_to_go_on_if_stopped()
        if recorder.strayed or (mode == LUMPED and info["status"] == OPTIMAL):
            break
    return Result(
        point=point,
        optimal=info["status"] == OPTIMAL,
        message=STRAYED if recorder.strayed else info["status_msg"].decode(),
        objective=float(info["obj_val"]),
        constraint_violation=float(np.abs(info["g"]).max()),
        iterations=recorder.iterations,
        seconds=recorder.seconds,
        history=recorder.history,
        meshes=(problem.layout.nodes,),
    )


def _iterate(problem: Problem, mode: str, barrier: float, recorder: Recorder) -> Iterate:
    """The present iterate of a problem that IPOPT is working on."""
    now = problem.get_current_iterate()
    return Iterate(
        nodes=problem.layout.nodes,
        phase=mode,
        barrier=barrier,
        iterations=recorder.iterations,
        seconds=recorder.seconds,
        free=now["x"],
        multipliers=now["mult_g"],
        lower=now["mult_x_L"],
        upper=now["mult_x_U"],
    )


def _phases(settings: SolverSettings, warm: bool) -> list[tuple[str, dict]]:
    """Hessian modes in order, with the options that differ."""
    cold = {"mu_init": settings.barrier_start, "max_iter": settings.max_iterations}
    barrier = max(settings.barrier_exact, settings.barrier_target)
    exact: dict = {"mu_init": barrier, "max_iter": settings.max_iterations}
    if settings.barrier_least > 0:
        exact |= {
            "mu_strategy": "adaptive",
            "mu_oracle": "quality-function",
            "mu_min": settings.barrier_least,
            "mu_max": barrier,
        }
    if settings.strategy != "automatic":
        return [(settings.strategy, exact if warm else cold)]
    loose = {"tol": max(settings.tolerance, 1e-4)}
    first: list[tuple[str, dict]] = []
    if not warm:
        first = [("gauss-newton", {**cold, "max_iter": settings.gauss_newton_iterations, **loose})]
    elif settings.closing_in:
        nearer = {"mu_init": CLOSING_IN_BARRIER, "max_iter": settings.closing_in}
        lumped = {**exact, "max_iter": min(settings.max_iterations, LUMPED_ITERATIONS)}
        first = [("gauss-newton", {**nearer, **loose}), (LUMPED, lumped)]
    return [*first, ("exact", exact)]


def _common(mode: str, settings: SolverSettings) -> dict:
    options = {
        "sb": "yes",
        "print_level": 0,
        "linear_solver": "mumps",
        "mumps_pivot_order": METIS,
        # A permutation for large diagonal entries fills the factors by a tenth to a half more.
        "mumps_permuting_scaling": 0,
        # Its own scaling changed no step of a tracked elevation, and took 5 % of the time.
        "mumps_scaling": 0,
        # Space for delayed pivots, which IPOPT widens where it does not do [%]: ten times what the
        # factors need, its own choice, leaves a heap that is mostly holes.
        "mumps_mem_percent": 100,
        # Steps are refined where their residual is too large, and not once for nothing. At 1e-10,
        # IPOPT's own, every step is; at 1e-6 hardly any, and iterations are the same.
        "min_refinement_steps": 0,
        "residual_ratio_max": 1e-6,
        "tol": settings.tolerance,
        "constr_viol_tol": settings.tolerance,
        "mu_target": settings.barrier_target,
    }
    if mode == "limited-memory":
        options |= {
            "hessian_approximation": "limited-memory",
            "limited_memory_max_history": 40,
            # Steps of low-rank updates need to be exact, or their Hessian goes astray.
            "residual_ratio_max": 1e-10,
        }
    return options


def _run(problem: Problem, start: Start, options: dict) -> tuple[Start, dict]:
    warm: dict = {}
    if start.multipliers is not None:
        options = {**options, **WARM_START_OPTIONS}
        warm = {"lagrange": start.multipliers, "zl": start.lower, "zu": start.upper}
    for key, value in options.items():
        problem.add_option(key, value)
    free, info = problem.solve(start.free, **warm)
    # The factors go now, not when the problem does.
    problem.close()
    return Start(free, info["mult_g"], info["mult_x_L"], info["mult_x_U"]), info
