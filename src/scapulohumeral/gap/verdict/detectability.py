"""The smallest amplitude of each effect that these trials would find.

Letters: D coefficients, T tasks, d = D / T, P parameters, M draws of the scatter.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq
from scipy.stats import chi2, norm

from scapulohumeral.gap.detection.shaped import P_RANGE, directions, scales, white_by_task
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.labels import GLR, ON_RECORD
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import (
    Detectable,
)

POWER = 0.8
# Draws by which power is judged: it is off by 0.02.
TRIES = 500
# Beyond any signal of these trials: a whitened length.
LONGEST = 1e3


def smallest_detectable(
    effects: Sequence[Hypothesis], residual: Residual, thresholds: Mapping[str, float], seed: int
) -> tuple[Detectable, ...]:
    """Primary amplitudes that the test for a gap would find with power 0.8.

    Parameters
    ----------
    effects : of a person who keeps the movement and pays with effort: who yields is found sooner
    residual : what is tested, with all that sessions may change
    thresholds : z values from which on a difference of the shape of an effect is a gap, by test
    seed : of the scatter in which effects are looked for

    Notes
    -----
    Where trials are so many that permuting them is a test of its own, that one has to agree.
    """
    scatter = _Scatter.of(residual, seed)
    rows = []
    for one in effects:
        param = one.effects[0].params[0]
        looking = [GLR, ON_RECORD] if one.effects[0].spoils_motion else [GLR]
        threshold = min(thresholds[name] for name in looking if name in thresholds)
        low, high = param.bounds
        internal = scatter.amplitude(one.slope, threshold) * (1.0 if high > 0.0 else -1.0)
        if low <= internal <= high:
            value = param.physical(float(internal))
            rows.append(Detectable(one.label, param.name, value, param.unit, POWER))
    return tuple(rows)


@dataclass(frozen=True, eq=False)
class _Scatter:
    """Differences without any effect, prepared for effects to be added.

    Attributes
    ----------
    residual : covariance of the difference
    white : (T, d, M) draws, whitened task by task
    parts : (T, D, M) what each task contributes to the whitened whole
    """

    residual: Residual
    white: np.ndarray
    parts: np.ndarray

    @staticmethod
    def of(residual: Residual, seed: int) -> _Scatter:
        """Scatter as the thresholds of the test take it to be."""
        vectors = draws(residual, TRIES, seed)
        return _Scatter(residual, white_by_task(residual, vectors), _white_parts(residual, vectors))

    def amplitude(self, slope: np.ndarray, threshold: float) -> float:
        """First internal parameter of an effect (D, P) whose z value is found with :data:`POWER`.

        Infinite if none is: the scatter is told from the same difference, and grows with it.
        """
        size = float(np.linalg.norm(self.residual.whiten(slope[:, 0])))
        if size == 0.0:
            return np.inf
        basis, _ = directions(self.residual, slope)
        least = float(chi2.isf(max(norm.sf(threshold), P_RANGE[0]), basis.shape[1]))
        white = white_by_task(self.residual, slope[:, :1])
        parts = _white_parts(self.residual, slope[:, :1])
        across = np.einsum("tdm,td->tm", self.white, white[..., 0])
        own, alone = np.sum(white**2, axis=1), np.sum(self.white**2, axis=1)
        signal, noise = (np.einsum("Dp,tDm->tpm", basis, one) for one in (parts, self.parts))

        def lacking(amplitude: float) -> float:
            whole = alone + 2.0 * amplitude * across + amplitude**2 * own
            over = scales(self.residual, whole)[:, None]
            told = np.sum((noise + amplitude * signal) / over, axis=0)
            return POWER - float(np.mean(np.sum(told**2, axis=0) > least))

        highest = LONGEST / size
        return np.inf if lacking(highest) > 0.0 else float(brentq(lacking, 0.0, highest))


def _white_parts(residual: Residual, vectors: np.ndarray) -> np.ndarray:
    """What each task of differences (D, M) contributes to the whitened whole, (T, D, M)."""
    parts = []
    for task in residual.tasks:
        alone = np.zeros_like(vectors)
        rows = residual.rows([task])
        alone[rows] = vectors[rows]
        parts.append(residual.whiten(alone))
    return np.array(parts)
