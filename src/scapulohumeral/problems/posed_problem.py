"""Optimal control problems of all stages: posed from a model, solved, read and stored.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral import provenance
from scapulohumeral.dynamics.hill import MuscleParameters, force_derivatives
from scapulohumeral.model.rotations import ANGLE_NAMES, pose_to_trial, trial_to_pose
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.emg_term import EmgTerm
from scapulohumeral.ocp.layout import Layout
from scapulohumeral.ocp.objective import SEGMENTS, Objective, Trajectory, Weights
from scapulohumeral.ocp.problem import Bounds, Problem
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solution import Solution, write_solution
from scapulohumeral.ocp.solving import initial_guess
from scapulohumeral.ocp.solving.checkpoint import Checkpoint, content_hash
from scapulohumeral.ocp.solving.coarse_to_fine import coarse_nodes, solve_coarse_to_fine
from scapulohumeral.ocp.solving.solver import Result, SolverSettings, Start
from scapulohumeral.problems.model_files import ModelFiles, ShoulderModel
from scapulohumeral.quantities.tracking_metrics import tracking_metrics

# Name of the folder of all logs of a study.
LOGS = "logs"

# About the mean of the 126 elements, so that squared activations keep their size.
STRENGTH_UNIT_N = 150.0


@dataclass(frozen=True)
class SolveSettings:
    """How a problem is posed and solved.

    Attributes
    ----------
    time_step_s : mesh interval
    tolerance, max_iterations, hessian : see :class:`SolverSettings`
    weights : keys of one problem under ``weights`` in the configuration: weights of terms, and what
        these are counted in: ``clavicle_point_m``, ``strength_exponent``, ``activation_power``
    """

    time_step_s: float
    tolerance: float
    max_iterations: int
    hessian: str
    weights: Mapping[str, float]

    @property
    def solver(self) -> SolverSettings:
        """Settings of the solver."""
        return SolverSettings(
            strategy=self.hessian, tolerance=self.tolerance, max_iterations=self.max_iterations
        )


@dataclass(frozen=True, eq=False)
class Target:
    """What an optimal control problem follows, on its mesh.

    Attributes
    ----------
    time_s : (N,); reference_rad : (N, 10) joint angles
    activity : (N,) factor on J_traj, 0 in pauses
    tracked : segments that J_traj follows
    guidance : share of the weight of J_traj on the other segments (0: they are free)
    emg : envelopes that J_EMG follows
    elbow_activity : (N,) as activity, of the elbow; None where it is the same
    """

    time_s: np.ndarray
    reference_rad: np.ndarray
    activity: np.ndarray
    tracked: tuple[str, ...] = SEGMENTS
    guidance: float = 0.0
    emg: EmgTerm | None = None
    elbow_activity: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class PosedProblem:
    """One optimal control problem with everything that its solution is read with.

    Attributes
    ----------
    model : equations of motion and muscle geometry of a participant
    muscles, objective : see :class:`Problem`
    parameters : (P,) run-time parameters of the equations of motion
    target : what is followed
    scalers : groups of muscles with unknown parameters, or None
    bounds : of the unknowns
    """

    model: ShoulderModel
    muscles: MuscleParameters
    parameters: np.ndarray
    objective: Objective
    target: Target
    scalers: Scalers | None = None
    bounds: Bounds = Bounds()

    @property
    def nodes(self) -> int:
        """N."""
        return len(self.objective.reference)

    def problem(self, hessian: str, nodes: int | None = None) -> Problem:
        """The problem with a Hessian mode, on its own mesh or on one of another number of nodes."""
        objective = self.objective
        if nodes is not None and nodes != self.nodes:
            objective = objective.on_nodes(nodes)
        return Problem(
            self.model.forces,
            self.muscles,
            self.parameters,
            objective,
            hessian,
            bounds=self.bounds,
            scalers=self.scalers,
        )

    @cached_property
    def reader(self) -> Problem:
        """A problem to read solutions with; posing one takes most of a second."""
        return self.problem("gauss-newton")

    def layout(self) -> Layout:
        """Positions of the unknowns in the free vector."""
        return self.reader.layout

    def cold_start(self) -> Trajectory:
        """Starting point from the motion that is followed."""
        return initial_guess.from_motion(
            self.model.forces,
            self.muscles,
            self.parameters,
            self.target.reference_rad,
            self.objective.step,
        )


def pose(
    model: ShoulderModel,
    muscles: MuscleParameters,
    target: Target,
    settings: SolveSettings,
    hand_load_kg: float = 0.0,
) -> PosedProblem:
    """Problem of a model that follows a target with the configured weights."""
    return PosedProblem(
        model=model,
        muscles=muscles,
        parameters=model.parameters(hand_load_kg),
        objective=replace(
            make_objective(model, target, settings),
            effort=effort_factors(muscles, settings.weights.get("strength_exponent", 0.0)),
            effort_power=settings.weights.get("activation_power", 2.0),
        ),
        target=target,
        bounds=Bounds().around(target.reference_rad),
    )


def effort_factors(muscles: MuscleParameters, strength_exponent: float) -> np.ndarray:
    """Factors (M,) on squared activations: strength over ``STRENGTH_UNIT_N``, to a power.

    With 0 all elements count alike, so a muscle that is modelled as many weak ones is dear; with 1
    the effort of a force does not depend on how a muscle is divided into elements.
    """
    return (muscles.max_isometric_force / STRENGTH_UNIT_N) ** strength_exponent


def make_objective(model: ShoulderModel, target: Target, settings: SolveSettings) -> Objective:
    """Objective of the paper with the configured weights; terms without a weight are left out."""
    name = model.forces.dynamics.name
    errors, weights = pose_errors(name), settings.weights
    reference = errors.reference(target.reference_rad, weights["clavicle_point_m"])
    anchored = [group == "anchor" for group in errors.groups]
    if any(anchored):
        # Both ends are anchored to the clavicle at the start.
        reference[:, -4:] = reference[0, -4:]
    return Objective(
        errors=errors,
        reference=reference,
        weights=Weights(
            trajectory=weights[f"trajectory_{name}"],
            activation=weights["activation"],
            stability=weights.get("stability", 0.0),
            regularisation=weights["regularisation"],
            reaction_rate=weights["reaction_rate"],
            excitation_rate=weights["excitation_rate"],
            quaternion_norm=weights["quaternion_norm"],
            emg=weights.get("emg", 0.0) if target.emg else 0.0,
            parameters=weights.get("parameters", 0.0),
            tracked=target.tracked,
            guidance=target.guidance,
            anchor=weights.get("clavicle_anchor", 0.0),
        ),
        step=settings.time_step_s,
        glenoid=model.glenoid,
        superior_inferior_share=model.superior_inferior_share,
        activity=target.activity,
        emg=target.emg,
        elbow_activity=target.elbow_activity,
    )


def solve_posed(
    posed: PosedProblem, start: Start | Trajectory, settings: SolveSettings, log: Path | None
) -> Result:
    """Solve from a warm start or from trajectories, over a coarse mesh where it helps.

    With a log below a folder ``logs``, iterates are kept in ``checkpoints`` beside that folder, and
    an interrupted solve of the same problem from the same start goes on from them.
    """
    if isinstance(start, Trajectory):
        start = _start_at(posed, start)
    solver = settings.solver
    if solver.strategy == "automatic":
        solver = replace(solver, coarse=coarse_nodes(posed.nodes))
    return solve_coarse_to_fine(
        lambda nodes, hessian: posed.problem(hessian, nodes),
        posed.nodes,
        start,
        solver,
        log,
        _checkpoint(posed, start, solver, log),
    )


def unsolved(posed: PosedProblem, start: Trajectory, reason: str, log: Path) -> Result:
    """Result of a problem that nothing was tried on, at its start; the log says the reason."""
    log.write_text(reason + "\n", encoding="utf-8")
    return Result(
        point=_start_at(posed, start),
        optimal=False,
        message=reason,
        objective=float("nan"),
        constraint_violation=float("nan"),
        iterations=0,
        seconds=0.0,
        history=[],
    )


def _start_at(posed: PosedProblem, start: Trajectory) -> Start:
    """Trajectories as a start; scalers, where there are any, start from one."""
    if posed.scalers is not None:
        start = replace(start, scalers=np.ones((2, len(posed.scalers.names))))
    return Start(posed.layout().join(start))


def _checkpoint(
    posed: PosedProblem, start: Start, solver: SolverSettings, log: Path | None
) -> Checkpoint | None:
    """The place for iterates of this problem from this start; None without a folder of logs.

    Named by its log too: two rules may solve the same problem side by side.
    """
    logs = [parent for parent in (log.parents if log else ()) if parent.name == LOGS]
    if log is None or not logs:
        return None
    forces = posed.model.forces
    problem = content_hash(
        provenance.code_hash("scapulohumeral.problems.posed_problem"),
        forces.dynamics.header["expression_hash"],
        forces.geometry,
        posed.muscles,
        posed.parameters,
        posed.objective,
        posed.scalers,
        posed.bounds,
        start,
        solver,
    )
    task = "_".join(log.relative_to(logs[-1]).parts).removesuffix(log.suffix)
    return Checkpoint(logs[-1].with_name("checkpoints") / f"{task}_{problem}")


def read_result(posed: PosedProblem, result: Result, header: dict[str, Any]) -> Solution:
    """Solution in physical terms from the last iterate."""
    x = posed.reader.trajectory(result.point.free)
    muscles = posed.reader.collocation.scaled_muscles(x)
    length, velocity = posed.model.forces.lengths(x.q, x.u)
    force = force_derivatives(length, velocity, muscles)
    fibre = (length - muscles.tendon_slack_length) / muscles.optimal_fibre_length
    pose_of_x = joint_pose(posed.model.forces.dynamics.name, x)
    none = np.zeros(0)
    return Solution(
        header=header,
        time_s=posed.target.time_s,
        q=x.q,
        u=x.u,
        activation=x.a,
        excitation=x.e,
        muscle_force_N=force.active * x.a + force.passive,
        fibre_length=fibre,
        reaction_N=x.reaction,
        angles_rad=x.q if x.q.shape[1] == len(ANGLE_NAMES) else pose_to_trial(pose_of_x),
        reference_rad=posed.target.reference_rad,
        pose=pose_of_x,
        reference_pose=trial_to_pose(posed.target.reference_rad),
        muscles=np.array(posed.muscles.names),
        free=result.point.free,
        multipliers=_or(result.point.multipliers, none),
        lower=_or(result.point.lower, none),
        upper=_or(result.point.upper, none),
    )


def joint_pose(formulation: str, x: Trajectory) -> np.ndarray:
    """Unit quaternions of the joints and elbow angle, shape (N, 13)."""
    return trial_to_pose(x.q) if formulation == "euler" else x.q


def _or(value: np.ndarray | None, default: np.ndarray) -> np.ndarray:
    return default if value is None else value


def header(
    posed: PosedProblem, result: Result, settings: SolveSettings, **about: Any
) -> dict[str, Any]:
    """What is stored with a solution: what it is about, status, statistics, settings, versions."""
    x = posed.reader.trajectory(result.point.free)
    return {
        **about,
        "formulation": posed.model.forces.dynamics.name,
        "status": "optimal" if result.optimal else "failed",
        "message": result.message,
        "objective": result.objective,
        "terms": posed.objective.terms(x),
        "constraint_violation": result.constraint_violation,
        "iterations": result.iterations,
        "seconds": result.seconds,
        "phases": list(dict.fromkeys(step["phase"] for step in result.history)),
        "nodes": len(posed.target.time_s),
        "meshes": list(result.meshes),
        "remark": result.remark,
        "settings": {**vars(settings), "weights": dict(settings.weights)},
        "versions": provenance.environment_versions(),
        "machine": platform.machine(),
    }


def hashes(files: ModelFiles, others: Sequence[Path], module: str) -> dict[str, str]:
    """Hashes of all inputs of a solve and of the code of its stage."""
    return {
        "inputs": provenance.input_hash([*files.all(), *others]),
        "code": provenance.code_hash(module),
    }


def store(
    solution: Solution, result: Result, paths: tuple[Path, Path], more: Mapping[str, Any]
) -> None:
    """Write a solution and its summary: the header, tracking errors, ``more`` and the history."""
    write_solution(solution, paths[0])
    document = {
        **solution.header,
        **tracking_metrics(solution),
        **more,
        "history": result.history,
    }
    paths[1].write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
