"""Predict scapula and clavicle: only the humerus is tracked (paper, section on SHR prediction).

A prediction is reached from the tracked composite motion, at once or by lowering the weight on
scapula and clavicle, or from a solved neighbour, if its condition names one.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.dynamics.participant_parameters import with_capsule
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.motion import read_motion
from scapulohumeral.model.published_arm import (
    PUBLISHED_PLANES,
    published_on_recorded_girdle,
    published_pose,
)
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import pose_to_trial
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.optimality.kkt import certificate
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.ocp.solving import initial_guess
from scapulohumeral.ocp.solving.solver import Result, Start
from scapulohumeral.problems.chosen_problem import chosen_bounds, chosen_parameters, without_force
from scapulohumeral.problems.composite import (
    Composite,
    compose,
    composite_target,
    with_recorded_girdle,
)
from scapulohumeral.problems.model_files import ModelFiles, ShoulderModel, load_model
from scapulohumeral.problems.posed_problem import (
    PosedProblem,
    SolveSettings,
    hashes,
    header,
    pose,
    read_result,
    solve_posed,
    store,
    unsolved,
)
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.problems.solution_mesh import on_mesh
from scapulohumeral.stages.calibration import calibrated_muscles, calibration_failure
from scapulohumeral.stages.tracking import held_load, tracking_failure

TRACKED = ("humerus", "elbow")
STUDY = ProblemChoices()
# Start where the joint may only be pressed [1, N]: 0.75 units of 800 N as in the notebooks of the
# authors, who begin with no activation at all and count the force of the humerus on the scapula.
RESTING_ACTIVATION = 0.02
RESTING_COMPRESSION_N = 600.0


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
    tracked : tracking solutions in the order of the composite motion, or that of a daily task
    neighbour : solution that the prediction starts from, or None
    arm : published composite motion whose arm is followed, or None for the tracked one
    """

    model: ModelFiles
    channels: Path
    calibration: Path | None
    tracked: Sequence[Path]
    neighbour: Path | None = None
    arm: Path | None = None


@dataclass(frozen=True)
class PredictionSettings:
    """How predictions are solved.

    Attributes
    ----------
    solve : settings; ``stability`` of the weights is that of the condition
    pause_s : pauses of the composite motion
    guidance : shares of the tracking weight on scapula and clavicle on the way from tracking
    capacity_steps : capacities on the way from a healthy neighbour
    choices : which problem is solved, the study's own or another
    variant : name of the choices
    """

    solve: SolveSettings
    pause_s: float
    guidance: tuple[float, ...]
    capacity_steps: tuple[float, ...]
    choices: ProblemChoices = STUDY
    variant: str = "study"


@dataclass(frozen=True, eq=False)
class _Scene:
    model: ShoulderModel
    composite: Composite
    muscles: MuscleParameters
    condition: Condition
    settings: PredictionSettings
    hand_load_kg: float = 0.0

    @property
    def solve_settings(self) -> SolveSettings:
        """Settings with the weights of the condition and of the problem that is chosen."""
        choices = self.settings.choices
        weights = {**self.settings.solve.weights, "stability": self.condition.w_gh}
        weights["clavicle_anchor"] = choices.clavicle_anchor
        if choices.strength_exponent is not None:
            weights["strength_exponent"] = choices.strength_exponent
        if choices.reaction_rate is not None:
            weights["reaction_rate"] = choices.reaction_rate
        return replace(self.settings.solve, weights=weights)

    def posed(self, capacity: float, guidance: float = 0.0) -> PosedProblem:
        """Problem at a capacity of the limited muscles and a guidance of the free segments."""
        choices, condition = self.settings.choices, self.condition
        target = composite_target(self.composite, TRACKED, guidance)
        if choices.elbow_in_pauses:
            target = replace(target, elbow_activity=np.ones(len(target.time_s)))
        limited = limit_capacity(
            self.muscles, self.model.record, condition.muscles, capacity, choices.lost_force
        )
        posed = pose(self.model, limited, target, self.solve_settings, self.hand_load_kg)
        free = with_capsule(posed.parameters, self.model.record)
        parameters = chosen_parameters(free, self.model.record, choices)
        stiffness = condition.girdle_stiffness_Nm_per_rad
        if stiffness is not None:
            parameters = stiffen_girdle(parameters, stiffness)
        bounds = chosen_bounds(choices, self.composite.reference, posed.bounds)
        return replace(posed, parameters=parameters, bounds=bounds)


