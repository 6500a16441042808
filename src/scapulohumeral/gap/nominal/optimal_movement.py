"""The nominal model of one movement, with effects: an optimal control problem and its solutions."""

from __future__ import annotations

import logging
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from scapulohumeral.dynamics.hill import force_derivatives
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.dynamics.participant_parameters import dynamics_parameters, with_capsule
from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.body import JOINTS, Body
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.control_bias import Drive, no_drive, toward_emg
from scapulohumeral.gap.nominal.force_levers import ALONG, force_levers
from scapulohumeral.gap.nominal.loaded_collocation import body_bounds, load_collocation
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import mean_pose
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.model.rotations import (
    pose_to_trial,
    quaternion_to_matrix,
    trial_to_pose,
)
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.objective import SEGMENTS, Objective, Trajectory, Weights
from scapulohumeral.ocp.optimality.sensitivity import ProblemParts, parts_of
from scapulohumeral.ocp.problem import Bounds, Problem
from scapulohumeral.ocp.solving import initial_guess
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve
from scapulohumeral.ocp.transcription import muscle_patterns
from scapulohumeral.problems.chosen_problem import chosen_bounds, chosen_parameters
from scapulohumeral.problems.posed_problem import effort_factors
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.quantities.joint_loading import glenoid_angles, superior_inferior_share

log = logging.getLogger(__name__)

BARRIER = 1e-5
TOLERANCE = 1e-6
# Gauss-Newton iterations before exact ones: most movements need few; where the muscles can hardly
# bear the start, more of them lead to a region from which exact iterations converge.
HASTY, PATIENT = 25, 80
# The same from the solution of a movement without an effect. On two meshes 24 solves took up to 4 %
# more than the least time; with 12 up to a third, because some then need many exact iterations.
AGAIN = 18
# Exact iterations from a predicted solution: 24 solves of two effects between simulations needed 2
# to 9, in 0.4 of the time. One that needs many more is not on its way.
NEARBY = 15
NOMINAL = SolverSettings(tolerance=TOLERANCE, barrier_target=BARRIER, gauss_newton_iterations=HASTY)
SOLVED_AGAIN = replace(NOMINAL, far=True, barrier_start=BARRIER, gauss_newton_iterations=AGAIN)
PREDICTED = replace(NOMINAL, stays_near=True, max_iterations=NEARBY)
# Share of the effort that counts excitations instead of activations, for all muscles: without it
# the cost of a single muscle's effort could not be varied to both sides of the nominal one.
EXCITATION_EFFORT = 0.01
# What takes longer to set up than to differentiate, and serves all variants of a movement.
KEPT = ("set_up", "_nominal")
# Smoothing of the scapulothoracic contact over that of the study, of tracked movements. Markers
# place a scapula to some millimetres, and it glides on muscle: on ribs as hard as DAS3's, whether a
# recorded scapula touches them at all is chance, and a derivative holds for a millimetre.
CONTACT_WIDTH = 3.0
# What predictions track; scapula and clavicle are free.
PREDICTED_FROM = ("humerus", "elbow")
GH_QUATERNION = slice(8, 12)
SPEEDS = 10
# Rows of the equations that belong to each joint.
JOINT_ROWS = {"SC": slice(0, 3), "AC": slice(3, 6), "GH": slice(6, 9), "EL": slice(9, 10)}


