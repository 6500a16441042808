"""Movements solved again with an effect, because large effects are not linear.

Letters: N nodes, K channels, P parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.nominal.optimal_movement import Movement, movement, with_state
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import Recorder, difference
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.linearise import Linearised, record_derivative
from scapulohumeral.gap.signatures.of_tasks import Response
from scapulohumeral.ocp.sensitivity import Variant
from scapulohumeral.ocp.solver import Start

MARGIN = 1e-4


def kept_movement(
    model: ParticipantModel, response: Response, firmness: float, settings: GapSettings
) -> Movement:
    """The movement of a response, kept with a firmness, ready to be solved with effects."""
    move = movement(model, response.anchor, settings).driven(response.drive)
    return with_state(move, response.point).kept(response.point, firmness)


def recorded_change(
    effect: Effect, x: np.ndarray, response: Response
) -> tuple[np.ndarray, np.ndarray]:
    """Change (N, K) of the record by an effect on it, and its derivative (P, N, K)."""
    changed = effect.observe(response.anchor, effect.physical(x))
    return difference(changed, response.anchor), record_derivative(effect, x, response.anchor)


@dataclass(frozen=True, eq=False)
class Resolve:
    """A movement to be solved with effects on the body.

    Attributes
    ----------
    move : movement; response : its nominal solution
    recorder : what is recorded; iterations : after which a solve counts as failed
    """

    move: Movement
    response: Response
    recorder: Recorder
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
        point = self.move.solved(body, _inside(start, self.move.variant(body)), self.iterations)
        duration = self.response.anchor.duration_s
        local = Linearised(self.move, body, point, duration, self.recorder)
        return difference(local.observed, self.response.nominal), local.by_effect(effect, x), point


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
