"""The error of a predicted change, in units of the signature error.

A person may share out a load among muscles and joints in another way than the model's least effort.
Each channel then changes more or less than predicted, much alike in all tasks. Angles or EMG may
change about as much, but elsewhere and at other phases.

Letters: D coefficients, K channels, T tasks.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.residual.residual import Residual

# Share of the signature error that is spread over all channels, for effects on the record.
SPREAD_SHARE = 0.3


# Errors of what muscles change, in units of the signature error. In simulated persons with another
# control, channels of EMG that changed much had the shape that the model predicts (cosine 0.94 to
# 0.99) and sizes off by 0.6 to 2, alike in all tasks; angles had hardly its shape (0 to 0.5).
# Factor on a channel, of a person in all tasks and of one task by itself:
COMMON_FACTOR, TASK_FACTOR = 1.7, 0.7


# Share of the error of the shape that is the same in all tasks.
SHAPE_SHARED = 0.5


# Errors of the shape. How a person moves against an effect the model does not know: this is not an
# error of the effect, which would thereby explain any movement, but supposed as another movement.
SHAPE_ERROR = {"kinematics": 0.0, "emg": 1.0, "contact_force": 1.0}


# Signature error of effects on the record, which no muscle has to act for, over that of others.
RECORD_SHARE = 0.5


class SignatureError:
    """Whitened residuals (D,), normal with covariance I + E, E (D, D) the error of a prediction."""

    def __init__(self, error: np.ndarray) -> None:
        covariance = error + np.eye(len(error))
        self._factor = cho_factor(covariance, lower=True, overwrite_a=True)
        self.logdet = 2.0 * float(np.log(np.diag(self._factor[0])).sum())

    def solve(self, vectors: np.ndarray) -> np.ndarray:
        """Inverse of I + E times vectors (D,) or (D, P)."""
        return cho_solve(self._factor, vectors)

    def squares(self, white: np.ndarray) -> float:
        """Sum of squares of a whitened residual (D,) in units of I + E."""
        return float(white @ self.solve(white))

    def log_density(self, squares: float, count: int) -> float:
        """Log density of a whitened residual with a sum of squares in units of I + E."""
        return -0.5 * (squares + self.logdet + count * np.log(2.0 * np.pi))


def own_error(effect: Effect, relative: float) -> float:
    """Relative error of an effect's change, of the signature error.

    What acts on the record itself is known better than what a person's control makes of it.
    """
    return relative if effect.changes_body else RECORD_SHARE * relative


def change_error(
    residual: Residual, change: np.ndarray, relative: float, controlled: bool
) -> np.ndarray:
    """Covariance (D, D), whitened, of the error of a predicted change.

    Parameters
    ----------
    residual : what is explained
    change : (D,) predicted
    relative : error of each channel's change, relative
    controlled : whether muscles make the change, so that its shape depends on a person's control
    """
    by_channel = residual.white_by_channel(change)
    if controlled:
        of_person = residual.over_tasks(by_channel)
        factors = relative * np.hstack([TASK_FACTOR * by_channel, COMMON_FACTOR * of_person])
        covariance = factors @ factors.T
        for kind in residual.kinds:
            size = SHAPE_ERROR[kind.name] * relative
            mean_square = float(np.mean((change[kind.rows] / kind.deviations) ** 2))
            if mean_square > 0.0:
                covariance += size**2 * mean_square * SHAPE_SHARED * kind.shared
                covariance += size**2 * mean_square * (1.0 - SHAPE_SHARED) * kind.covariance
        return covariance
    covariance = relative**2 * by_channel @ by_channel.T
    whole = by_channel.sum(axis=1)
    spread = (SPREAD_SHARE * relative) ** 2 * float(whole @ whole) / len(whole)
    covariance[np.diag_indices_from(covariance)] += spread
    return covariance