@dataclass(frozen=True, eq=False)
class Movement:
    """The tracking problem of one movement.

    Attributes
    ----------
    forces : equations and muscle geometry
    body : nominal body
    objective : objective with the nominal glenoid and without effort of its own
    angles_rad : (N, 10) motion to track
    drive : of the muscles beside effort
    bounds : of the unknowns
    mesh : problem of as many nodes with the same equations and muscles, if there is one already
    """

    forces: MuscleForces
    body: Body
    objective: Objective
    angles_rad: np.ndarray
    drive: Drive
    bounds: Bounds = Bounds()
    mesh: Problem | None = None

    def problem(self, body: Body, hessian: str = "exact") -> Problem:
        """The problem with another body."""
        base = self.set_up
        bounds = body_bounds(base.layout, body, (base.lower_bound, base.upper_bound))
        loaded = load_collocation(base.collocation, body)
        return base.varied(loaded, self._objective(body), hessian, bounds)

    def parts(self, body: Body) -> ProblemParts:
        """The same for derivatives, without opty's set-up."""
        nominal = self._nominal
        layout = self.set_up.layout
        lower, upper = body_bounds(layout, body, (nominal.lower, nominal.upper))
        return ProblemParts(
            load_collocation(nominal.collocation, body), self._objective(body), lower, upper
        )

    def with_reference(self, angles_rad: np.ndarray) -> Objective:
        """The objective that tracks another motion, (N, 10) [rad]."""
        distance = float(self.objective.reference[0, 0])
        reference = self.objective.errors.reference(angles_rad, distance)
        return replace(self._objective(self.body), reference=reference)

    @cached_property
    def set_up(self) -> Problem:
        """Mesh, layout and bounds for all bodies; it is not solved itself."""
        body, objective = self.body, self._objective(self.body)
        if self.mesh is None:
            parameters = pack(body.parameters)
            return Problem(
                self.forces, body.muscles, parameters, objective, "exact", bounds=self.bounds
            )
        collocation = replace(
            self.mesh.collocation,
            muscles=body.muscles,
            parameters=pack(body.parameters),
            step=objective.step,
        ).with_patterns_of(self.mesh.collocation)
        bounds = self.mesh.lower_bound, self.mesh.upper_bound
        return self.mesh.varied(collocation, objective, "exact", bounds)

    @cached_property
    def _nominal(self) -> ProblemParts:
        return parts_of(self.set_up)

    def _objective(self, body: Body) -> Objective:
        inclination, version = body.glenoid_rad
        emg = self.drive.term(self.objective.effort * body.effort)
        weights = self.objective.weights
        weighted = replace(
            weights,
            stability=body.stability * weights.stability,
            regularisation=body.rates * weights.regularisation,
            excitation_rate=body.rates * weights.excitation_rate,
        )
        return replace(self.objective, glenoid=(inclination, version), emg=emg, weights=weighted)

    def cold_start(self) -> Start:
        """Start near the motion to track."""
        guess = initial_guess.from_motion(
            self.forces,
            self.body.muscles,
            pack(self.body.parameters),
            self.angles_rad,
            self.objective.step,
        )
        low, high = self.body.floor + 1e-3, self.body.cap - 1e-3
        guess = replace(guess, a=np.clip(guess.a, low, high), e=np.clip(guess.e, low, high))
        return Start(self.set_up.layout.join(guess))

    def solved(self, body: Body, start: Start, iterations: int) -> Start:
        """Solution for a body.

        A cold start is solved without joint stability first: the joint force of a start may point
        anywhere, and where it hardly compresses, stability outweighs all else and leads into poor
        optima. If that fails, it is tried again with more patience. Both solutions end with the
        same barrier only from a warm start, by whose gradient IPOPT scales.

        Raises
        ------
        SolveError                   IPOPT did not reach its tolerance
        """
        hasty = replace(NOMINAL, max_iterations=iterations)
        if start.multipliers is not None:
            return self._solved(body, start, hasty)
        free = self._without_stability()
        try:
            point = free._solved(body, start, hasty)
        except SolveError:
            patient = replace(hasty, gauss_newton_iterations=PATIENT)
            point = free._solved(body, start, patient)
        return self._solved(body, point, hasty)

    def solved_again(
        self, body: Body, start: Start, iterations: int, predicted: Start | None = None
    ) -> Start:
        """Solution for a body with an effect, from the solution for another one.

        First from where derivatives predict it, with exact steps alone, if that is given. If that
        does not arrive, from the other solution: many bounds become active or inactive on the way,
        and with the multipliers of that start they cut steps short (of 28 to 60 exact steps most
        went less than a tenth of the way). So Gauss-Newton goes first, and leaves 1 to 6 exact
        ones.

        Parameters
        ----------
        start : solution for the other body
        iterations : after which a solve from there counts as failed
        predicted : solution and multipliers that derivatives predict

        Raises
        ------
        SolveError                   IPOPT did not reach its tolerance
        """
        if predicted is not None:
            try:
                return self._solved(body, predicted, PREDICTED)
            except SolveError as error:
                log.info("from a predicted solution: %s", error)
        return self._solved(body, start, replace(SOLVED_AGAIN, max_iterations=iterations))

    def _without_stability(self) -> Movement:
        return self.with_weights(replace(self.objective.weights, stability=0.0))

    def with_weights(self, weights: Weights) -> Movement:
        """The same movement with other weights."""
        return self._varied(objective=replace(self.objective, weights=weights))

    def with_control_bias(
        self, point: Start, emg: np.ndarray, electrodes: np.ndarray, iterations: int
    ) -> tuple[Movement, Start]:
        """The same movement of a person who is driven as EMG shows, and its solution.

        Parameters
        ----------
        point : solution without control bias; iterations : after which a solve counts as failed
        emg : (N, C) of maximum voluntary contraction
        electrodes : (C, M) elements that channels average

        Raises
        ------
        SolveError                   EMG cannot be followed
        """
        drive = toward_emg(self.trajectory(point).e, emg, electrodes)
        following = self.driven(drive)
        point = following.solved(self.body, point, iterations)
        return self.driven(drive.bias(self.trajectory(point).e)), point

    def driven(self, drive: Drive) -> Movement:
        """The same movement with another drive of the muscles."""
        return self._varied(drive=drive)

    def kept(self, point: Start, stiffness: float) -> Movement:
        """The same movement of a person who keeps its solution more firmly against effects.

        Tracking counts `stiffness` times as much, of a motion that much nearer to the solution: the
        solution is the same, and what departs from it costs more.
        """
        if stiffness == 1.0:
            return self
        share = 1.0 / stiffness
        poses = self.trajectory(point).q, trial_to_pose(self.angles_rad)
        pose = mean_pose(poses, [1.0 - share, share])
        weights = self.objective.weights
        return self._varied(
            objective=replace(
                self.with_reference(pose_to_trial(pose)),
                weights=replace(weights, trajectory=stiffness * weights.trajectory),
            )
        )

    def with_nominal_body(self, body: Body) -> Movement:
        """The same movement with another nominal body of equal equations without effects."""
        return self._varied(body=body)

    def _varied(self, **changes: Any) -> Movement:
        other = replace(self, **changes)
        for name in KEPT:
            other.__dict__[name] = getattr(self, name)
        return other

    def _solved(self, body: Body, start: Start, settings: SolverSettings) -> Start:
        result = solve(lambda hessian: self.problem(body, hessian), start, settings)
        if not result.optimal:
            raise SolveError(
                f"movement of {self.objective.step * (len(self.angles_rad) - 1):.2f} s: "
                f"{result.message} after {result.iterations} iterations, violation "
                f"{result.constraint_violation:.1e}; expected a solution. Check the recording, or "
                "raise iterations in the settings."
            )
        return result.point

    def trajectory(self, point: Start) -> Trajectory:
        """Trajectories of a solution."""
        return self.set_up.trajectory(point.free)


