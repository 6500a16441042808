"""The error of a predicted change, in units of the signature error.

A person may share out a load among muscles and joints in another way than the model's least effort.
Each channel then changes more or less than predicted, much alike in all tasks. Angles or EMG may
change about as much, but elsewhere and at other phases.

Letters: D coefficients, K channels, T tasks, E errors, C changes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
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

    def draw(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Errors (D, count) along the axes of the comparison."""
        drawn = self.rows.T @ rng.normal(size=(len(self.rows), count))
        deviations = np.sqrt(self.variance)[:, None]
        return drawn + deviations * rng.normal(size=(len(self.variance), count))


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
        inner.ravel()[:: len(inner) + 1] += 1.0
        # As cho_factor does, whose checks take longer than the factors of so few rows.
        self._factor, _ = dpotrf(inner.T, lower=True, overwrite_a=True)
        self._variance = variance

    @cached_property
    def logdet(self) -> float:
        """Log determinant of the covariance, which least squares do not ask for."""
        diagonal = self._factor.diagonal()
        return float(np.log(self._variance).sum() + 2.0 * np.log(diagonal).sum())

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


@dataclass(frozen=True, eq=False)
class SumError:
    """Error of a predicted change that is a sum of C changes, whatever the weight of each.

    Least squares ask for it at every step, with other weights each time.

    Attributes
    ----------
    rows : (C, E, D) of each change: those of the sum are their weighted sums
    squares : (C, C) forms of the weights, of which each is a mean square
    variances : (D,) for a mean square of one; shapes : (R, D) rows likewise; by number of the form
    """

    rows: np.ndarray
    squares: list[np.ndarray]
    variances: dict[int, np.ndarray]
    shapes: dict[int, np.ndarray]

    def at(self, weights: np.ndarray) -> ChangeError:
        """The error with weights (C,)."""
        count, *shape = self.rows.shape
        rows = (weights @ self.rows.reshape(count, -1)).reshape(shape)
        sizes = [float(weights @ square @ weights) for square in self.squares]
        variance = sum(
            (sizes[i] * one for i, one in self.variances.items()), start=np.zeros(shape[1])
        )
        shapes = [np.sqrt(max(sizes[i], 0.0)) * one for i, one in self.shapes.items()]
        return ChangeError(variance, np.concatenate([rows, *shapes]) if shapes else rows)


def sum_error(
    residual: Residual, changes: np.ndarray, relative: float, controlled: bool
) -> SumError:
    """Error of weighted sums of changes (D, C); other parameters as for :func:`change_error`."""
    axes = residual.axes
    rows = relative * np.stack([axes.channels(change) for change in changes.T])
    if not controlled:
        whole = rows.sum(axis=1)
        spread = SPREAD_SHARE**2 / whole.shape[1] * whole @ whole.T
        return SumError(rows, [spread], {0: np.ones(whole.shape[1])}, {})
    partly = [partly_alike(one, axes.tasks, TASK_FACTOR, COMMON_FACTOR) for one in rows]
    squares, variances, shapes = [], {}, {}
    for i, kind in enumerate(residual.kinds):
        size = SHAPE_ERROR[kind.name] * relative
        shown = changes[kind.rows] / kind.deviations[:, None]
        squares.append(size**2 / len(shown) * shown.T @ shown)
        if kind.name in axes.variances:
            variances[i] = axes.variances[kind.name]
        elif kind.name in axes.rows:
            shapes[i] = axes.rows[kind.name]
    return SumError(np.stack(partly), squares, variances, shapes)


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
    return sum_error(residual, change[:, None], relative, controlled).at(np.ones(1))
