"""How far the gap shrinks once an effect is added, on trials and movements that were not fitted.

An effect is added with its parameters and with how much of it this person shows in each channel,
both found in the other trials.

The share is (G0 - G1) / (G0 - F) with G the root mean square of what is left, in units of what two
recordings of one person differ by without a cause, and F = 1.

Letters: D coefficients, P parameters, T tasks, L test trials.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from scapulohumeral.gap.curve_files import ControlsRow, LeftOutRow
from scapulohumeral.gap.isolation.channel_gains import (
    channel_factors,
    expected_left,
    predicted_change,
)
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import no_gap_evidence
from scapulohumeral.gap.isolation.model_error import SignatureError, change_error
from scapulohumeral.gap.isolation.movement import expected_movement_left, predicted_movement
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    channel_kind,
    channel_unit,
)
from scapulohumeral.gap.residual.differences import Fold
from scapulohumeral.gap.residual.noise import normal_draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import UnknownInputs, most_probable_gain
from scapulohumeral.gap.result import GroupShrinkage, Share, Shrinkage

# Fewer parts give no interval, nor do fewer trials on a side: each is then left out again and
# again, beside other trials of the other side.
FEWEST_FOR_INTERVAL = 4
RESAMPLES = 500
# A gap this close to the floor leaves nothing to reduce.
REDUCIBLE = 0.05
PLACEBOS = 3
# Errors of predictions may be as assumed or smaller: by how much of their variance.
ERROR_PORTIONS = (0.0, 0.03, 0.1, 0.3, 1.0)


@dataclass(frozen=True, eq=False)
class Explained:
    """How far the gap shrinks by the best cause, and by controls without any.

    Attributes
    ----------
    shrinkage : by the cause, as answered
    left_out : each task before and after the cause as the other tasks have it
    controls : shares that disappear without a cause
    """

    shrinkage: Shrinkage
    left_out: list[LeftOutRow]
    controls: list[ControlsRow]

    @property
    def of_tasks(self) -> float | None:
        """Share of the gap that the cause removed of the tasks left out; None without any."""
        return removed_of_tasks([(row.before, row.after) for row in self.left_out])


def removed_of_tasks(left_out: Sequence[tuple[float, float]]) -> float | None:
    """Share of the reducible gap that was removed, as observed; None if there is nothing to reduce.

    Parameters
    ----------
    left_out : root mean squares of each task before and after, in units of the floor
    """
    return _ratio(np.array(left_out)) if len(left_out) else None


def explain(chosen: Fit, evidence: Evidence, misfit: float, seed: int) -> Explained:
    """How far the gap shrinks by a fit.

    Parameters
    ----------
    chosen : the fit; evidence : difference, trials, and errors that are assumed
    misfit : how many times the assumed variance the likeliest explanation leaves, one or more
    seed : of bootstraps and placebos
    """
    error = evidence.settings.signature_error
    c, parts = evidence.without_cause, evidence.folds
    sides = evidence.records.sides.values()
    trials = {
        task: min(len(side[task]) for side in sides if side) for task in evidence.records.test
    }
    predictor = _predictor(chosen, evidence)
    removed, left_out = shrinkage(predictor, c, parts, trials, misfit, seed)
    return Explained(removed, left_out, controls(c, parts, evidence.unknown_inputs, error, seed))


class Predictor(NamedTuple):
    """How a cause is fitted to some differences and predicts the others.

    `change`: of all tasks (D,), from training differences; `left`: covariance of what that leaves
    of tasks not trained on.
    """

    change: Callable[[Residual], np.ndarray]
    left: Callable[[Residual], np.ndarray]


def _predictor(chosen: Fit, evidence: Evidence) -> Predictor:
    """Of an effect, or of another movement; fitted under the supposition that suits it best."""
    same, supposed = evidence.residual, evidence.residuals[chosen.moved_deg]
    if chosen.label == MOVED:
        return Predictor(
            lambda training: predicted_movement(same, supposed, training),
            lambda training: expected_movement_left(same, supposed, training),
        )
    error, hypothesis = evidence.settings.signature_error, chosen.hypothesis

    def under(training: Residual) -> Residual:
        return supposed.part(training.tasks).of(training.delta)

    return Predictor(
        lambda training: predicted_change(hypothesis, under(training), supposed, error),
        lambda training: expected_left(hypothesis, under(training), supposed, error),
    )


def shrinkage(
    predictor: Predictor,
    residual: Residual,
    folds: Sequence[Fold],
    trials: Mapping[str, int],
    misfit: float,
    seed: int,
) -> tuple[Shrinkage, list[LeftOutRow]]:
    """Shares of the reducible gap that an effect removes, from least to most demanding.

    Intervals are those of the mean over trials or tasks. On a new task, share and interval are
    those that one more task is expected to show.

    Parameters
    ----------
    predictor : of the effect
    residual : mean differences of all tasks, if the movement was the same
    folds : trials that are left out; trials : number of each task, of the side with fewer
    misfit, seed : as for :func:`explain`

    Returns
    -------
    shrinkage : shares, and the same in units
    left_out : each task before and after the effect as the other tasks have it
    """
    change = predictor.change
    fitted = change(residual)
    splits: dict[str, list[tuple[Residual, np.ndarray]]] = {"in_sample": [], "new_task": []}
    left = []
    for task in residual.tasks:
        part, rows = residual.part([task]), residual.rows([task])
        splits["in_sample"].append((part, fitted[rows]))
        others = [other for other in residual.tasks if other != task]
        if others:
            training = residual.part(others)
            splits["new_task"].append((part, change(training)[rows]))
            left.append(predictor.left(training))
    splits["held_out_trial"] = _held_out(change, residual, folds)
    counts = dict.fromkeys(splits, sum(trials.values()))
    counts["held_out_trial"] = sum(trials[task] for task in {fold.task for fold in folds})
    shares = {name: _share(parts, counts[name], seed) for name, parts in splits.items()}
    left_out = [LeftOutRow(part.tasks[0], *remaining(part, p)) for part, p in splits["new_task"]]
    if shares["new_task"] is not None:
        shares["new_task"] = _expected(shares["new_task"], splits["new_task"], left, misfit, seed)
    groups = [
        group
        for name, parts in splits.items()
        if shares[name] is not None
        for group in _groups(name, parts)
    ]
    removed = Shrinkage(
        shares["in_sample"], shares["held_out_trial"], shares["new_task"], tuple(groups)
    )
    return removed, left_out


def controls(
    residual: Residual,
    folds: Sequence[Fold],
    unknown_inputs: UnknownInputs,
    relative_error: float,
    seed: int,
) -> list[ControlsRow]:
    """Shares that disappear on held-out trials without any cause.

    Smooth disturbances of every degree of freedom and channel follow any gap; a smooth random
    generalised force, the same in all tasks, of one unknown size and with factors of a person like
    an effect, should follow none.

    Returns
    -------
    shares : of the black box and of each placebo, if there are trials to hold out
    """
    rng = np.random.default_rng(seed)
    # These come first: one of each degree of freedom, or of each joint rotation's record.
    forces = len(KINEMATIC_CHANNELS) * unknown_inputs.shapes[0].shape[1]
    by_task = np.split(unknown_inputs.columns, len(residual.tasks), axis=1)
    placebos = [
        sum(columns[:, :forces] for columns in by_task) @ rng.normal(size=forces)
        for _ in range(PLACEBOS)
    ]
    found = {
        "black box": _held_out(partial(_smooth, columns=unknown_inputs.columns), residual, folds)
    }
    for i, change in enumerate(placebos):
        predict = partial(_scaled, change=change, relative_error=relative_error)
        found[f"placebo {i + 1}"] = _held_out(predict, residual, folds)
    shares = {name: _share(parts, len(parts), seed) for name, parts in found.items()}
    return [
        ControlsRow(name=name, shrinkage=share.value)
        for name, share in shares.items()
        if share is not None
    ]


def _smooth(training: Residual, columns: np.ndarray) -> np.ndarray:
    """Most probable change (D,) by smooth disturbances (D, S)."""
    return columns @ most_probable_gain(training, columns) @ training.whiten(training.delta)


def _scaled(training: Residual, change: np.ndarray, relative_error: float) -> np.ndarray:
    """A change (D,), as large as fits best, with the factors of a person."""
    white = training.whiten(change)
    change = float(white @ training.whiten(training.delta)) / float(white @ white) * change
    error = SignatureError([change_error(training, change, relative_error, controlled=True)])
    left = training.delta - change
    factors = channel_factors(change, left, error, training, relative_error)
    return training.scaled(change, factors)


def _held_out(
    predict: Callable[[Residual], np.ndarray], residual: Residual, folds: Sequence[Fold]
) -> list[tuple[Residual, np.ndarray]]:
    """What is left out of each fold, with the change (D,) that is predicted from the rest."""
    parts = []
    for fold in folds:
        rows, delta = residual.rows([fold.task]), residual.delta.copy()
        delta[rows] = fold.rest
        parts.append((fold.left_out, predict(residual.of(delta))[rows]))
    return parts


def reducible_share(before: float, after: float) -> float | None:
    """Share of the gap above the floor that is removed; None if there is nothing to reduce.

    Parameters
    ----------
    before, after : root mean squares of what is recorded, in units of the floor
    """
    if before < 1.0 + REDUCIBLE:
        return None
    return (before - max(after, 1.0)) / (before - 1.0)


def remaining(part: Residual, predicted: np.ndarray) -> tuple[float, float]:
    """Root mean square before and after, over what differs without a cause."""
    before, after = _root_mean_squares(part, np.array([part.delta, part.delta - predicted]))
    return float(before), float(after)


def _root_mean_squares(part: Residual, differences: np.ndarray) -> np.ndarray:
    """Of differences (M, D), over what differs without a cause, (M,)."""
    return np.sqrt(np.mean((differences / np.sqrt(np.diag(part.covariance))) ** 2, axis=1))


def _share(parts: Sequence[tuple[Residual, np.ndarray]], trials: int, seed: int) -> Share | None:
    """Share over all parts with a bootstrap interval; None if there is nothing to reduce.

    `trials` is how many trials are behind all parts.
    """
    if not parts:
        return None
    pairs = np.array([remaining(part, predicted) for part, predicted in parts])
    value = _ratio(pairs)
    if value is None:
        return None
    if min(len(pairs), trials) < FEWEST_FOR_INTERVAL:
        return Share(value, None, trials)
    rng = np.random.default_rng(seed)
    picks = rng.integers(len(pairs), size=(RESAMPLES, len(pairs)))
    values = [ratio for pick in picks if (ratio := _ratio(pairs[pick])) is not None]
    low, high = np.quantile(values, [0.025, 0.975]) if values else (value, value)
    return Share(value, (float(low), float(high)), trials)


def _expected(
    share: Share,
    parts: Sequence[tuple[Residual, np.ndarray]],
    left: Sequence[np.ndarray],
    misfit: float,
    seed: int,
) -> Share:
    """The share that one more task is expected to show, with an interval that holds the observed.

    What the tasks left out show themselves says too much: where what is left of them happens to be
    less than what two recordings are taken to differ by, all of the gap counts as removed. And few
    tasks say little of how different tasks can be. The errors that predictions are assumed to have
    say more of both; the tasks left out say whether they are as large, smaller, or as much larger
    as the likeliest explanation misses the difference.

    Parameters
    ----------
    share : observed
    parts : each task with its predicted change (D,)
    left : covariance (D, D) of what is expected to remain of each
    misfit, seed : as for :func:`explain`
    """
    rng = np.random.default_rng(seed)
    drawn, log_density = [], []
    sizes = [
        _may_remain(part.covariance, covariance, misfit)
        for (part, _), covariance in zip(parts, left, strict=True)
    ]
    for remains in zip(*sizes, strict=True):
        drawn.append(_shares_of_more(parts, remains, rng))
        log_density.append(
            sum(
                no_gap_evidence(replace(part, delta=part.delta - predicted, covariance=covariance))
                for (part, predicted), covariance in zip(parts, remains, strict=True)
            )
        )
    if not any(drawn):
        return share
    probable = np.exp(np.array(log_density) - max(log_density))
    weights = [w / len(shares) for shares, w in zip(drawn, probable, strict=True) for _ in shares]
    low, median, high = np.quantile(
        np.concatenate(drawn), [0.025, 0.5, 0.975], weights=weights, method="inverted_cdf"
    )
    ends = min(float(low), share.value), max(float(high), share.value)
    return Share(float(median), ends, share.n_trials)


def _may_remain(without: np.ndarray, left: np.ndarray, misfit: float) -> list[np.ndarray]:
    """Covariances (D, D) of what may remain of a task, by the size of errors of predictions.

    Parameters
    ----------
    without : if there are none; left : if they are as assumed
    misfit : as for :func:`explain`; it counts for all that is left
    """
    smaller = [without + portion * (left - without) for portion in ERROR_PORTIONS]
    return [*smaller, *(factor * left for factor in (np.sqrt(misfit), misfit) if factor > 1.0)]


def _shares_of_more(
    parts: Sequence[tuple[Residual, np.ndarray]],
    remains: Sequence[np.ndarray],
    rng: np.random.Generator,
) -> list[float]:
    """Shares that further tasks like these would show, of which so much remains as covariance."""
    shares = []
    for (part, predicted), covariance in zip(parts, remains, strict=True):
        rest = normal_draws(covariance, RESAMPLES, rng)
        before, after = (_root_mean_squares(part, each) for each in (predicted + rest, rest))
        ratios = map(reducible_share, before, after)
        shares += [ratio for ratio in ratios if ratio is not None]
    return shares


def _ratio(pairs: np.ndarray) -> float | None:
    before, after = np.sqrt(np.mean(pairs**2, axis=0))
    return reducible_share(float(before), float(after))


def _groups(split: str, parts: Sequence[tuple[Residual, np.ndarray]]) -> list[GroupShrinkage]:
    """Root mean squares in units of each kind of channel."""
    channels = parts[0][0].channels
    kinds = np.array([channel_kind(name) for name in channels])
    groups = []
    for kind in dict.fromkeys(kinds.tolist()):
        chosen = np.flatnonzero(kinds == kind)
        before, after, floor = (
            float(np.sqrt(np.mean([np.mean(curve[..., chosen] ** 2) for curve in curves])))
            for curves in (
                [part.curves(part.delta) for part, _ in parts],
                [part.curves(part.delta - predicted) for part, predicted in parts],
                [part.spread for part, _ in parts],
            )
        )
        unit = channel_unit(channels[int(chosen[0])])
        groups.append(GroupShrinkage(kind, split, before, after, floor, unit))
    return groups
