"""Track a recorded motion: from files of a participant to a stored solution.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral import provenance
from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.hill import MuscleParameters, force_derivatives
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.participant_parameters import dynamics_parameters, muscle_parameters
from scapulohumeral.errors import DataError
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.muscle_geometry import load_geometry
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    pose_to_trial,
    trial_to_pose,
)
from scapulohumeral.ocp import initial_guess
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.objective import Objective, Trajectory, Weights
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solution import Solution, write_solution
from scapulohumeral.ocp.solver import Result, SolverSettings, Start, solve
from scapulohumeral.ocp.transcription import REACTION_UNIT_N
from scapulohumeral.stages.tracking_metrics import tracking_metrics


@dataclass(frozen=True)
class TrackingFiles:
    """What a tracking solve is made from."""

    participant: Path
    model: Path
    thorax: Path
    geometry: Path
    equations: Path


@dataclass(frozen=True)
class TrackingSettings:
    """How a tracking problem is posed and solved.

    Attributes
    ----------
    time_step_s : mesh interval
    tolerance, max_iterations, hessian : see :class:`SolverSettings`
    weights : the keys of ``weights.tracking`` in the configuration
    """

    time_step_s: float
    tolerance: float
    max_iterations: int
    hessian: str
    weights: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class TrackingProblem:
    """One tracking problem with everything that its solution is read with.

    Attributes
    ----------
    forces, muscles, parameters, objective : see :class:`Problem`
    time_s : (N,); angles_rad : (N, 10) recorded joint angles on the mesh
    recording : file of the recorded motion
    """

    forces: MuscleForces
    muscles: MuscleParameters
    parameters: np.ndarray
    objective: Objective
    time_s: np.ndarray
    angles_rad: np.ndarray
    recording: Path

    def problem(self, hessian: str) -> Problem:
        """The problem with a Hessian mode."""
        return Problem(self.forces, self.muscles, self.parameters, self.objective, hessian)

    def initial_guess(self) -> Start:
        """Cold start from the recorded motion."""
        guess = initial_guess.from_motion(
            self.forces, self.muscles, self.parameters, self.angles_rad, self.objective.step
        )
        return Start(self.problem("gauss-newton").layout.join(guess))


def solve_tracking(
    trial: str,
    files: TrackingFiles,
    settings: TrackingSettings,
    solution: Path,
    summary: Path,
    solver_log: Path,
) -> None:
    """Track one recorded trial; write the solution and its summary.

    A solve that fails is written too, sealed by its status.
    """
    posed = pose_tracking(trial, files, settings)
    options = SolverSettings(
        strategy=settings.hessian,
        tolerance=settings.tolerance,
        max_iterations=settings.max_iterations,
    )
    result = solve(posed.problem, posed.initial_guess(), options, solver_log)
    header = _header(trial, files, settings, posed, result)
    solved = read_result(posed, result, header)
    write_solution(solved, solution)
    document = {**header, **tracking_metrics(solved), "history": result.history}
    summary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def pose_tracking(trial: str, files: TrackingFiles, settings: TrackingSettings) -> TrackingProblem:
    """Read a participant's files and pose the tracking problem of one trial."""
    folder = files.participant.parent
    recording = read_participant(folder.parent, folder.name).trial(trial)
    record = json.loads(files.model.read_text(encoding="utf-8"))
    thorax = json.loads(files.thorax.read_text(encoding="utf-8"))
    forces = MuscleForces(compiled.load(files.equations), load_geometry(files.geometry))
    time_s, angles = resample(recording.motion, settings.time_step_s, recording.file)
    errors = pose_errors(forces.dynamics.name)
    weights = settings.weights
    glenoid = record["constants"]["glenoid"]
    objective = Objective(
        errors=errors,
        reference=errors.reference(angles, weights["clavicle_point_m"]),
        weights=Weights(
            trajectory=weights[f"trajectory_{forces.dynamics.name}"],
            activation=weights["activation"],
            regularisation=weights["regularisation"],
            excitation_rate=weights["excitation_rate"],
            quaternion_norm=weights["quaternion_norm"],
        ),
        step=settings.time_step_s,
        glenoid=(
            np.deg2rad(glenoid["inferior_inclination_deg"]),
            np.deg2rad(glenoid["anterior_version_deg"]),
        ),
        activity=np.ones(len(time_s)),
    )
    return TrackingProblem(
        forces=forces,
        muscles=muscle_parameters(record),
        parameters=dynamics_parameters(record, thorax, recording.hand_load_kg),
        objective=objective,
        time_s=time_s,
        angles_rad=angles,
        recording=recording.file,
    )


