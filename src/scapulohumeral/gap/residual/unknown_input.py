"""Smooth unknown inputs: generalised forces and errors of channels that no effect names.

A Gaussian process, that of forces through the optimal control problem. What it explains, but no
effect does, speaks for none of these.

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
from scapulohumeral.gap.residual.noise import deviation
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.settings import NoisePrior
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
    """Smooth generalised forces of each task, and smooth errors of its channels.

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
    noise: NoisePrior,
) -> UnknownInputs:
    """All disturbances of a case: forces of 1 N m, errors of EMG as large as repeats scatter.

    `functions` (N, B) are those of the comparison, `channels` its (K,) names.
    """
    emg = [name for name in channels if channel_kind(name) == "emg"]
    errors = _errors(emg, functions, channels, noise)
    blocks = []
    for of_task in signatures:
        slack = of_task.slack.reshape(-1, *of_task.slack.shape[2:])
        blocks.append(np.hstack([compress([slack], functions), errors]))
    names = [("dof", name) for name in KINEMATIC_CHANNELS]
    names += [("channel", name) for name in emg]
    shapes = _shapes(len(functions))
    units = [1.0] * len(KINEMATIC_CHANNELS) + [deviation(noise, name) for name in emg]
    return UnknownInputs(block_diag(*blocks), tuple(names), tuple(unit * shapes for unit in units))


def unknown_errors(
    signatures: Sequence[TaskSignatures],
    functions: np.ndarray,
    channels: Sequence[str],
    noise: NoisePrior,
) -> UnknownInputs:
    """Errors of all channels, where both sides recorded the same movements: no force differs.

    Arguments are those of :func:`unknown_inputs`.
    """
    errors = _errors(channels, functions, channels, noise)
    shapes = _shapes(len(functions))
    return UnknownInputs(
        block_diag(*([errors] * len(signatures))),
        tuple(("channel", name) for name in channels),
        tuple(deviation(noise, name) * shapes for name in channels),
    )


def _errors(
    of: Sequence[str], functions: np.ndarray, channels: Sequence[str], noise: NoisePrior
) -> np.ndarray:
    """Changes (K B, F each) by smooth errors of some channels, as large as repeats scatter."""
    shapes = _shapes(len(functions)).T
    curves = np.zeros((len(of), *shapes.shape, len(channels)))
    for i, name in enumerate(of):
        curves[i, :, :, channels.index(name)] = deviation(noise, name) * shapes
    return compress([curves.reshape(-1, *curves.shape[2:])], functions)


def _shapes(nodes: int) -> np.ndarray:
    """Smooth functions of phase (N, F) with a mean square of one."""
    return phase_functions(nodes, SMOOTH) * np.sqrt(nodes)


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
