"""How each effect would change what is recorded of one task.

Letters: N nodes, K channels, P parameters, R nuisances, F smooth functions of phase for each degree
of freedom, M muscle elements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.control_bias import Drive
from scapulohumeral.gap.nominal.optimal_movement import (
    Movement,
    movement,
    nominal_start,
    with_state,
)
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import (
    SensorSetup,
    difference,
)
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.linearise import DOF, Linearised, followed, record_derivative
from scapulohumeral.gap.signatures.nuisances import (
    SMOOTH,
    SMOOTH_SHARES,
    session_records,
    unmeasured_records,
)
from scapulohumeral.gap.signatures.tempo import tempo_change, tempo_errors
from scapulohumeral.model.rotations import Array
from scapulohumeral.ocp.solving.solver import Start

# How firmly a person may keep a movement against an effect, in units of the tracking weight that
# recordings without effects are followed with: from the model's compromise between following and
# effort to a person who keeps the movement and pays with effort alone. A diagnosis integrates over
# them.
STIFFNESSES = (1.0, 10.0, 1000.0)


@dataclass(frozen=True, eq=False)
class TaskSignatures:
    """Nominal solution of one task and its derivatives.

    Attributes
    ----------
    task : name
    mean_record : of the recorded trials, to which all changes are relative
    nominal : the model's prediction of it
    point : nominal solution
    effects : (P, N, K) change per unit of each effect's internal parameters, for each stiffness
        with which the person may keep the movement (:data:`STIFFNESSES`)
    intended : (10, B, N, K) change per degree of each smooth change of the motion that was intended
    posture, session : (R, N, K) change per standard deviation of each nuisance: of the motion
        that was intended in this task, and of markers and electrodes, common to all tasks
    tempo, tempo_errors : (N, K) change of EMG and joint force by doing the movement in the time of
        the trials that are compared, and (R, N, K) per standard deviation of what it is off by
    unmeasured : (R, N, K) change per standard deviation of each turn of a segment that a rule
        stands for
    followed, followed_session, followed_unmeasured : change of the prediction by effects on the
        record, (P, N, K) each, by the session's nuisances and by those turns, (R, N, K), once the
        changed record is the one to track; empty if that was not asked for
    slack : (10, F, N, K) change per N m of each smooth generalised force
    levers : (N - 1, 10, M) generalised forces of full activations at mesh midpoints [N m]
    needed : (N - 1, 10) generalised forces that the muscles have to produce there [N m]
    drive : of the muscles beside effort
    """

    task: str
    mean_record: Observation
    nominal: Observation
    point: Start
    effects: tuple[tuple[Array, ...], ...]
    intended: Array
    posture: Array
    session: Array
    tempo: Array
    tempo_errors: Array
    unmeasured: Array
    followed: tuple[Array, ...]
    followed_session: Array
    followed_unmeasured: Array
    slack: Array
    levers: Array
    needed: Array
    drive: Drive

    def of_residual(self) -> TaskSignatures:
        """Changes of record minus prediction, instead of the record: what is left of an error of
        measurement after the prediction has followed it."""
        return replace(
            self,
            effects=tuple(
                tuple(e - f for e, f in zip(effects, self.followed, strict=True))
                for effects in self.effects
            ),
            session=self.session - self.followed_session,
            unmeasured=self.unmeasured - self.followed_unmeasured,
        )


def task_signatures(
    task: str,
    mean_record: Observation,
    compared_s: float,
    model: ParticipantModel,
    effects: Sequence[Effect],
    sensors: SensorSetup,
    settings: GapSettings,
    emg_tells_bias: bool,
    follows: bool,
) -> TaskSignatures:
    """Solve the nominal movement of a task and differentiate it.

    Parameters
    ----------
    task, mean_record : name and mean of its recorded trials
    compared_s : duration of the trials that are compared with it
    model, settings : of the nominal movement
    effects : what it is differentiated by; sensors : what is recorded
    emg_tells_bias : whether EMG tells how the person drives muscles without effects
    follows : whether the prediction is to be compared with records that it follows, see
        :meth:`TaskSignatures.of_residual`

    Raises
    ------
    SolveError                       the movement cannot be solved, or its KKT matrix is singular
    """
    move = movement(model, mean_record, settings)
    point = move.solved(move.body, nominal_start(move, settings), settings.iterations)
    if emg_tells_bias and mean_record.emg is not None:
        move, point = move.with_control_bias(
            point, mean_record.emg, sensors.electrodes, settings.iterations
        )
    tempo = tempo_change(move, point, mean_record, compared_s, sensors, model, settings)
    move = with_state(move, point)
    local = Linearised(move, move.body, point, mean_record.duration_s, sensors)
    by_stiffness = [local, *(local.kept(stiffness) for stiffness in STIFFNESSES[1:])]
    intended = by_stiffness[-1].intended(max(settings.phase_functions, SMOOTH))
    levers, needed = _balance(move, point)
    sessions = session_records(mean_record, settings)
    records = [*sessions, *unmeasured_records(mean_record, sensors)]
    changes = np.stack([difference(one, mean_record) for one in records])
    effects_followed: tuple[Array, ...] = ()
    records_followed = changes[:0]
    if follows:
        effects_followed, records_followed = followed(local, effects, records, mean_record)
    nuisance, unmeasured = slice(len(sessions)), slice(len(sessions), None)
    return TaskSignatures(
        task=task,
        mean_record=mean_record,
        nominal=local.observed,
        point=point,
        effects=_signatures(by_stiffness, effects, mean_record),
        intended=intended,
        posture=settings.session.posture_deg * _varying(intended),
        session=changes[nuisance],
        tempo=tempo,
        tempo_errors=tempo_errors(tempo, settings.signature_error),
        unmeasured=changes[unmeasured],
        followed=effects_followed,
        followed_session=records_followed[nuisance],
        followed_unmeasured=records_followed[unmeasured],
        slack=local.slack(),
        levers=levers,
        needed=needed,
        drive=move.drive,
    )


def _varying(intended: Array) -> Array:
    """Changes (10 SMOOTH, N, K) by smooth functions, which together vary by one degree."""
    shared = SMOOTH_SHARES[:, None, None] * intended[:, :SMOOTH]
    return shared.reshape(-1, *shared.shape[2:])


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


def _signatures(
    by_stiffness: Sequence[Linearised], effects: Sequence[Effect], mean_record: Observation
) -> tuple[tuple[Array, ...], ...]:
    """Change (P, N, K) by each effect where it is absent, for each stiffness."""
    local = by_stiffness[0]
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
        else record_derivative(effect, at[effect.label], mean_record)
        for effect in effects
    ]
    if not conditions:
        return tuple(tuple(directly) for _ in by_stiffness)
    found = []
    for person in by_stiffness:
        # Back-substituted together: the factors are read once for all.
        moved = person.through(np.hstack(list(conditions.values())))
        ends = np.cumsum([block.shape[1] for block in conditions.values()])[:-1]
        by_label = dict(zip(conditions, np.split(moved, ends), strict=True))
        found.append(
            tuple(
                change + by_label[effect.label] if effect.changes_body else change
                for effect, change in zip(effects, directly, strict=True)
            )
        )
    return tuple(found)
