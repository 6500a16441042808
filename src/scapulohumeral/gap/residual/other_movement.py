"""A movement that was done differently: the covariance of what follows from it.

A person who intends another movement realises it, and pays with other muscle activity. Recorded
motion is thereby an input: what it asks for of EMG and joint force is predicted from it, as far as
the model can, and only what remains is left to effects.

Letters: D coefficients, T tasks, K channels, B phase functions.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scapulohumeral.gap.recording.observables import channel_kind
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

# Standard deviations [deg] of the change of each joint rotation that are tried beside none: a
# little and much more than sessions differ by.
SIZES_DEG = (2.0, 6.0, 18.0)
# Share of its variance that is alike in all tasks: a strategy of the person, not of the task.
# ASSUME: as much as not.
SHARED = 0.5


def other_movement(
    residual: Residual, signatures: Sequence[TaskSignatures], relative_error: float
) -> np.ndarray:
    """Covariance (D, D) of a movement whose joint rotations each vary by one degree.

    EMG and joint force follow the motion within the error of predicted changes, channel by channel.

    Parameters
    ----------
    residual : what is explained
    signatures : of its tasks
    relative_error : of predicted changes
    """
    columns = _columns(residual, signatures)
    covariance = SHARED * columns @ columns.T + (1.0 - SHARED) * _in_each_task(columns, residual)
    answers = np.zeros_like(covariance)
    for channel in residual.channels:
        if channel_kind(channel) != "kinematics":
            rows = np.ix_(*2 * [residual.channel_rows([channel])])
            answers[rows] = relative_error**2 * covariance[rows]
    return covariance + answers


def _columns(residual: Residual, signatures: Sequence[TaskSignatures]) -> np.ndarray:
    """Changes (D, 10 B) by smooth changes of each joint rotation, slow ones the most."""
    size = residual.functions.shape[1]
    shares = 1.0 / np.arange(1, size + 1)
    shares /= np.linalg.norm(shares)
    own = [
        shares[:, None, None] * of_task.intended[:, :size]
        for task in residual.tasks
        for of_task in signatures
        if of_task.task == task
    ]
    return compress([one.reshape(-1, *one.shape[2:]) for one in own], residual.functions)


def _in_each_task(columns: np.ndarray, residual: Residual) -> np.ndarray:
    """Covariance (D, D) of changes that tasks do not share."""
    covariance = np.zeros((len(columns), len(columns)))
    for task in residual.tasks:
        rows = residual.rows([task])
        covariance[np.ix_(rows, rows)] = columns[rows] @ columns[rows].T
    return covariance
