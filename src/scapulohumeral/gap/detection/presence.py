"""Whether there is a gap: the largest z value of a map, or a likelihood ratio over effects.

The map is judged by its largest value (family-wise error; Nichols and Holmes 2002, Hum Brain Mapp
15: 1-25), the effects by a generalised likelihood ratio. Both thresholds are simulated from the
noise.

Letters: N nodes, K channels, D coefficients, P parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, norm

from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual

DRAWS = 2000


@dataclass(frozen=True, eq=False)
class DifferenceMap:
    """Map of where the gap shows.

    Attributes
    ----------
    sigma : (N, K) mean over tasks of the difference over its standard error, as one z value
    effect : (N, K) mean difference over tasks, in units of the channels
    value : largest of all z values, of single tasks as well; threshold, p_value : of it
    null : (draws,) largest z values without any effect, in order
    """

    sigma: np.ndarray
    effect: np.ndarray
    value: float
    threshold: float
    p_value: float
    null: np.ndarray

    def family_wise_p(self, sigma: float) -> float:
        """How often a map without any effect has a value as large anywhere."""
        return float((1 + np.sum(self.null >= abs(sigma))) / (1 + len(self.null)))

    @property
    def standing_out(self) -> bool:
        """Whether any point of the mean over tasks exceeds the threshold of the whole map."""
        return bool(np.abs(self.sigma).max() > self.threshold)


@dataclass(frozen=True)
class Presence:
    """Whether there is a gap above the floor.

    Attributes
    ----------
    p_value, statistic, value, threshold : of the test; "max_t" over channels and phases, or "glr"
        over effects, both as z values
    effect_threshold : from which on a difference of the shape of an effect is a gap, a z value
    """

    present: bool
    p_value: float
    statistic: str
    value: float
    threshold: float
    effect_threshold: float


def difference_map(residual: Residual, alpha: float, inflation: float, seed: int) -> DifferenceMap:
    """Difference over standard error, with a family-wise threshold simulated from the noise.

    Parameters
    ----------
    residual : difference and noise
    alpha : family-wise error
    inflation : factor on the simulated threshold, from effect-free cases
    seed : of the simulation
    """
    sigma, largest = z_values(residual, residual.delta)
    null = inflation * np.array(
        [z_values(residual, one)[1] for one in draws(residual, DRAWS, seed).T]
    )
    return DifferenceMap(
        sigma=sigma,
        effect=residual.curves(residual.delta).mean(axis=0),
        value=largest,
        threshold=float(np.quantile(null, 1.0 - alpha)),
        p_value=float((1 + np.sum(null >= largest)) / (1 + DRAWS)),
        null=np.sort(null),
    )


def presence(
    residual: Residual,
    found: DifferenceMap,
    slopes: Sequence[np.ndarray],
    alpha: float,
    inflation: float,
    seed: int,
) -> Presence:
    """Whether there is a gap, by the stronger of two tests with half of the false alarms each.

    One asks whether any channel stands out (`found`, at half of alpha); the other whether the whole
    difference has the shape of any effect, which may be spread thinly over many channels.

    Parameters
    ----------
    slopes : (D, P) of each effect
    alpha, inflation, seed : as for :func:`shows`
    """
    value, null = effect_shaped(residual, slopes, seed)
    rest = inflation * null
    p_value = float((1 + np.sum(rest >= value)) / (1 + DRAWS))
    threshold = float(np.quantile(rest, 1.0 - 0.5 * alpha))
    name, own = "glr", threshold
    if found.p_value <= p_value:
        p_value, name, value, own = found.p_value, "max_t", found.value, found.threshold
    p_value = min(2.0 * p_value, 1.0)
    return Presence(p_value <= alpha, p_value, name, value, own, threshold)


def effect_shaped(
    residual: Residual, slopes: Sequence[np.ndarray], seed: int
) -> tuple[float, np.ndarray]:
    """Largest part of the difference that has the shape of any effect, as a z value.

    Returns
    -------
    value : of the difference; null : (draws,) without any effect
    """
    bases = [np.linalg.qr(residual.whiten(slope))[0] for slope in slopes if np.any(slope)]
    null = residual.whiten(draws(residual, DRAWS, seed))
    columns = np.column_stack([residual.whiten(residual.delta), null])
    lengths = [
        norm.isf(np.maximum(chi2.sf(np.sum((b.T @ columns) ** 2, axis=0), b.shape[1]), 1e-300))
        for b in bases
    ]
    largest = np.max(lengths, axis=0)
    return float(largest[0]), largest[1:]


def z_values(residual: Residual, vector: np.ndarray) -> tuple[np.ndarray, float]:
    """z values over all tasks (N, K), and the largest of these and of single tasks."""
    z = residual.curves(vector) / residual.spread
    joint = z.sum(axis=0) / np.sqrt(len(z))
    return joint, float(max(np.abs(z).max(), np.abs(joint).max()))