def stiffen_girdle(parameters: np.ndarray, stiffness_Nm_per_rad: float) -> np.ndarray:
    """Run-time parameters (P,) with another stiffness of SC and AC joint."""
    values = {name: block.copy() for name, block in unpack(parameters).items()}
    values["joint_stiffness"][:2] = stiffness_Nm_per_rad
    return pack(values)


def limit_capacity(
    muscles: MuscleParameters,
    record: ModelRecord,
    limited: Sequence[str],
    capacity: float,
    lost_force: str = "active",
) -> MuscleParameters:
    """Muscle parameters with some muscles' force limited to a share: "active" or "whole" force.

    Raises
    ------
    ConfigError
        If the model has no such muscle.
    """
    groups = np.array(record.muscle_groups)
    unknown = sorted(set(limited) - set(groups))
    if unknown:
        raise ConfigError(
            f"prediction: no muscle {', '.join(unknown)}; the model has "
            f"{', '.join(sorted(set(groups)))}"
        )
    return without_force(muscles, np.isin(groups, list(limited)), capacity, lost_force)


def solve_prediction(
    condition: Condition,
    files: PredictionFiles,
    settings: PredictionSettings,
    solution: tuple[Path, Path],
    solver_log: Path,
) -> None:
    """Predict one condition; write solution and summary with its certificate.

    A solve that fails is written too, sealed by its status; so is one whose arm has no solution or
    whose muscles could not be calibrated.
    """
    tracked = _tracked(files, settings, allow_failed=True)
    missing = _missing(files, settings, tracked)
    if missing:
        # Generic muscles complete the problem that is sealed; nothing is solved with them.
        scene = _scene(condition, replace(files, calibration=None), settings, tracked)
        posed = scene.posed(condition.capacity)
        result = unsolved(posed, scene.composite.trajectory, missing, solver_log)
        _write(scene, files, posed, result, solution, "")
        return
    scene = _scene(condition, files, settings, tracked)
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


def _missing(
    files: PredictionFiles, settings: PredictionSettings, tracked: Sequence[Solution]
) -> str:
    """What a prediction is to be made from and has no result; empty if nothing."""
    reasons = []
    if settings.choices.arm == "own" and (failure := tracking_failure(tracked)):
        reasons.append(failure)
    if files.calibration is not None and (failure := calibration_failure(files.calibration)):
        reasons.append(failure)
    return "; ".join(reasons)


def posing(
    condition: Condition, files: PredictionFiles, settings: PredictionSettings
) -> Callable[[MuscleParameters], PosedProblem]:
    """Function that poses the problem of a condition for muscles of its participant without loss.

    For those of the files it is what :func:`solve_prediction` solves last.
    """
    scene = _scene(condition, files, settings, _tracked(files, settings))
    return lambda muscles: replace(scene, muscles=muscles).posed(condition.capacity)


def girdle_held(
    condition: Condition, files: PredictionFiles, settings: PredictionSettings
) -> tuple[PosedProblem, Callable[[float], PosedProblem]]:
    """The problem of a condition, and a function that poses it with its girdle held to a motion.

    The function takes a share of the tracking weight, with which clavicle and scapula follow the
    recording, or on a published arm the published prediction.
    """
    tracked = _tracked(files, settings)
    scene = _scene(condition, files, settings, tracked)
    free = scene.posed(condition.capacity)
    step = settings.solve.time_step_s
    if files.arm is not None:
        motion = published_pose(read_motion(files.arm), step)
    else:
        motions = [on_mesh(motion, step) for motion in tracked]
        motion = with_recorded_girdle(scene.composite, motions)
    scene = replace(scene, composite=replace(scene.composite, reference=motion))
    return free, lambda share: replace(scene.posed(condition.capacity, share), bounds=free.bounds)


def _tracked(
    files: PredictionFiles, settings: PredictionSettings, allow_failed: bool = False
) -> list[Solution]:
    """Tracked motions; `allow_failed` as in :func:`read_solution`."""
    # On another arm only what was recorded is taken from tracking.
    allowed = allow_failed or settings.choices.arm != "own"
    return [read_solution(path, allowed) for path in files.tracked]


def _scene(
    condition: Condition,
    files: PredictionFiles,
    settings: PredictionSettings,
    tracked: Sequence[Solution],
) -> _Scene:
    """Model, muscles and motion of a prediction."""
    model = load_model(files.model)
    muscles = calibrated_muscles(model.record, files.channels, files.calibration)
    composite, load = _followed(model, muscles, files, settings, tracked)
    return _Scene(model, composite, muscles, condition, settings, load)


