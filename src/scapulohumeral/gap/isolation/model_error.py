"""The error of a predicted change, in units of the signature error.

A person may share out a load among muscles and joints in another way than the model's least effort.
Each channel then changes more or less than predicted, much alike in all tasks. Angles or EMG may
change about as much, but elsewhere and at other phases.

Letters: D coefficients, K channels, T tasks, E errors.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.residual.axes import SHAPE_ERROR, partly_alike
from scapulohumeral.gap.residual.residual import Residual

# Share of the signature error that is spread over all channels, for effects on the record.
SPREAD_SHARE = 0.3


# Errors of what muscles change, in units of the signature error. In simulated persons with another
# control, channels of EMG that changed much had the shape that the model predicts (cosine 0.94 to
# 0.99) and sizes off by 0.6 to 2, alike in all tasks; angles had hardly its shape (0 to 0.5).
# Factor on a channel, of a person in all tasks and of one task by itself:
COMMON_FACTOR, TASK_FACTOR = 1.7, 0.7


# Signature error of effects on the record, which no muscle has to act for, over that of others.
RECORD_SHARE = 0.5


class ChangeError(NamedTuple):
    """Covariance of the error of a predicted change, along the axes of a comparison.

    That of independent errors with a variance (D,), and the squares of rows (E, D).
    """

    variance: np.ndarray
    rows: np.ndarray


class SignatureError:
    """Whitened residuals (D,), normal with a covariance of one and errors of predictions.

    What a few rows add is solved for in their order (Woodbury).

    Parameters
    ----------
    errors : of predicted changes, independent of each other
    """

    def __init__(self, errors: Sequence[ChangeError]) -> None:
        variance = sum((one.variance for one in errors), start=np.ones(1))
        rows = np.concatenate([one.rows for one in errors])
        self._weight = 1.0 / variance
        self._weighted = rows * self._weight
        inner = self._weighted @ rows.T
        inner[np.diag_indices_from(inner)] += 1.0
        # As cho_factor does, whose checks take longer than the factors of so few rows.
        self._factor, _ = dpotrf(inner.T, lower=True, overwrite_a=True)
        self.logdet = float(np.log(variance).sum() + 2.0 * np.log(np.diag(self._factor)).sum())

    def solve(self, vectors: np.ndarray) -> np.ndarray:
        """Inverse of the covariance times vectors (D,) or (D, P)."""
        known, _ = dpotrs(self._factor, self._weighted @ vectors, lower=True)
        return (self._weight * vectors.T).T - self._weighted.T @ known

    def squares(self, white: np.ndarray) -> float:
        """Sum of squares of a whitened residual (D,) in units of the covariance."""
        return float(white @ self.solve(white))

    def log_density(self, squares: float, count: int) -> float:
        """Log density of a whitened residual with a sum of squares in units of the covariance."""
        return -0.5 * (squares + self.logdet + count * np.log(2.0 * np.pi))


def own_error(effect: Effect, relative: float) -> float:
    """Relative error of an effect's change, of the signature error.

    What acts on the record itself is known better than what a person's control makes of it.
    """
    return relative if effect.changes_body else RECORD_SHARE * relative


def change_error(
    residual: Residual, change: np.ndarray, relative: float, controlled: bool
) -> ChangeError:
    """Error of a predicted change.

    Parameters
    ----------
    residual : what is explained
    change : (D,) predicted
    relative : error of each channel's change, relative
    controlled : whether muscles make the change, so that its shape depends on a person's control
    """
    axes = residual.axes
    rows = relative * axes.channels(change)
    if not controlled:
        whole = rows.sum(axis=0)
        spread = SPREAD_SHARE**2 * float(whole @ whole) / len(whole)
        return ChangeError(np.full(len(whole), spread), rows)
    variance = np.zeros(len(change))
    every = [partly_alike(rows, axes.tasks, TASK_FACTOR, COMMON_FACTOR)]
    for kind in residual.kinds:
        size = SHAPE_ERROR[kind.name] * relative
        shown = change[kind.rows] / kind.deviations
        mean_square = size**2 * float(shown @ shown) / len(shown)
        if kind.name in axes.variances:
            variance += mean_square * axes.variances[kind.name]
        elif kind.name in axes.rows:
            every.append(np.sqrt(mean_square) * axes.rows[kind.name])
    return ChangeError(variance, np.concatenate(every))
