"""How large an effect is in this person, and how much of it shows in each channel.

The model predicts in which channels an effect shows, and with which curve, better than how much:
that depends on how a person shares out a load. What the explained trials say of it holds for other
movements of the same person, too.

Letters: D coefficients, E effects of a hypothesis, K channels.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.model_error import COMMON_FACTOR, SignatureError
from scapulohumeral.gap.residual.residual import Residual

# Where a parameter's variance is a smaller share than this of its prior variance, its estimate is
# freed of the prior, by a factor of 1.5 at most.
TAKEN_OUT = 1.0 / 3.0


def freed_of_prior(fitted: Fit) -> tuple[np.ndarray, np.ndarray]:
    """Internal parameters (P,) inside their bounds as the data alone have them, and variances (P,).

    The prior of a parameter, which decides how much evidence a cause has, pulls its estimate toward
    zero. It is taken out again wherever the data say at least twice as much as it does, and the
    order of parameters is kept.
    """
    hypothesis, variance = fitted.hypothesis, np.diag(fitted.covariance)
    prior = hypothesis.prior_sd**2
    stretch = prior / (prior - np.where(variance < TAKEN_OUT * prior, variance, 0.0))
    x, variance = np.clip(stretch * fitted.x, *hypothesis.bounds), stretch * variance
    for pair in map(list, hypothesis.order):
        if x[pair[0]] > x[pair[1]]:
            # Where two would change places, they are equal, as in the fit.
            x[pair] = np.average(x[pair], weights=1.0 / variance[pair])
    return x, variance


def gain_factors(fitted: Fit, residual: Residual, relative_error: float) -> np.ndarray:
    """Factors (E, K) on the change that each effect makes in each channel, the most probable ones.

    They belong to the parameters that are freed of their prior.

    They are not negative, and one for effects on the record, which no muscle has to act for.

    Parameters
    ----------
    fitted : hypothesis, fitted to the comparison
    residual : differences of one or more tasks
    relative_error : of predicted changes
    """
    hypothesis, (x, _) = fitted.hypothesis, freed_of_prior(fitted)
    error = hypothesis.error(x, residual, relative_error)
    changes = hypothesis.changes(x)
    left = residual.delta - changes.sum(axis=1)
    factors = np.ones((len(hypothesis.effects), len(residual.channels)))
    for i, effect in enumerate(hypothesis.effects):
        if effect.changes_body:
            factors[i] = channel_factors(changes[:, i], left, error, residual, relative_error)
    return factors


def channel_factors(
    change: np.ndarray,
    left: np.ndarray,
    error: SignatureError,
    residual: Residual,
    relative_error: float,
) -> np.ndarray:
    """Most probable factors (K,) on a change (D,).

    Parameters
    ----------
    change : predicted; left : (D,) what it leaves of the difference
    error : of the prediction
    residual : what is explained; relative_error : of predicted changes
    """
    parts = residual.axes.channels_of_all_tasks(change)
    sd = COMMON_FACTOR * relative_error
    return np.maximum(1.0 + sd**2 * parts @ error.solve(residual.axes.whiten(left)), 0.0)


def predicted_change(
    hypothesis: Hypothesis, training: Residual, whole: Residual, relative_error: float
) -> np.ndarray:
    """Change (D,) of all tasks, with parameters and factors from some of them."""
    rows = whole.rows(training.tasks)
    fitted = fit(hypothesis.part(rows), training, relative_error)
    factors = gain_factors(fitted, training, relative_error)
    x, _ = freed_of_prior(fitted)
    return _scaled(hypothesis.changes(x), factors, whole)


def person_change(fitted: Fit, residual: Residual, relative_error: float) -> np.ndarray:
    """Change (D,) that a fit says this person shows: with the factors of his channels.

    Parameters are as for :func:`gain_factors`.
    """
    x, _ = freed_of_prior(fitted)
    factors = gain_factors(fitted, residual, relative_error)
    return _scaled(fitted.hypothesis.changes(x), factors, residual)


def _scaled(changes: np.ndarray, factors: np.ndarray, residual: Residual) -> np.ndarray:
    """Sum (D,) of changes (D, E), whose channels are multiplied by factors (E, K)."""
    return sum(
        (residual.scaled(change, own) for change, own in zip(changes.T, factors, strict=True)),
        start=np.zeros_like(residual.delta),
    )


def expected_left(
    hypothesis: Hypothesis, training: Residual, whole: Residual, relative_error: float
) -> np.ndarray:
    """Covariance of what :func:`predicted_change` leaves of tasks not trained on, noise included.

    As far as errors of the prediction are alike in all tasks, the trained ones have told them.
    """
    trained = whole.rows(training.tasks)
    rest = np.setdiff1d(np.arange(len(whole.delta)), trained)
    fitted = fit(hypothesis.part(trained), training, relative_error)
    x, _ = freed_of_prior(fitted)
    white = whole.axes.whiten(np.eye(len(whole.delta))[:, rest])
    # The inverse of a block of a precision matrix is a covariance with all else known.
    precision = white.T @ hypothesis.error(x, whole, relative_error).solve(white)
    slope = hypothesis.slope[rest]
    return np.linalg.inv(precision) + slope @ fitted.covariance @ slope.T