def _followed(
    model: ShoulderModel,
    muscles: MuscleParameters,
    files: PredictionFiles,
    settings: PredictionSettings,
    tracked: Sequence[Solution],
) -> tuple[Composite, float]:
    """The arm motion that is followed, a start near it, and what the hand holds [kg]."""
    step = settings.solve.time_step_s
    motions = [on_mesh(motion, step) for motion in tracked]
    if settings.choices.arm == "own":
        composite = compose(motions, step, settings.pause_s)
        return composite, held_load(files.model, composite.nodes)
    if files.arm is None:
        raise ConfigError(
            "prediction on the published arm: this participant has no published composite motion"
        )
    published = published_pose(read_motion(files.arm), step)
    recorded = {motion.header["trial"]: motion.reference_pose for motion in motions}
    reference = published_on_recorded_girdle(published, recorded)
    activity = np.zeros(len(reference))
    for first, stop in PUBLISHED_PLANES.values():
        activity[first:stop] = 1.0
    load = held_load(files.model, PUBLISHED_PLANES)
    start = initial_guess.from_motion(
        model.forces,
        muscles,
        chosen_parameters(model.free_parameters(load), model.record, settings.choices),
        pose_to_trial(reference),
        step,
    )
    if settings.choices.largest_compression_N is not None:
        start = _relaxed(start)
    composite = Composite(
        time_s=step * np.arange(len(reference)),
        trajectory=start,
        reference=reference,
        activity=activity,
        nodes=PUBLISHED_PLANES,
    )
    return composite, load


def _relaxed(start: Trajectory) -> Trajectory:
    """The authors' start: muscles at rest and a joint that is pressed.

    Equilibrium of the recorded girdle takes most muscles at their limits and a joint that is pulled
    apart where it may only be pressed, and from there solves of their problem do not arrive.
    """
    activation = np.full_like(start.a, RESTING_ACTIVATION)
    reaction = np.zeros_like(start.reaction)
    reaction[:, 0] = RESTING_COMPRESSION_N
    return replace(start, a=activation, e=activation.copy(), reaction=reaction)


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
    if neighbour is not None and neighbour.optimal:
        before = neighbour.header["condition"]
        limited = set(before["muscles"]) != set(condition.muscles) or not before["muscles"]
        highest = 1.0 if limited else before["capacity"]
        between = [c for c in settings.capacity_steps if condition.capacity < c < highest]
        capacities = [*sorted(between, reverse=True), condition.capacity]
        steps = tuple(scene.posed(capacity) for capacity in capacities)
        variant = neighbour.header["variant"]
        own = variant == settings.variant
        name = before["name"] if own else f"{variant}/{before['name']}"
        yield _Way(name, neighbour.start, steps)
        # A far neighbour leads astray: its motion alone, with more of Gauss-Newton first.
        yield _Way(f"motion of {name}", Start(neighbour.free), steps)
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
    optional = (files.calibration, files.neighbour, files.arm)
    others += [path for path in optional if path is not None]
    about = header(
        posed,
        result,
        scene.solve_settings,
        participant=files.model.participant.parent.name,
        # A daily task is followed alone.
        trial="composite" if len(scene.composite.nodes) > 1 else next(iter(scene.composite.nodes)),
        condition=asdict(scene.condition),
        variant=scene.settings.variant,
        choices=asdict(scene.settings.choices),
        reached_from=way,
        planes=scene.composite.nodes,
        hand_load_kg=scene.hand_load_kg,
        body_mass_kg=scene.model.record.body_mass_kg,
        hashes=hashes(files.model, others, "scapulohumeral.stages.prediction"),
    )
    more = {**_certify(posed, result), "stop_moment_median_Nm": _stop_moment(posed, result)}
    store(read_result(posed, result, about), result, solution, more)


def _stop_moment(posed: PosedProblem, result: Result) -> float:
    """Median over the nodes of the larger moment of the stops of SC and AC [N m]."""
    q = posed.reader.trajectory(result.point.free).q
    still = np.hstack([q, np.zeros((len(q), 23))])
    without = {name: block.copy() for name, block in unpack(posed.parameters).items()}
    without["stop_stiffness"][:] = 0.0
    dynamics = posed.model.forces.dynamics
    moments = dynamics.residual(still, posed.parameters) - dynamics.residual(still, pack(without))
    largest = np.linalg.norm(moments[:, :6].reshape(-1, 2, 3), axis=2).max(axis=1)
    return float(np.median(largest))


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
