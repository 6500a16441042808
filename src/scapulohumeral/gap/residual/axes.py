"""Whitened axes along which errors of the shape of a prediction are independent.

The error of a prediction changes with it, so least squares solve with another covariance at every
step. Noise is independent along any whitened axes; along these so are errors of the shape, and what
is left of the covariance is a product of a few rows.

Letters: D coefficients, K channels, B phase functions, T tasks, R of a kind, P columns.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

# Errors of the shape of what muscles change, in units of the signature error. How a person moves
# against an effect the model does not know: this is not an error of the effect, which would thereby
# explain any movement, but supposed as another movement.
SHAPE_ERROR = {"kinematics": 0.0, "emg": 1.0, "contact_force": 1.0}
# Share of the error of the shape that is the same in all tasks.
SHAPE_SHARED = 0.5


@dataclass(frozen=True, eq=False)
class Kind:
    """Channels of one kind in a comparison.

    Attributes
    ----------
    name : of the kind; rows : (R,) positions of its coefficients in (D,)
    deviations : (R,) standard deviations between repeats
    """

    name: str
    rows: np.ndarray
    deviations: np.ndarray


@dataclass(frozen=True, eq=False)
class Axes:
    """Whitened axes of a comparison.

    Attributes
    ----------
    matrix : (D, D) what whitens
    by_channel : (T K, D, B) the same, by channel of a task
    variances : by kind of channels, (D,) along the axes, of errors of its shape as large as its
        repeats scatter; of one kind at most
    rows : by kind, (R, D) whose squares add up to the covariance of such errors; of the others
    tasks : T
    """

    matrix: np.ndarray
    by_channel: np.ndarray
    variances: Mapping[str, np.ndarray]
    rows: Mapping[str, np.ndarray]
    tasks: int

    def whiten(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (D,) or (D, P) in units in which noise is independent and of size one."""
        return self.matrix @ vectors

    def channels(self, vector: np.ndarray) -> np.ndarray:
        """Whitened parts (T K, D) that a vector (D,) has in one channel of one task each."""
        parts = vector.reshape(len(self.by_channel), -1, 1)
        return (self.by_channel @ parts)[..., 0]

    def channels_of_all_tasks(self, vector: np.ndarray) -> np.ndarray:
        """Whitened parts (K, D) that a vector (D,) has in one channel each."""
        return self.channels(vector).reshape(self.tasks, -1, len(vector)).sum(axis=0)


def partly_alike(rows: np.ndarray, tasks: int, own: float, alike: float) -> np.ndarray:
    """Rows (T C, D) of a change that is partly alike in all tasks.

    Their squares add up to `own`^2 times those of the rows given, task by task, and `alike`^2 times
    those of their sums over tasks.
    """
    by_task = rows.reshape(tasks, -1, rows.shape[1])
    grown = np.sqrt(own**2 + tasks * alike**2) - own
    return (own * by_task + grown / tasks * by_task.sum(axis=0)).reshape(rows.shape)


def axes(factor: np.ndarray, kinds: tuple[Kind, ...], tasks: int, functions: int) -> Axes:
    """Axes of a comparison.

    Parameters
    ----------
    factor : (D, D) lower Cholesky factor of its covariance
    kinds : of its channels
    tasks, functions : T and B
    """
    matrix = solve_triangular(factor, np.eye(len(factor)), lower=True)
    erring = sorted(
        (kind for kind in kinds if SHAPE_ERROR[kind.name]), key=lambda kind: -len(kind.rows)
    )
    variances = {}
    for kind in erring[:1]:
        rows = _shape(matrix, kind, tasks)
        variance, turn = np.linalg.eigh(rows.T @ rows)
        variances[kind.name] = np.maximum(variance, 0.0)
        matrix = turn.T @ matrix
    by_channel = matrix.reshape(len(matrix), -1, functions).transpose(1, 0, 2)
    return Axes(
        matrix=matrix,
        by_channel=np.ascontiguousarray(by_channel),
        variances=variances,
        rows={kind.name: _shape(matrix, kind, tasks) for kind in erring[1:]},
        tasks=tasks,
    )


def _shape(matrix: np.ndarray, kind: Kind, tasks: int) -> np.ndarray:
    """Rows (R, D), whitened, of changes of a kind by one deviation, partly alike in all tasks."""
    rows = kind.deviations[:, None] * matrix[:, kind.rows].T
    return partly_alike(rows, tasks, np.sqrt(1.0 - SHAPE_SHARED), np.sqrt(SHAPE_SHARED))
