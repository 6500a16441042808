"""How much of an effect this person shows in each channel.

The model predicts in which channels an effect shows, and with which curve, better than how much:
that depends on how a person shares out a load. What the explained trials say of it holds for other
movements of the same person, too.

Letters: D coefficients, E effects of a hypothesis, K channels.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.gap.attribute import PERSON_FACTOR, Fit, Hypothesis, SignatureError, fit
from scapulohumeral.gap.floor import Comparison


def person_factors(fitted: Fit, comparison: Comparison, relative_error: float) -> np.ndarray:
    """Factors (E, K) on the change that each effect makes in each channel, the most probable ones.

    They are not negative, and one for effects on the record, which no muscle has to act for.

    Parameters
    ----------
    fitted : hypothesis, fitted to the comparison
    comparison : differences of one or more tasks
    relative_error : of predicted changes
    """
    hypothesis, x = fitted.hypothesis, fitted.x
    error = hypothesis.error(x, comparison, relative_error)
    changes = hypothesis.changes(x)
    left = comparison.delta - changes.sum(axis=1)
    factors = np.ones((len(hypothesis.effects), len(comparison.channels)))
    for i, effect in enumerate(hypothesis.effects):
        if effect.changes_body:
            factors[i] = channel_factors(changes[:, i], left, error, comparison, relative_error)
    return factors


def channel_factors(
    change: np.ndarray,
    left: np.ndarray,
    error: SignatureError,
    comparison: Comparison,
    relative_error: float,
) -> np.ndarray:
    """Most probable factors (K,) on a change (D,).

    Parameters
    ----------
    change : predicted; left : (D,) what it leaves of the difference
    error : of the prediction
    comparison : what is explained; relative_error : of predicted changes
    """
    columns = comparison.white_by_channel_of_all_tasks(change)
    sd = PERSON_FACTOR * relative_error
    return np.maximum(1.0 + sd**2 * columns.T @ error.solve(comparison.whiten(left)), 0.0)


def person_change(
    hypothesis: Hypothesis, training: Comparison, whole: Comparison, relative_error: float
) -> np.ndarray:
    """Change (D,) of all tasks, with parameters and factors from some of them."""
    rows = whole.rows(training.tasks)
    fitted = fit(hypothesis.part(rows), training, relative_error)
    factors = person_factors(fitted, training, relative_error)
    changes = hypothesis.changes(fitted.x).T
    return sum(
        (whole.scaled(change, own) for change, own in zip(changes, factors, strict=True)),
        start=np.zeros_like(whole.delta),
    )
