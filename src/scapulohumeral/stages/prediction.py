"""Predict scapula and clavicle: only the humerus is tracked (paper, section on SHR prediction).

Every prediction is reached from a solved neighbour: the healthy ones from the tracked composite
motion, at once or by lowering the weight on scapula and clavicle, all others from the healthy
prediction by lowering muscle capacity in steps.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.errors import ConfigError
from scapulohumeral.ocp.kkt import certificate
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solver import Result, Start
from scapulohumeral.stages.calibration import calibrated_muscles
from scapulohumeral.stages.composite import Composite, compose, composite_target
from scapulohumeral.stages.model_files import ModelFiles, ShoulderModel, load_model
from scapulohumeral.stages.posed_problem import (
    PosedProblem,
    SolveSettings,
    hashes,
    header,
    pose,
    read_result,
    solve_posed,
    store,
)

TRACKED = ("humerus", "elbow")


@dataclass(frozen=True)
class Condition:
    """One shoulder whose coordination is predicted.

    Attributes
    ----------
    name : of the condition
    parameters : "generic" or "calibrated" muscles
    w_gh : weight of joint stability
    muscles : muscles of the model (``group`` in its record) whose capacity is limited
    capacity : their share of the healthy active force, 0 to 1
    start : how the solution is reached: "tracking" (through the guidance steps), "direct"
        (from tracking at once), or the name of the condition whose solution is changed step by
        step; where that fails, through the guidance steps
    girdle_stiffness_Nm_per_rad : passive stiffness of sternoclavicular and acromioclavicular joint;
        None: that of the model
    """

    name: str
    parameters: str
    w_gh: float
    muscles: tuple[str, ...] = ()
    capacity: float = 1.0
    start: str = "tracking"
    girdle_stiffness_Nm_per_rad: float | None = None

    def __post_init__(self) -> None:
        """Refuse unknown parameters and impossible capacities."""
        if self.parameters not in ("generic", "calibrated"):
            raise ConfigError(
                f"prediction condition {self.name}: parameters {self.parameters!r}; "
                "choose generic or calibrated"
            )
        if not 0.0 <= self.capacity <= 1.0 or not self.w_gh >= 0.0:
            raise ConfigError(
                f"prediction condition {self.name}: capacity {self.capacity}, w_gh {self.w_gh}; "
                "expected a capacity of 0 to 1 and a weight that is not negative"
            )
        stiffness = self.girdle_stiffness_Nm_per_rad
        if stiffness is not None and not stiffness >= 0.0:
            raise ConfigError(
                f"prediction condition {self.name}: girdle_stiffness_Nm_per_rad {stiffness}; "
                "expected a number that is not negative, or none for that of the model"
            )


@dataclass(frozen=True)
class PredictionFiles:
    """What a prediction is made from.

    Attributes
    ----------
    model, channels : participant's model and table of virtual muscle groups
    calibration : scalers, or None for generic muscles
    tracked : tracking solutions in the order of the composite motion
    neighbour : solution that the prediction starts from, or None
    """

    model: ModelFiles
    channels: Path
    calibration: Path | None
    tracked: Sequence[Path]
    neighbour: Path | None = None


@dataclass(frozen=True)
class PredictionSettings:
    """How predictions are solved.

    Attributes
    ----------
    solve : settings; ``stability`` of the weights is that of the condition
    pause_s : pauses of the composite motion
    guidance : shares of the tracking weight on scapula and clavicle on the way from tracking
    capacity_steps : capacities on the way from a healthy neighbour
    """

    solve: SolveSettings
    pause_s: float
    guidance: tuple[float, ...]
    capacity_steps: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _Scene:
    model: ShoulderModel
    composite: Composite
    muscles: MuscleParameters
    condition: Condition
    settings: PredictionSettings

    def posed(self, capacity: float, guidance: float = 0.0) -> PosedProblem:
        """Problem at a capacity of the limited muscles and a guidance of the free segments."""
        weights = {**self.settings.solve.weights, "stability": self.condition.w_gh}
        target = composite_target(self.composite, TRACKED, guidance)
        limited = limit_capacity(self.muscles, self.model.record, self.condition.muscles, capacity)
        posed = pose(self.model, limited, target, replace(self.settings.solve, weights=weights))
        stiffness = self.condition.girdle_stiffness_Nm_per_rad
        if stiffness is None:
            return posed
        return replace(posed, parameters=stiffen_girdle(posed.parameters, stiffness))


def stiffen_girdle(parameters: np.ndarray, stiffness_Nm_per_rad: float) -> np.ndarray:
    """Run-time parameters (P,) with another stiffness of SC and AC joint."""
    values = {name: block.copy() for name, block in unpack(parameters).items()}
    values["joint_stiffness"][:2] = stiffness_Nm_per_rad
    return pack(values)


def limit_capacity(
    muscles: MuscleParameters,
    record: Mapping[str, Any],
    limited: Sequence[str],
    capacity: float,
) -> MuscleParameters:
    """Muscle parameters with some muscles' active force limited to a share.

    Raises
    ------
    ConfigError
        If the model has no such muscle.
    """
    groups = np.array([muscle["group"] for muscle in record["muscles"]])
    unknown = sorted(set(limited) - set(groups))
    if unknown:
        raise ConfigError(
            f"prediction: no muscle {', '.join(unknown)}; the model has "
            f"{', '.join(sorted(set(groups)))}"
        )
    share = np.where(np.isin(groups, list(limited)), capacity, 1.0)
    return replace(muscles, capacity=muscles.capacity * share)


def solve_prediction(
    condition: Condition,
    files: PredictionFiles,
    settings: PredictionSettings,
    solution: tuple[Path, Path],
    solver_log: Path,
) -> None:
    """Predict one condition; write solution and summary with its certificate.

    A solve that fails is written too, sealed by its status.
    """
    model = load_model(files.model)
    motions = [read_solution(path) for path in files.tracked]
    composite = compose(motions, settings.solve.time_step_s, settings.pause_s)
    muscles = calibrated_muscles(model.record, files.channels, files.calibration)
    scene = _Scene(model, composite, muscles, condition, settings)
    seconds, iterations, progress = 0.0, 0, ""
    for way in _ways(scene, files):
        start = way.start
        for posed in way.steps:
            result = solve_posed(posed, start, settings.solve, solver_log)
            seconds, iterations = seconds + result.seconds, iterations + result.iterations
            progress += solver_log.read_text(encoding="utf-8")
            start = result.point
            if not result.optimal:
                break
        if result.optimal:
            break
    solver_log.write_text(progress, encoding="utf-8")
    result = replace(result, seconds=seconds, iterations=iterations)
    _write(scene, files, posed, result, solution, way.name)


@dataclass(frozen=True, eq=False)
class _Way:
    """A start and the problems solved from it one after the other, that of the condition last."""

    name: str
    start: Start | Trajectory
    steps: tuple[PosedProblem, ...]


def _ways(scene: _Scene, files: PredictionFiles) -> Iterator[_Way]:
    """Ways to the condition, in the order in which they are tried: the guided one comes last."""
    condition, settings = scene.condition, scene.settings
    neighbour = (
        None if files.neighbour is None else read_solution(files.neighbour, allow_failed=True)
    )
    if neighbour is not None and neighbour.header["status"] == "optimal":
        before = neighbour.header["condition"]
        limited = set(before["muscles"]) != set(condition.muscles) or not before["muscles"]
        highest = 1.0 if limited else before["capacity"]
        between = [c for c in settings.capacity_steps if condition.capacity < c < highest]
        capacities = [*sorted(between, reverse=True), condition.capacity]
        steps = tuple(scene.posed(capacity) for capacity in capacities)
        yield _Way(before["name"], neighbour.start, steps)
    tracked = scene.composite.trajectory
    if condition.start == "direct":
        yield _Way("direct", tracked, (scene.posed(condition.capacity),))
    guided = (scene.posed(condition.capacity, share) for share in (*settings.guidance, 0.0))
    yield _Way("tracking", tracked, tuple(guided))


def _write(
    scene: _Scene,
    files: PredictionFiles,
    posed: PosedProblem,
    result: Result,
    solution: tuple[Path, Path],
    way: str,
) -> None:
    others = [files.channels, *files.tracked]
    others += [path for path in (files.calibration, files.neighbour) if path is not None]
    about = header(
        posed,
        result,
        scene.settings.solve,
        participant=files.model.participant.parent.name,
        trial="composite",
        condition=asdict(scene.condition),
        reached_from=way,
        planes=scene.composite.nodes,
        hashes=hashes(files.model, others, "scapulohumeral.stages.prediction"),
    )
    store(read_result(posed, result, about), result, solution, _certify(posed, result))


def _certify(posed: PosedProblem, result: Result) -> dict[str, Any]:
    """First- and second-order optimality of the solution; nothing where the solve failed."""
    if not result.optimal:
        return {"certificate": None}
    proof = certificate(posed.problem("exact"), result.point)
    return {
        "certificate": {
            "kkt_error": proof.kkt_error,
            "inertia": list(proof.inertia),
            "expected_inertia": list(proof.expected_inertia),
            "reduced_hessian_positive": proof.reduced_hessian_positive,
            "active_bounds": proof.active_bounds,
            "active_by_kind": proof.active_by_kind,
            "weakly_active_bounds": proof.weakly_active_bounds,
            "holds": proof.holds,
        }
    }
