"""The movement that was done differently, as far as a difference tells it.

Letters: D coefficients, T tasks.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from scapulohumeral.gap.effects.movement_strategy import MOVEMENT_STRATEGY
from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import no_gap_evidence
from scapulohumeral.gap.residual.residual import Residual


def most_probable_size(residuals: Mapping[float, Residual]) -> float:
    """Size of another movement [deg] with most evidence, among those that are not 0."""
    return max(
        (size for size in residuals if size > 0.0), key=lambda s: no_gap_evidence(residuals[s])
    )


def predicted_movement(same: Residual, other: Residual, training: Residual) -> np.ndarray:
    """Most probable change (D,) of all tasks by another movement.

    Parameters
    ----------
    same, other : comparison whose covariance is without and with another movement
    training : the differences it is told from, of all tasks of `other` or some
    """
    movement = other.covariance - same.covariance
    rows = other.rows(training.tasks)
    factor = cho_factor(other.covariance[np.ix_(rows, rows)], lower=True)
    return movement[:, rows] @ cho_solve(factor, training.delta)


def expected_movement_left(same: Residual, other: Residual, training: Residual) -> np.ndarray:
    """Covariance of what :func:`predicted_movement` leaves of tasks not trained on."""
    rows = other.rows(training.tasks)
    rest = np.setdiff1d(np.arange(len(other.delta)), rows)
    trained = other.covariance[np.ix_(rows, rows)]
    movement = (other.covariance - same.covariance)[np.ix_(rest, rows)]
    gain = cho_solve(cho_factor(trained, lower=True), movement.T).T
    # Tasks share what sessions change, too, which is not predicted.
    shared = gain @ other.covariance[np.ix_(rows, rest)]
    return other.covariance[np.ix_(rest, rest)] + gain @ trained @ gain.T - shared - shared.T


def movement_fit(residuals: Mapping[float, Residual], log_evidence: float) -> Fit:
    """Another movement as an explanation: its estimated shape, with its size as the parameter.

    Parameters
    ----------
    residuals : by the supposed size of another movement [deg]
    log_evidence : of another movement alone, over all sizes
    """
    same, other = residuals[0.0], residuals[most_probable_size(residuals)]
    change = predicted_movement(same, other, other)
    movement = other.covariance - same.covariance
    uncertain = movement - movement @ np.linalg.solve(other.covariance, movement)
    rows = next(kind.rows for kind in same.kinds if kind.name == "kinematics")
    # Coefficients of orthonormal functions have the sum of squares of the curves.
    samples = len(same.functions) * len(rows) / same.functions.shape[1]
    length = max(float(np.linalg.norm(change[rows])), 1e-9)
    along = change[rows] / length
    size = length / np.sqrt(samples)
    variance = float(along @ uncertain[np.ix_(rows, rows)] @ along) / samples
    hypothesis = Hypothesis(
        effects=(MOVEMENT_STRATEGY,),
        at=np.zeros(1),
        value=np.zeros((len(change), 1)),
        slope=change[:, None] / size,
        stiffness=1.0,
    )
    return Fit(
        hypothesis,
        np.array([size]),
        np.array([[variance]]),
        log_evidence,
        moved_deg=other.moved_deg,
        unbounded=np.array([size]),
        unconstrained=np.array([size]),
    )