def movement(model: ParticipantModel, observed: Observation, settings: GapSettings) -> Movement:
    """The problem of a recorded movement with the nominal body of a participant."""
    angles = pose_to_trial(observed.pose)
    errors = pose_errors(model.forces.dynamics.name)
    w, choices = settings.weights, settings.choices
    weights = Weights(
        trajectory=w["trajectory_quaternion"],
        activation=w["activation"] * (1.0 - EXCITATION_EFFORT),
        stability=w["stability"],
        regularisation=w["regularisation"],
        reaction_rate=w["reaction_rate"],
        excitation_rate=w["excitation_rate"],
        quaternion_norm=w["quaternion_norm"],
        emg=w["activation"],
        tracked=SEGMENTS if settings.view == "tracking" else PREDICTED_FROM,
    )
    body = nominal_body(model, len(angles))
    if settings.view == "tracking":
        body = _on_soft_ribs(body)
    else:
        free = with_capsule(pack(body.parameters), model.record)
        chosen = chosen_parameters(free, model.record, choices)
        body = replace(body, parameters=unpack(chosen))
    drive = no_drive(len(angles), len(body.effort))
    objective = Objective(
        errors=errors,
        reference=errors.reference(angles, w["clavicle_point_m"]),
        weights=weights,
        step=observed.duration_s / (len(angles) - 1),
        glenoid=(float(body.glenoid_rad[0]), float(body.glenoid_rad[1])),
        superior_inferior_share=superior_inferior_share(model.record),
        activity=np.ones(len(angles)),
        effort=effort_factors(model.muscles, w.get("strength_exponent", 0.0)),
        emg=drive.term(body.effort),
    )
    bounds = chosen_bounds(choices, observed.pose, Bounds().around(angles))
    # A trial is a part of a motion: what holds at the ends of the whole says nothing of its ends.
    bounds = replace(bounds, coordinates=None, ends_at_rest=False)
    meshes, like = _meshes(model, choices), (len(angles), bounds.elbow)
    move = Movement(model.forces, body, objective, angles, drive, bounds, meshes.get(like))
    meshes.setdefault(like, move.set_up)
    return move


