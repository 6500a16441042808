"""Large effects are not linear: their parameters are fitted by solving the movements again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.attribute import Fit, Hypothesis, fit
from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.forward import Movement, movement, with_state
from scapulohumeral.gap.observe import difference
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures import Linearised, Recorder, Response, record_derivative
from scapulohumeral.ocp.sensitivity import Variant
from scapulohumeral.ocp.solver import Start

# Steps of Gauss-Newton in units of the prior spread: the next linearisation decides again.
LARGEST_STEP = 1.5
MARGIN = 1e-4
# Iterations of a warm solve of a tracked movement: in 60 blind cases 540 of 549 needed fewer, and
# six never arrived, in one and a half to three minutes each. A predicted one needed 61.
WARM_ITERATIONS = 60


def refit(
    first: Fit,
    comparison: Comparison,
    responses: Sequence[Response],
    model: ParticipantModel,
    recorder: Recorder,
    settings: GapSettings,
) -> Fit:
    """Gauss-Newton on the parameters of one effect, every step with new solutions of all tasks.

    Parameters
    ----------
    first : fit to derivatives at the nominal solution
    comparison, responses : what is explained, and the nominal solutions
    model, recorder, settings : as for `signatures.respond`

    Raises
    ------
    SolveError                       a movement with the effect cannot be solved
    """
    [effect] = first.hypothesis.effects
    current, moves, firmness = first, [], first.hypothesis.firmness
    if effect.changes_body:
        moves = [kept_movement(model, response, firmness, settings) for response in responses]
    starts = [response.point for response in responses]
    iterations = settings.iterations
    if settings.view == "tracking":
        iterations = min(WARM_ITERATIONS, iterations)
    for _ in range(settings.refits):
        x = _limited(current)
        values, slopes = [], []
        for i, response in enumerate(responses):
            if effect.changes_body:
                problem = Resolve(moves[i], response, recorder, iterations)
                value, slope, starts[i] = problem.solved(effect, x, starts[i])
            else:
                value, slope = recorded_change(effect, x, response)
            values.append(value)
            slopes.append(slope)
        hypothesis = Hypothesis(
            (effect,),
            x,
            comparison.compress(values)[:, None],
            comparison.compress(slopes),
            firmness,
        )
        current = fit(hypothesis, comparison, settings.signature_error)
    return current


def kept_movement(
    model: ParticipantModel, response: Response, firmness: float, settings: GapSettings
) -> Movement:
    """The movement of a response, kept with a firmness, ready to be solved with effects."""
    move = movement(model, response.anchor, settings).driven(response.drive)
    return with_state(move, response.point).kept(response.point, firmness)


def _limited(current: Fit) -> np.ndarray:
    """The fitted parameters, no further than a trusted step from the linearisation."""
    hypothesis = current.hypothesis
    reach = LARGEST_STEP * hypothesis.prior_sd
    x = hypothesis.at + np.clip(current.x - hypothesis.at, -reach, reach)
    low, high = hypothesis.bounds
    return np.clip(x, low, high)


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