def resample(motion: Motion, step: float, source: Path) -> tuple[np.ndarray, np.ndarray]:
    """Recorded joint angles on the mesh: times (N,) [s] and angles (N, 10) [rad].

    The mesh starts with the recording and ends with the last whole interval inside it.

    Raises
    ------
    DataError
        If the recording is shorter than ten intervals.
    """
    duration = motion.time_s[-1] - motion.time_s[0]
    intervals = int(duration / step + 1e-9)
    if intervals < 10:
        raise DataError(
            f"{source}: the recording lasts {duration:.2f} s, which is {intervals} intervals of "
            f"{step} s; expected 10 or more. Choose a smaller solve.time_step_s"
        )
    time_s = motion.time_s[0] + step * np.arange(intervals + 1)
    angles = CubicSpline(motion.time_s, np.unwrap(motion.angles_rad, axis=0))(time_s)
    return time_s, angles


def read_result(posed: TrackingProblem, result: Result, header: dict) -> Solution:
    """Solution in physical terms from the last iterate."""
    x = posed.problem("gauss-newton").trajectory(result.point.free)
    length, velocity = posed.forces.lengths(x.q, x.u)
    force = force_derivatives(length, velocity, posed.muscles)
    fibre = (length - posed.muscles.tendon_slack_length) / posed.muscles.optimal_fibre_length
    pose = joint_pose(posed.forces.dynamics.name, x)
    none = np.zeros(0)
    return Solution(
        header=header,
        time_s=posed.time_s,
        q=x.q,
        u=x.u,
        activation=x.a,
        excitation=x.e,
        muscle_force_N=force.active * x.a + force.passive,
        fibre_length=fibre,
        reaction_N=x.reaction * REACTION_UNIT_N,
        angles_rad=x.q if x.q.shape[1] == len(ANGLE_NAMES) else pose_to_trial(pose),
        reference_rad=posed.angles_rad,
        pose=pose,
        reference_pose=trial_to_pose(posed.angles_rad),
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


def _header(
    trial: str,
    files: TrackingFiles,
    settings: TrackingSettings,
    posed: TrackingProblem,
    result: Result,
) -> dict:
    participant = files.participant.parent.name
    inputs = [files.participant, posed.recording, files.model, files.thorax, files.geometry]
    inputs += sorted(files.equations.iterdir())
    x = posed.problem("gauss-newton").trajectory(result.point.free)
    return {
        "participant": participant,
        "trial": trial,
        "formulation": posed.forces.dynamics.name,
        "status": "optimal" if result.optimal else "failed",
        "message": result.message,
        "objective": result.objective,
        "terms": posed.objective.terms(x),
        "constraint_violation": result.constraint_violation,
        "iterations": result.iterations,
        "seconds": result.seconds,
        "phases": list(dict.fromkeys(step["phase"] for step in result.history)),
        "nodes": len(posed.time_s),
        "settings": {
            "time_step_s": settings.time_step_s,
            "tolerance": settings.tolerance,
            "max_iterations": settings.max_iterations,
            "hessian": settings.hessian,
            "weights": dict(settings.weights),
        },
        "hashes": {
            "inputs": provenance.input_hash(inputs),
            "code": provenance.code_hash("scapulohumeral.stages.tracking"),
        },
        "versions": provenance.environment_versions(),
        "machine": platform.machine(),
    }
