"""Movements solved again with an effect, because large effects are not linear.

Letters: N nodes, K channels, P parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.gap.nominal.optimal_movement import Movement, movement, with_state
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import SensorSetup, difference
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.linearise import Linearised, record_derivative
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures
from scapulohumeral.ocp.optimality.sensitivity import ProblemParts, Sensitivity
from scapulohumeral.ocp.solving.solver import Start

MARGIN = 1e-4
# Exact iterations of a solve of a tracked movement from one without the effect: after Gauss-Newton
# 24 solves of a case with EMG, on two meshes, needed 1 to 6. One that needs many more is not on its
# way; a predicted one needed 61 without Gauss-Newton.
WARM_ITERATIONS = 60


def recorded_change(
    effect: Effect, x: np.ndarray, of_task: TaskSignatures
) -> tuple[np.ndarray, np.ndarray]:
    """Change (N, K) of the record by an effect on it, and its derivative (P, N, K)."""
    changed = effect.observe(of_task.mean_record, effect.physical(x))
    return difference(changed, of_task.mean_record), record_derivative(
        effect, x, of_task.mean_record
    )


class Near(NamedTuple):
    """A solution from which others are predicted.

    Attributes
    ----------
    x : internal parameters (P,) of the effect there
    point : solution; response : its derivatives by them
    """

    x: np.ndarray
    point: Start
    response: Sensitivity

    def predicted(self, x: np.ndarray) -> Start:
        """The solution that derivatives predict at other parameters (P,)."""
        step = x - self.x
        return Start(
            self.point.free + self.response.free @ step,
            self.point.multipliers + self.response.multipliers @ step,
            self.point.lower,
            self.point.upper,
        )


class Solved(NamedTuple):
    """A movement solved with an effect.

    Attributes
    ----------
    change : (N, K) of the record; slope : (P, N, K) per unit of a parameter
    near : the solution, to predict others from
    """

    change: np.ndarray
    slope: np.ndarray
    near: Near


@dataclass(frozen=True, eq=False)
class Resolve:
    """A movement to be solved with effects on the body.

    Attributes
    ----------
    move : movement; of_task : its nominal solution, and what effects change of it
    sensors : what is recorded; iterations : after which a solve counts as failed
    predicts : whether solutions are looked for where derivatives predict them
    """

    move: Movement
    of_task: TaskSignatures
    sensors: SensorSetup
    iterations: int
    predicts: bool = False

    @classmethod
    def kept(
        cls,
        model: ParticipantModel,
        of_task: TaskSignatures,
        stiffness: float,
        sensors: SensorSetup,
        settings: GapSettings,
    ) -> Resolve:
        """The nominal movement of a task, kept with a stiffness."""
        move = movement(model, of_task.mean_record, settings).driven(of_task.drive)
        kept = with_state(move, of_task.point).kept(of_task.point, stiffness)
        # Tracked with EMG, 34 of 90 predictions led nowhere, and all took longer than without.
        predicts, most = settings.view == "prediction", settings.iterations
        if not predicts:
            most = min(WARM_ITERATIONS, most)
        return cls(kept, of_task, sensors, most, predicts)

    def solved(self, effect: Effect, x: np.ndarray, before: Near | None = None) -> Solved:
        """The movement with an effect of internal parameters (P,).

        `before`: its solution with others, to begin from; else the nominal one.

        Raises
        ------
        SolveError                       the movement with the effect cannot be solved
        """
        body = effect.apply(self.move.body, effect.physical(x))
        bounds = self.move.parts(body)
        start, predicted = self.of_task.point if before is None else before.point, None
        if self.predicts:
            near = self._without(effect) if before is None else before
            predicted = _inside(near.predicted(x), bounds)
        point = self.move.solved_again(body, _inside(start, bounds), self.iterations, predicted)
        local = self._linearised(body, point)
        response = local.response(effect, x)
        return Solved(
            change=difference(local.observed, self.of_task.nominal),
            slope=local.by_effect(effect, x, response),
            near=Near(x, point, response),
        )

    def _without(self, effect: Effect) -> Near:
        nothing = np.zeros(len(effect.params))
        return Near(nothing, self._nominal.point, self._nominal.response(effect, nothing))

    @cached_property
    def _nominal(self) -> Linearised:
        return self._linearised(self.move.body, self.of_task.point)

    def _linearised(self, body: Body, point: Start) -> Linearised:
        return Linearised(self.move, body, point, self.of_task.mean_record.duration_s, self.sensors)


class Resolving:
    """All tasks of a case, ready to be solved with effects; set up once for each stiffness.

    Parameters
    ----------
    model, sensors, settings : as for `of_tasks.task_signatures`
    signatures : the nominal solutions
    """

    def __init__(
        self,
        model: ParticipantModel,
        signatures: Sequence[TaskSignatures],
        sensors: SensorSetup,
        settings: GapSettings,
    ) -> None:
        self.signatures = tuple(signatures)
        self.settings = settings
        self._known = model, sensors
        self._kept: dict[float, tuple[Resolve, ...]] = {}

    def kept(self, stiffness: float) -> tuple[Resolve, ...]:
        """The tasks of a person who keeps the movements with a stiffness."""
        if stiffness not in self._kept:
            model, sensors = self._known
            self._kept[stiffness] = tuple(
                Resolve.kept(model, of_task, stiffness, sensors, self.settings)
                for of_task in self.signatures
            )
        return self._kept[stiffness]


def _inside(start: Start, bounds: ProblemParts) -> Start:
    """A start moved inside bounds that an effect has narrowed."""
    low, high = bounds.lower, bounds.upper
    margin = np.minimum(MARGIN, 0.25 * (high - low))
    return Start(
        np.clip(start.free, low + margin, high - margin),
        start.multipliers,
        start.lower,
        start.upper,
    )
