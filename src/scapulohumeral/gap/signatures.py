"""How each effect would change what is recorded: derivatives at the nominal solution of a task.

One factorisation of the KKT matrix gives the change by every parameter of every effect, by the
posture that was intended, and by generalised forces that no effect of the library makes (slack).
Effects of measurement act on the recorded reference itself, which is free of model error.

Letters: N nodes, K channels, P parameters, R nuisances, S = 10 x F slack forces (F functions of
phase for each degree of freedom).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.gap.effects.base import Body, Effect, Observed
from scapulohumeral.gap.effects.emd import PARAMS as DELAY
from scapulohumeral.gap.effects.emd import Emd
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.forward import Movement, movement, nominal_start, with_state
from scapulohumeral.gap.habits import Drive
from scapulohumeral.gap.observe import difference, phase_functions, predicted
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.model.rotations import (
    Array,
    pose_to_trial,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.ocp.kkt import KktSystem, assemble_kkt
from scapulohumeral.ocp.sensitivity import condition_derivatives, sensitivity
from scapulohumeral.ocp.solver import Start

# Smooth changes of posture and smooth slack forces: mean, trend, and one bend more each.
SMOOTH = 4
# Standard deviations of smooth functions that together vary by one unit, slow ones the most.
SMOOTH_SHARES = 1.0 / np.arange(1, SMOOTH + 1) / np.linalg.norm(1.0 / np.arange(1, SMOOTH + 1))
FRAME_SEGMENTS = ("thorax", "scapula", "humerus")
# How firmly a person may keep a movement against an effect, in units of the tracking weight that
# recordings without effects are followed with. Of 20 opened blind cases of one effect on the body
# with reference trials, 12 were 4 to 29 units of log evidence more probable with 10, and two 7 and
# 45 units less; 100 was no better than 10.
FIRMNESS = (1.0, 10.0)
# Differences of smooth functions of order one.
STEP = 1e-4
DOF = 10
# Records a step ahead and a step behind of each parameter.
Steps = list[tuple[Observed, Observed]]


@dataclass(frozen=True, eq=False)
class Recorder:
    """What is recorded of solutions.

    Attributes
    ----------
    channels : EMG channels; electrodes : (C, M) elements that they average
    contact : whether the joint force is recorded
    """

    channels: tuple[str, ...]
    electrodes: Array
    contact: bool


@dataclass(frozen=True, eq=False)
class Response:
    """Nominal solution of one task and its derivatives.

    Attributes
    ----------
    task : name
    anchor : mean record to which all changes are relative; nominal : the model's prediction of it
    point : nominal solution
    effects : (P, N, K) change per unit of each effect's internal parameters, for each firmness
        with which the person may keep the movement (:data:`FIRMNESS`)
    posture, session : (R, N, K) change per standard deviation of each nuisance: of the motion
        that was intended in this task, and of markers and electrodes, common to all tasks
    followed, followed_session : change of the prediction by effects on the record, (P, N, K) each,
        and by the session's nuisances, (R, N, K), once the changed record is the one to track
    slack : (10, F, N, K) change per N m of each smooth generalised force
    levers : (N - 1, 10, M) generalised forces of full activations at mesh midpoints [N m]
    needed : (N - 1, 10) generalised forces that the muscles have to produce there [N m]
    drive : of the muscles beside effort
    """

    task: str
    anchor: Observed
    nominal: Observed
    point: Start
    effects: tuple[tuple[Array, ...], ...]
    posture: Array
    session: Array
    followed: tuple[Array, ...]
    followed_session: Array
    slack: Array
    levers: Array
    needed: Array
    drive: Drive

    def of_residual(self) -> Response:
        """Changes of record minus prediction, instead of the record: what is left of an error of
        measurement after the prediction has followed it."""
        return replace(
            self,
            effects=tuple(
                tuple(e - f for e, f in zip(effects, self.followed, strict=True))
                for effects in self.effects
            ),
            session=self.session - self.followed_session,
        )


def respond(
    task: str,
    anchor: Observed,
    model: ParticipantModel,
    effects: Sequence[Effect],
    recorder: Recorder,
    settings: GapSettings,
    tells_habits: bool,
) -> Response:
    """Solve the nominal movement of a task and differentiate it.

    Parameters
    ----------
    task, anchor : name and mean record; model, settings : of the nominal movement
    effects : what it is differentiated by; recorder : what is recorded
    tells_habits : whether EMG tells how the person drives muscles without effects

    Raises
    ------
    SolveError                       the movement cannot be solved, or its KKT matrix is singular
    """
    move = movement(model, anchor, settings)
    point = move.solved(move.body, nominal_start(move, settings), settings.iterations)
    if tells_habits and anchor.emg is not None:
        move, point = move.with_habits(point, anchor.emg, recorder.electrodes, settings.iterations)
    move = with_state(move, point)
    local = Linearised(move, move.body, point, anchor.duration_s, recorder)
    levers, needed = _balance(move, point)
    sessions = session_records(anchor, settings)
    return Response(
        task=task,
        anchor=anchor,
        nominal=local.observed,
        point=point,
        effects=_signatures(local, effects, anchor),
        posture=settings.session.posture_deg * _shared_out(local.posture()),
        session=np.stack([difference(one, anchor) for one in sessions]),
        followed=tuple(_followed(local, effect, anchor) for effect in effects),
        followed_session=local.following([(one, anchor) for one in sessions], 1.0),
        slack=local.slack(),
        levers=levers,
        needed=needed,
        drive=move.drive,
    )


def _shared_out(changes: Array) -> Array:
    """Changes (10 SMOOTH, N, K) by smooth functions, which together vary as much as one unit."""
    return np.tile(SMOOTH_SHARES, len(changes) // SMOOTH)[:, None, None] * changes


def _balance(move: Movement, point: Start) -> tuple[Array, Array]:
    """What muscles can do and have to do at the mesh midpoints of a solution."""
    x = move.trajectory(point)
    q, u = (0.5 * (v[1:] + v[:-1]) for v in (x.q, x.u))
    rate = np.diff(x.u, axis=0) / move.objective.step
    z = np.hstack([q, u, rate, np.zeros((len(q), 3))])
    rest = np.zeros((len(q), x.a.shape[1]))
    passive, _, by_activation = move.forces.jacobian(q, u, rest, move.body.muscles)
    load = move.forces.dynamics.residual(z, pack(move.body.parameters)) + passive
    return by_activation[:, :DOF], -load[:, :DOF]


class Linearised:
    """A solution with its KKT matrix, ready to be differentiated.

    Parameters
    ----------
    move : movement; body : of the solution; point : solution
    duration_s : of the movement; recorder : what is recorded
    """

    def __init__(
        self, move: Movement, body: Body, point: Start, duration_s: float, recorder: Recorder
    ) -> None:
        self.move, self.body, self.point = move, body, point
        self.duration_s, self.recorder = duration_s, recorder
        self.problem = move.problem(body)
        self.kkt: KktSystem = assemble_kkt(self.problem, point)
        self.observed = self._record(point.free, body)

    def kept(self, firmness: float) -> Linearised:
        """The same solution of a person who keeps the movement more firmly."""
        move = self.move.kept(self.point, firmness)
        return Linearised(move, self.body, self.point, self.duration_s, self.recorder)

    def by_effect(self, effect: Effect, internal: Array) -> Array:
        """Change (P, N, K) of the record per unit of an effect on the body, at `internal`."""
        return self.through(self.conditions(effect, internal)) + self.seen(effect, internal)

    def conditions(self, effect: Effect, internal: Array) -> Array:
        """Derivatives (n + m, P) of the optimality conditions by an effect on the body.

        They do not depend on the firmness.
        """

        def variant_of(x: Array):
            return self.move.variant(effect.apply(self.move.body, effect.physical(x)))

        return condition_derivatives(self.kkt, self.point, variant_of, internal)

    def seen(self, effect: Effect, internal: Array) -> Array:
        """Change (P, N, K) of the record of the same solution, by what electrodes see of it."""

        def record(x: Array) -> Observed:
            return self._record(self.point.free, effect.apply(self.move.body, effect.physical(x)))

        return _derivative(_stepped(record, internal))

    def posture(self) -> Array:
        """Change (10 SMOOTH, N, K) per degree of a smooth change of the motion to track."""
        nodes = len(self.move.angles_rad)
        shapes = phase_functions(nodes, SMOOTH) * np.sqrt(nodes)
        columns = [self._by_posture(dof, shape) for dof in range(DOF) for shape in shapes.T]
        return self.through(np.stack(columns, axis=1))

    def slack(self) -> Array:
        """Change (10, SMOOTH, N, K) per N m of smooth generalised forces."""
        intervals = len(self.move.angles_rad) - 1
        shapes = phase_functions(intervals, SMOOTH) * np.sqrt(intervals)
        right = np.zeros((self.kkt.factors.order, DOF, SMOOTH))
        first = self.kkt.unknowns + self.problem.layout.coordinates * intervals
        for dof in range(DOF):
            rows = first + dof * intervals + np.arange(intervals)
            right[rows, dof] = shapes
        changes = self.through(right.reshape(len(right), -1))
        return changes.reshape(DOF, SMOOTH, *changes.shape[1:])

    def following(self, records: Sequence[tuple[Observed, Observed]], span: float) -> Array:
        """Change (R, N, K) of the prediction between pairs of tracked records, over `span`."""
        columns = [
            self._by_reference(pose_to_trial(ahead.pose), pose_to_trial(behind.pose), span)
            for ahead, behind in records
        ]
        return self.through(np.stack(columns, axis=1))

    def _by_posture(self, dof: int, shape: Array) -> Array:
        """Derivative (n + m,) of the optimality conditions by one degree of posture."""
        ahead, behind = (
            _moved(self.move.angles_rad, dof, np.deg2rad(sign * STEP) * shape)
            for sign in (1.0, -1.0)
        )
        return self._by_reference(ahead, behind, 2.0 * STEP)

    def _by_reference(self, ahead: Array, behind: Array, span: float) -> Array:
        """Change (n + m,) of the conditions between two motions to track, over `span`."""
        x = self.problem.trajectory(self.point.free)
        gradients = [
            self.problem.layout.join_gradient(self.move.with_reference(angles).gradient(x))
            for angles in (ahead, behind)
        ]
        column = np.zeros(self.kkt.factors.order)
        column[: self.kkt.unknowns] = (gradients[0] - gradients[1]) / span
        return column

    def through(self, conditions: Array) -> Array:
        """Changes of the record (P, N, K) of derivatives (n + m, P) of the conditions."""
        moved = sensitivity(self.kkt, conditions).free
        return np.stack([self._change(direction) for direction in moved.T])

    def _change(self, direction: Array) -> Array:
        step = STEP / max(float(np.abs(direction).max()), 1e-12)
        ahead, behind = (
            self._record(self.point.free + sign * step * direction, self.body)
            for sign in (1.0, -1.0)
        )
        return difference(ahead, behind) / (2.0 * step)

    def _record(self, free: Array, body: Body) -> Observed:
        r = self.recorder
        x = self.problem.trajectory(free)
        return predicted(x, self.duration_s, r.channels, body.seen * r.electrodes, r.contact)


def _moved(angles: Array, dof: int, by_rad: Array) -> Array:
    """Joint angles (N, 10) with one joint turned about one of its distal axes by (N,) rad."""
    pose = trial_to_pose(angles)
    if dof == DOF - 1:
        pose[:, 12] += by_rad
    else:
        part = slice(4 * (dof // 3), 4 * (dof // 3) + 4)
        turn = rotation_vector_to_quaternion(by_rad[:, None] * np.eye(3)[dof % 3])
        pose[:, part] = quaternion_multiply(pose[:, part], turn)
    return pose_to_trial(pose)


def _signatures(
    local: Linearised, effects: Sequence[Effect], anchor: Observed
) -> tuple[tuple[Array, ...], ...]:
    """Change (P, N, K) by each effect where it is absent, for each firmness."""
    at = {effect.label: np.zeros(len(effect.params)) for effect in effects}
    conditions = {
        effect.label: local.conditions(effect, at[effect.label])
        for effect in effects
        if effect.changes_body
    }
    # What effects change in the record of one and the same solution.
    directly = [
        local.seen(effect, at[effect.label])
        if effect.changes_body
        else record_derivative(effect, at[effect.label], anchor)
        for effect in effects
    ]
    persons = [local if firmness == 1.0 else local.kept(firmness) for firmness in FIRMNESS]
    return tuple(
        tuple(
            change + person.through(conditions[effect.label]) if effect.changes_body else change
            for effect, change in zip(effects, directly, strict=True)
        )
        for person in persons
    )


def record_derivative(effect: Effect, internal: Array, anchor: Observed) -> Array:
    """Change (P, N, K) of a record per unit of an effect on the measurement."""
    return _derivative(_recorded_steps(effect, internal, anchor))


def _recorded_steps(effect: Effect, internal: Array, anchor: Observed) -> Steps:
    return _stepped(lambda x: effect.observe(anchor, effect.physical(x)), internal)


def _stepped(record: Callable[[Array], Observed], internal: Array) -> Steps:
    """Records a step ahead and a step behind of each parameter."""
    shifts = STEP * np.eye(len(internal))
    return [(record(internal + shift), record(internal - shift)) for shift in shifts]


def _derivative(steps: Steps) -> Array:
    return np.stack([difference(ahead, behind) / (2.0 * STEP) for ahead, behind in steps])


def _followed(local: Linearised, effect: Effect, anchor: Observed) -> Array:
    """Change (P, N, K) of the prediction per unit of an effect on the record that it tracks."""
    if effect.changes_body:
        return np.zeros((len(effect.params), *difference(anchor, anchor).shape))
    steps = _recorded_steps(effect, np.zeros(len(effect.params)), anchor)
    return local.following(steps, 2.0 * STEP)


def session_records(anchor: Observed, settings: GapSettings) -> list[Observed]:
    """Records (R) with one standard deviation of each error of a new session.

    Frames of three segments, axial rotation of the clavicle, gain, offset and timing of EMG.
    """
    s, nodes = settings.session, len(anchor.pose)
    records = []
    for segment in FRAME_SEGMENTS:
        for vector in np.deg2rad(s.frame_deg) * np.eye(3):
            records.append(replace(anchor, pose=turn_frame(anchor.pose, segment, vector)))
    for shape in SMOOTH_SHARES[:, None] * phase_functions(nodes, SMOOTH).T * np.sqrt(nodes):
        vectors = np.deg2rad(s.clavicle_axial_deg) * shape[:, None] * np.eye(3)[0]
        records.append(replace(anchor, pose=turn_frame(anchor.pose, "clavicle", vectors)))
    if anchor.emg is not None:
        for k in range(len(anchor.channels)):
            one = np.eye(len(anchor.channels))[k]
            for emg in (anchor.emg * (1.0 + s.emg_gain * one), anchor.emg + s.emg_offset * one):
                records.append(replace(anchor, emg=emg))
        delay = Emd("measurement", "emd", None, DELAY, frozenset(), (), "")
        records.append(delay.observe(anchor, np.array([s.timing_ms])))
    return records