@lru_cache(maxsize=1)
def _meshes(
    model: ParticipantModel, choices: ProblemChoices
) -> dict[tuple[int, tuple[float, float]], Problem]:
    """Problems of the model in use by number of nodes and bounds of the elbow.

    Opty's set-up takes seconds.
    """
    return {}


def nominal_start(move: Movement, settings: GapSettings) -> Start:
    """Where the nominal solution is looked for: predictions begin at the tracked movement.

    Raises
    ------
    SolveError                       the movement cannot be tracked
    """
    start = move.cold_start()
    if settings.view == "tracking":
        return start
    tracking = move.with_weights(replace(move.objective.weights, tracked=SEGMENTS))
    return tracking.solved(tracking.body, start, settings.iterations)


def nominal_body(model: ParticipantModel, nodes: int) -> Body:
    """The body without effects."""
    record, count = model.record, len(model.muscles.names)
    _, equations = muscle_patterns(model.forces)
    crossing = np.stack([equations[JOINT_ROWS[joint]].any(axis=0) for joint in JOINTS], axis=1)
    return Body(
        muscles=model.muscles,
        parameters=unpack(dynamics_parameters(record, model.thorax, 0.0)),
        glenoid_rad=np.array(glenoid_angles(record)),
        effort=np.full(count, EXCITATION_EFFORT),
        floor=np.zeros(count),
        cap=np.ones(count),
        seen=np.ones(count),
        groups=np.array(record.muscle_groups),
        crossing=crossing,
        tendon_load=np.zeros((nodes - 1, count)),
        gh_elevation_rad=np.zeros(nodes - 1),
        gh_lift=np.zeros((nodes - 1, 3)),
        levers={point: np.zeros((nodes - 1, SPEEDS + 3, 3)) for point in ALONG},
        pull=np.zeros((nodes - 1, SPEEDS + 3, count)),
        external_Nm=np.zeros((nodes - 1, SPEEDS)),
        external_N=np.zeros((nodes - 1, 3)),
        stability=1.0,
        rates=1.0,
    )


def _on_soft_ribs(body: Body) -> Body:
    """A body whose scapula glides on muscles."""
    width = CONTACT_WIDTH * np.asarray(body.parameters["contact_eps"])
    return replace(body, parameters={**body.parameters, "contact_eps": width})


def with_state(move: Movement, point: Start) -> Movement:
    """The movement whose nominal body knows its muscles' tension and its posture in a solution.

    Effects alone turn these into forces, so the nominal problem is the same.
    """
    x = move.trajectory(point)
    q, u, a = (0.5 * (v[1:] + v[:-1]) for v in (x.q, x.u, x.a))
    muscles = move.body.muscles
    force = force_derivatives(*move.forces.lengths(q, u), muscles)
    tension = force.active * a + force.passive
    elevation, lift = gh_elevation(q)
    body = replace(
        move.body,
        tendon_load=tension / muscles.max_isometric_force,
        gh_elevation_rad=elevation,
        gh_lift=lift,
        levers=force_levers(move.forces.dynamics, move.body.parameters, q),
        pull=-tension[:, None] * move.forces.gradients(q).transpose(0, 2, 1),
    )
    return move.with_nominal_body(body)


def gh_elevation(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Elevation (N,) [rad] of the humerus from the scapula's y axis at poses (N, 13).

    Returns
    -------
    elevation : between the y axes of both
    lift : (N, 3) unit axis about which it grows, in axes of the humerus; zero where they coincide
    """
    matrix = quaternion_to_matrix(pose[:, GH_QUATERNION])
    # Rows of the matrix are axes of the scapula, seen from the humerus.
    vertical = matrix[:, 1]
    elevation = np.arccos(np.clip(vertical[:, 1], -1.0, 1.0))
    axis = np.cross(vertical, [0.0, 1.0, 0.0])
    return elevation, axis / np.maximum(np.linalg.norm(axis, axis=1, keepdims=True), 1e-6)
