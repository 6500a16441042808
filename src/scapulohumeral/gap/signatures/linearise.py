"""A solution with its KKT matrix, differentiated by effects, posture and generalised forces.

One factorisation serves all derivatives. Effects of measurement act on the recorded reference
itself, which is free of model error.

Letters: N nodes, K channels, P parameters, R nuisances, n unknowns, m constraints.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.optimal_movement import (
    Movement,
)
from scapulohumeral.gap.recording.observables import (
    SensorSetup,
    difference,
    phase_functions,
    predicted,
    predicted_changes,
)
from scapulohumeral.gap.signatures.nuisances import SMOOTH
from scapulohumeral.model.rotations import (
    Array,
    pose_to_trial,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.ocp.optimality.kkt import KktSystem, assemble_kkt
from scapulohumeral.ocp.optimality.sensitivity import (
    Sensitivity,
    condition_derivatives,
    sensitivity,
)
from scapulohumeral.ocp.solving.solver import Start

# Differences of smooth functions of order one.
STEP = 1e-4
DOF = 10


# Records a step ahead and a step behind of each parameter.
Steps = list[tuple[Observation, Observation]]


class Linearised:
    """A solution with its KKT matrix, ready to be differentiated.

    Parameters
    ----------
    move : movement; body : of the solution; point : solution
    duration_s : of the movement; sensors : what is recorded
    """

    def __init__(
        self, move: Movement, body: Body, point: Start, duration_s: float, sensors: SensorSetup
    ) -> None:
        self.move, self.body, self.point = move, body, point
        self.duration_s, self.sensors = duration_s, sensors
        self.problem = move.problem(body)
        self.kkt: KktSystem = assemble_kkt(self.problem, point)
        self.observed = self._record(point.free, body)

    def kept(self, stiffness: float) -> Linearised:
        """The same solution of a person who keeps the movement more firmly."""
        move = self.move.kept(self.point, stiffness)
        return Linearised(move, self.body, self.point, self.duration_s, self.sensors)

    def by_effect(
        self, effect: Effect, internal: Array, response: Sensitivity | None = None
    ) -> Array:
        """Change (P, N, K) of the record per unit of an effect on the body, at `internal` (P,).

        `response`: the derivatives of the solution, if they are known.
        """
        if response is None:
            response = self.response(effect, internal)
        return self.shown(response) + self.seen(effect, internal)

    def response(self, effect: Effect, internal: Array) -> Sensitivity:
        """Derivatives of the solution by an effect on the body, at `internal` (P,)."""
        return sensitivity(self.kkt, self.conditions(effect, internal))

    def conditions(self, effect: Effect, internal: Array) -> Array:
        """Derivatives (n + m, P) of the optimality conditions by an effect on the body.

        They do not depend on the stiffness.
        """

        def parts_for(x: Array):
            return self.move.parts(effect.apply(self.move.body, effect.physical(x)))

        return condition_derivatives(self.kkt, self.point, parts_for, internal)

    def seen(self, effect: Effect, internal: Array) -> Array:
        """Change (P, N, K) of the record of the same solution, by what electrodes see of it."""

        def record(x: Array) -> Observation:
            return self._record(self.point.free, effect.apply(self.move.body, effect.physical(x)))

        return _derivative(_stepped(record, internal))

    def intended(self, count: int) -> Array:
        """Change (10, count, N, K) per degree of smooth changes of the motion to track."""
        nodes = len(self.move.angles_rad)
        shapes = phase_functions(nodes, count) * np.sqrt(nodes)
        columns = [self._by_posture(dof, shape) for dof in range(DOF) for shape in shapes.T]
        changes = self.through(np.stack(columns, axis=1))
        return changes.reshape(DOF, count, *changes.shape[1:])

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

    def following(
        self, records: Sequence[tuple[Observation, Observation]], spans: Sequence[float]
    ) -> Array:
        """Change (R, N, K) of the prediction between pairs of tracked records, over spans (R,)."""
        columns = [
            self._by_reference(pose_to_trial(ahead.pose), pose_to_trial(behind.pose), span)
            for (ahead, behind), span in zip(records, spans, strict=True)
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
        return self.shown(sensitivity(self.kkt, conditions))

    def shown(self, response: Sensitivity) -> Array:
        """Changes of the record (P, N, K) of derivatives of the solution."""
        trajectory, sensors = self.problem.trajectory, self.sensors
        steps = [trajectory(step) for step in response.free.T]
        return predicted_changes(
            trajectory(self.point.free),
            steps,
            sensors.channels,
            self.body.seen * sensors.electrodes,
            sensors.contact,
        )

    def _record(self, free: Array, body: Body) -> Observation:
        r = self.sensors
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


def record_derivative(effect: Effect, internal: Array, mean_record: Observation) -> Array:
    """Change (P, N, K) of a record per unit of an effect on the measurement."""
    return _derivative(_recorded_steps(effect, internal, mean_record))


def _recorded_steps(effect: Effect, internal: Array, mean_record: Observation) -> Steps:
    return _stepped(lambda x: effect.observe(mean_record, effect.physical(x)), internal)


def _stepped(record: Callable[[Array], Observation], internal: Array) -> Steps:
    """Records a step ahead and a step behind of each parameter."""
    shifts = STEP * np.eye(len(internal))
    return [(record(internal + shift), record(internal - shift)) for shift in shifts]


def _derivative(steps: Steps) -> Array:
    return np.stack([difference(ahead, behind) / (2.0 * STEP) for ahead, behind in steps])


def followed(
    local: Linearised,
    effects: Sequence[Effect],
    nuisances: Sequence[Observation],
    mean_record: Observation,
) -> tuple[tuple[Array, ...], Array]:
    """Change of the prediction once a changed record is the one to track.

    Parameters
    ----------
    nuisances : records that are wrong by one standard deviation each, at least one

    Returns
    -------
    effects : (P, N, K) per unit of each effect
    nuisances : (R, N, K)
    """
    steps = {
        effect.label: _recorded_steps(effect, np.zeros(len(effect.params)), mean_record)
        for effect in effects
        if not effect.changes_body
    }
    pairs = [pair for several in steps.values() for pair in several]
    spans = [2.0 * STEP] * len(pairs) + [1.0] * len(nuisances)
    changes = local.following([*pairs, *((one, mean_record) for one in nuisances)], spans)
    ends = np.cumsum([len(several) for several in steps.values()])
    *by_effect, rest = np.split(changes, ends)
    by_label = dict(zip(steps, by_effect, strict=True))
    still = changes[:0].shape[1:]
    found = [by_label.get(e.label, np.zeros((len(e.params), *still))) for e in effects]
    return tuple(found), rest
