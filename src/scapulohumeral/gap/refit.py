"""Large effects are not linear: their parameters are fitted by solving the movements again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scapulohumeral.gap.attribute import Fit, Hypothesis, fit
from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.forward import movement, with_tendon_load
from scapulohumeral.gap.observe import difference
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures import Linearised, Recorder, Response, record_derivative
from scapulohumeral.ocp.solver import Start

# Steps of Gauss-Newton in units of the prior spread: the next linearisation decides again.
LARGEST_STEP = 1.5
MARGIN = 1e-4


def refit(
    first: Fit,
    comparison: Comparison,
    responses: Sequence[Response],
    gains: np.ndarray,
    model: ParticipantModel,
    recorder: Recorder,
    settings: GapSettings,
) -> Fit:
    """Gauss-Newton on the parameters of one effect, every step with new solutions of all tasks.

    Parameters
    ----------
    first : fit to derivatives at the nominal solution
    comparison, responses : what is explained, and the nominal solutions
    gains : (K,) factors on predicted changes
    model, recorder, settings : as for `signatures.respond`

    Raises
    ------
    SolveError                       a movement with the effect cannot be solved
    """
    [effect] = first.hypothesis.effects
    current, starts = first, [response.point for response in responses]
    for _ in range(settings.refits):
        x = _limited(current)
        values, slopes = [], []
        for i, response in enumerate(responses):
            value, slope, starts[i] = resolve(
                effect, x, response, starts[i], model, recorder, settings
            )
            values.append(gains * value)
            slopes.append(gains * slope)
        hypothesis = Hypothesis(
            (effect,), x, comparison.compress(values), comparison.compress(slopes)
        )
        current = fit(hypothesis, comparison, settings.signature_error)
    return current


def _limited(current: Fit) -> np.ndarray:
    """The fitted parameters, no further than a trusted step from the linearisation."""
    hypothesis = current.hypothesis
    reach = LARGEST_STEP * hypothesis.prior_sd
    x = hypothesis.at + np.clip(current.x - hypothesis.at, -reach, reach)
    low, high = hypothesis.bounds
    return np.clip(x, low, high)


def resolve(
    effect: Effect,
    x: np.ndarray,
    response: Response,
    start: Start,
    model: ParticipantModel,
    recorder: Recorder,
    settings: GapSettings,
) -> tuple[np.ndarray, np.ndarray, Start]:
    """Change (N, K) by an effect at internal parameters (P,), its derivative (P, N, K), solution.

    Raises
    ------
    SolveError                       the movement with the effect cannot be solved
    """
    if not effect.changes_body:
        changed = effect.observe(response.anchor, effect.physical(x))
        value = difference(changed, response.anchor)
        return value, record_derivative(effect, x, response.anchor), start
    nominal = movement(model, response.anchor, settings)
    move = with_tendon_load(nominal, response.point)
    body = effect.apply(move.body, effect.physical(x))
    point = move.solved(body, _inside(start, move.problem(body)), settings.iterations)
    local = Linearised(move, body, point, response.anchor.duration_s, recorder)
    return difference(local.observed, response.nominal), local.by_effect(effect, x), point


def _inside(start: Start, problem) -> Start:
    """A start moved inside bounds that an effect has narrowed."""
    low, high = problem.lower_bound, problem.upper_bound
    margin = np.minimum(MARGIN, 0.25 * (high - low))
    return Start(
        np.clip(start.free, low + margin, high - margin),
        start.multipliers,
        start.lower,
        start.upper,
    )
