"""Smooth unknown inputs: generalised forces and errors of EMG channels that no effect names.

A Gaussian process through the optimal control problem. What it explains, but no effect does, speaks
for none of these.

Letters: N nodes, K channels, D coefficients, S unknown inputs, F functions of phase.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    channel_kind,
    phase_functions,
)
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.signatures.nuisances import SMOOTH
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

UNKNOWN_INPUT_SIZES = (0.1, 0.3, 1.0, 3.0, 10.0)


def unknown_input_evidence(
    residual: Residual, columns: np.ndarray, sizes: Sequence[float] = UNKNOWN_INPUT_SIZES
) -> float:
    """Log evidence of smooth disturbances (D, S) of unknown common size, the best of a few sizes.

    Averaged over the sizes, so that a better fit by a freer box is paid for.
    """
    white, columns = residual.whiten(residual.delta), residual.whiten(columns)
    values = []
    for size in sizes:
        covariance = np.eye(len(white)) + size**2 * columns @ columns.T
        factor = np.linalg.cholesky(covariance)
        scaled = np.linalg.solve(factor, white)
        values.append(
            -0.5 * (scaled @ scaled + len(white) * np.log(2.0 * np.pi))
            - np.log(np.diag(factor)).sum()
        )
    return float(np.logaddexp.reduce(values) - np.log(len(values))) - residual.log_volume


def unknown_input_left(residual: Residual, columns: np.ndarray) -> float:
    """Sum of squares that smooth disturbances (D, S) leave of the whitened difference.

    It stands for the floor: more than this no cause that acts smoothly can explain.
    """
    white, columns = residual.whiten(residual.delta), residual.whiten(columns)
    left = white - columns @ np.linalg.lstsq(columns, white, rcond=None)[0]
    free = max(len(white) - columns.shape[1], 1)
    return min(float(left @ left) * len(white) / free, float(len(white)))


@dataclass(frozen=True, eq=False)
class UnknownInputs:
    """Smooth generalised forces of each task, and smooth errors of its EMG channels.

    Attributes
    ----------
    columns : (D, S) change of the record by one unit of each
    names : kind ("dof" or "channel") and name of each curve
    shapes : phase functions (N, F) of each curve, in its unit
    """

    columns: np.ndarray
    names: tuple[tuple[str, str], ...]
    shapes: tuple[np.ndarray, ...]


def unknown_inputs(
    signatures: Sequence[TaskSignatures],
    functions: np.ndarray,
    channels: Sequence[str],
    emg_unit: float,
) -> UnknownInputs:
    """All disturbances of a case; EMG errors in units of `emg_unit` [fraction of MVC].

    `functions` (N, B) are those of the comparison, `channels` its (K,) names.
    """
    nodes = len(functions)
    shapes = phase_functions(nodes, SMOOTH) * np.sqrt(nodes)
    names = [("dof", name) for name in KINEMATIC_CHANNELS]
    emg = [name for name in channels if channel_kind(name) == "emg"]
    names += [("channel", name) for name in emg]
    blocks = []
    for of_task in signatures:
        slack = of_task.slack.reshape(-1, *of_task.slack.shape[2:])
        columns = [compress([slack], functions)]
        for name in emg:
            curves = np.zeros((SMOOTH, nodes, len(channels)))
            curves[:, :, channels.index(name)] = emg_unit * shapes.T
            columns.append(compress([curves], functions))
        blocks.append(np.hstack(columns))
    units = [1.0] * len(KINEMATIC_CHANNELS) + [emg_unit] * len(emg)
    return UnknownInputs(block_diag(*blocks), tuple(names), tuple(unit * shapes for unit in units))


def most_probable_gain(residual: Residual, columns: np.ndarray) -> np.ndarray:
    """Matrix (S, D) from a whitened difference to the most probable amounts of disturbances (D, S).

    They are independent, of the common size with most evidence for the difference compared.
    """
    size = max(
        UNKNOWN_INPUT_SIZES, key=lambda s: unknown_input_evidence(residual, s * columns, (1.0,))
    )
    white = residual.whiten(size * columns)
    inner = np.eye(white.shape[1]) + white.T @ white
    return size * np.linalg.solve(inner, white.T)
