"""Movements solved again with an effect, because large effects are not linear.

Letters: N nodes, K channels, P parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.nominal.optimal_movement import Movement, movement, with_state
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import SensorSetup, difference
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.linearise import Linearised, record_derivative
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures
from scapulohumeral.ocp.optimality.sensitivity import Variant
from scapulohumeral.ocp.solving.solver import Start

MARGIN = 1e-4


def stiffened_movement(
    model: ParticipantModel, of_task: TaskSignatures, stiffness: float, settings: GapSettings
) -> Movement:
    """The nominal movement of a task, kept with a stiffness, ready to be solved with effects."""
    move = movement(model, of_task.mean_record, settings).driven(of_task.drive)
    return with_state(move, of_task.point).kept(of_task.point, stiffness)


def recorded_change(
    effect: Effect, x: np.ndarray, of_task: TaskSignatures
) -> tuple[np.ndarray, np.ndarray]:
    """Change (N, K) of the record by an effect on it, and its derivative (P, N, K)."""
    changed = effect.observe(of_task.mean_record, effect.physical(x))
    return difference(changed, of_task.mean_record), record_derivative(
        effect, x, of_task.mean_record
    )


@dataclass(frozen=True, eq=False)
class Resolve:
    """A movement to be solved with effects on the body.

    Attributes
    ----------
    move : movement; of_task : its nominal solution, and what effects change of it
    sensors : what is recorded; iterations : after which a solve counts as failed
    """

    move: Movement
    of_task: TaskSignatures
    sensors: SensorSetup
    iterations: int

    def solved(
        self, effect: Effect, x: np.ndarray, start: Start
    ) -> tuple[np.ndarray, np.ndarray, Start]:
        """Change (N, K) at internal parameters (P,), its derivative (P, N, K), solution.

        Raises
        ------
        SolveError                       the movement with the effect cannot be solved
        """
        body = effect.apply(self.move.body, effect.physical(x))
        inside = _inside(start, self.move.variant(body))
        point = self.move.solved_again(body, inside, self.iterations)
        duration = self.of_task.mean_record.duration_s
        local = Linearised(self.move, body, point, duration, self.sensors)
        return difference(local.observed, self.of_task.nominal), local.by_effect(effect, x), point


def _inside(start: Start, bounds: Variant) -> Start:
    """A start moved inside bounds that an effect has narrowed."""
    low, high = bounds.lower, bounds.upper
    margin = np.minimum(MARGIN, 0.25 * (high - low))
    return Start(
        np.clip(start.free, low + margin, high - margin),
        start.multipliers,
        start.lower,
        start.upper,
    )
