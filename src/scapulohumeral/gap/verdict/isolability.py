"""What these trials can and cannot tell apart, and which further trial would."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.stats import norm

from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.labels import JOIN, MOVED
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import NextTrial
from scapulohumeral.gap.verdict.posterior import Posterior, Score
from scapulohumeral.gap.weighing import Weighing

# Two causes of one class are told apart less surely than this.
APART = 0.95
# Candidates below this probability are not compared with each other, nor more than so many.
NEGLIGIBLE = 0.01
COMPARED = 10
# Trials have told a cause from the first whose weighed log evidence is so far behind.
FAR_BEHIND = 12.0
# Changes whose whitened length is less are smaller than the noise.
NOISE = 1.0
# A further trial is worth its time from this probability of telling two causes apart on.
WORTHWHILE = 0.7


def distance(fitted: Fit, other: Hypothesis, residual: Residual, relative_error: float) -> float:
    """How far another hypothesis stays from what a fit predicts, in units of the noise."""
    target = residual.of(fitted.predicted)
    closest = fit(other, target, 0.0)
    remaining = residual.axes.whiten(fitted.predicted - closest.predicted)
    error = fitted.hypothesis.error(fitted.x, residual, relative_error)
    return float(np.sqrt(remaining @ error.solve(remaining)))


def likely(fits: Sequence[Fit], found: Posterior) -> list[Fit]:
    """Fits that are not negligible, the most probable first, at most `COMPARED`."""
    kept = [f for f in fits if found.labels[f.label] >= NEGLIGIBLE]
    return sorted(kept, key=lambda f: -found.labels[f.label])[:COMPARED]


def explaining(
    fits: Sequence[Fit],
    first: str,
    scores: Mapping[str, Score],
    weighing: Weighing,
    residual: Residual,
) -> list[Fit]:
    """Fits that classes are made of: those that explain something, as the first does.

    A change smaller than the noise is part of what any cause predicts, which tells nothing. A cause
    far behind the first in evidence is only as probable as it was before any data. Another movement
    has a share of probability of its own, whatever the evidence, and stays.

    Parameters
    ----------
    fits : likely ones; first : label of the most probable, which may be none of them
    scores, weighing : of evidence
    residual : what was explained
    """

    def explains(fitted: Fit) -> bool:
        change = np.linalg.norm(residual.whiten(fitted.predicted))
        behind = _evidence(scores[first], weighing) - _evidence(scores[fitted.label], weighing)
        return bool(behind < FAR_BEHIND and change > NOISE)

    return [f for f in fits if f.label == MOVED or explains(f)]


def _evidence(score: Score, weighing: Weighing) -> float:
    """Weighed log evidence of an answer."""
    return score.log_weight(weighing) - score.log_prior


def classes(
    fits: Sequence[Fit], apart: np.ndarray, together: Collection[str] = ()
) -> list[list[str]]:
    """Labels that these trials cannot tell apart, by complete linkage in the order of the fits.

    `apart` is made by :func:`separability`; labels `together` are in the first class in any case.
    """
    first = [i for i, f in enumerate(fits) if f.label in together]
    groups = [first] if first else []
    for i in (i for i in range(len(fits)) if i not in first):
        home = next((g for g in groups if all(apart[i, k] < APART for k in g)), None)
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    return [[fits[i].label for i in group] for group in groups]


def separability(
    fits: Sequence[Fit],
    residual: Residual,
    relative_error: float,
    temperature: float,
    together: Collection[str] = (),
) -> np.ndarray:
    """Probability that these trials tell two fitted hypotheses apart, symmetric.

    Phi(d / 2) with d the distance, in units of noise and signature error, that the better of both
    refits leaves: two normal distributions at this distance are told apart as often. It is tempered
    like probabilities and intervals: evidence for one of both counts less than it claims. Labels
    `together` are the same whatever trials show.
    """
    count = len(fits)
    result = np.full((count, count), 0.5)
    for i in range(count):
        for k in range(i):
            if {fits[i].label, fits[k].label} <= set(together):
                continue
            d = min(
                distance(fits[i], fits[k].hypothesis, residual, relative_error),
                distance(fits[k], fits[i].hypothesis, residual, relative_error),
            )
            result[i, k] = result[k, i] = float(norm.cdf(0.5 * d / np.sqrt(temperature)))
    return result


def next_trial(
    fits: Sequence[Fit],
    group: Sequence[str],
    residual: Residual,
    relative_error: float,
    temperature: float,
) -> NextTrial | None:
    """Recorded task whose repetition would best tell the first two effects of a class apart.

    Parameters
    ----------
    fits : the most probable first; group : labels of the class of the first
    residual : what was explained; relative_error : of predicted changes
    temperature : by which evidence was divided on the whole

    Returns
    -------
    NextTrial | None     with as many further test and reference trials of the task, which halve its
                         noise but not what sessions change; None if the first stands alone, or no
                         task would tell it from the next one. A pair that holds the first is no
                         other cause: it differs by what else there may be
    """

    def parts(fitted: Fit) -> set[str]:
        return set(fitted.label.split(JOIN))

    own = [f for f in fits if f.label in group]
    mates = [f for f in own[1:] if not parts(own[0]) <= parts(f)]
    pair = [*own[:1], *mates[:1]]
    if len(pair) < 2:
        return None

    def apart(task: str) -> float:
        rows = np.ix_(residual.rows([task]), residual.rows([task]))
        noise, covariance = residual.noise.copy(), residual.covariance.copy()
        noise[rows] *= 0.5
        covariance[rows] -= noise[rows]
        more = replace(residual, noise=noise, covariance=covariance)
        return float(separability(pair, more, relative_error, temperature)[0, 1])

    found = {task: apart(task) for task in residual.tasks}
    best = max(found, key=lambda task: found[task])
    if found[best] < WORTHWHILE:
        return None
    return NextTrial(best, tuple(f.label for f in pair), found[best])
