"""Whether there is a gap: three tests that share the false alarms, which was settled beforehand.

Half is for the few effects that spoil the record of motion, because motion alone can name them. One
test looks for their shapes; another for those of all effects, a generalised likelihood ratio; the
third judges a map of all channels by its largest value (family-wise error; Nichols and Holmes 2002,
Hum Brain Mapp 15: 1-25). All thresholds are simulated from the noise.

Letters: N nodes, K channels, D coefficients, P parameters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.detection.shaped import shaped
from scapulohumeral.gap.labels import GLR, MAX_T, ON_RECORD
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual

DRAWS = 2000
# Of a single point, two-sided.
POINTWISE_ALPHA = 0.05
# Shares of the false alarms that tests have.
SHARES = {ON_RECORD: 0.5, MAX_T: 0.25, GLR: 0.25}


@dataclass(frozen=True, eq=False)
class DifferenceMap:
    """Map of where the gap shows.

    Attributes
    ----------
    sigma : (N, K) mean over tasks of the difference over its standard error, as one z value
    effect : (N, K) mean difference over tasks, in units of the channels
    value : largest of all z values, of single tasks as well; threshold, p_value : of it
    null : (draws,) largest z values without any effect, in order
    single : (N, K) what z exceeds without any effect in one of twenty draws, point by point: tasks
        share what sessions change, and few repeats leave heavy tails, so that it is more than 1.96
    by_task : (T, N, K) z values of single tasks
    """

    sigma: np.ndarray
    effect: np.ndarray
    value: float
    threshold: float
    p_value: float
    null: np.ndarray
    single: np.ndarray
    by_task: np.ndarray

    def family_wise_p(self, sigma: float) -> float:
        """How often a map without any effect has a value as large anywhere."""
        return float((1 + np.sum(self.null >= abs(sigma))) / (1 + len(self.null)))

    @property
    def standing_out(self) -> bool:
        """Whether any point of the mean over tasks exceeds the threshold of the whole map."""
        return bool(np.abs(self.sigma).max() > self.threshold)

    @property
    def in_one_task(self) -> tuple[int, int, int] | None:
        """Task, node and channel of the largest point of a single task beyond the threshold."""
        size = np.abs(self.by_task)
        task, node, channel = np.unravel_index(np.argmax(size), size.shape)
        if size[task, node, channel] <= self.threshold:
            return None
        return int(task), int(node), int(channel)


@dataclass(frozen=True)
class Presence:
    """Whether there is a gap above the floor, by one test.

    Attributes
    ----------
    p_value, statistic, value, threshold : of the test; "max_t" over channels and phases, "glr" over
        effects, "on_record" over those that spoil the record of motion: all of them z values. The p
        value counts that other tests are made as well
    shape_thresholds : of the tests for shapes, by name: z values
    """

    present: bool
    p_value: float
    statistic: str
    value: float
    threshold: float
    shape_thresholds: Mapping[str, float]


def shares(shapes: Mapping[str, Sequence[np.ndarray]]) -> dict[str, float]:
    """Share of the false alarms of each test; tests without anything to look for have none.

    Parameters
    ----------
    shapes : slopes (D, P) of the effects that tests look for, by name of the test
    """
    made = {name: share for name, share in SHARES.items() if name == MAX_T or shapes[name]}
    return {name: share / sum(made.values()) for name, share in made.items()}


def difference_map(
    residual: Residual, nothing: np.ndarray, alpha: float, inflation: float
) -> DifferenceMap:
    """Difference over standard error, with a family-wise threshold simulated from the noise.

    Parameters
    ----------
    residual : difference and noise
    nothing : (D, draws) differences without any effect
    alpha : family-wise error
    inflation : factor on the simulated threshold, from effect-free cases
    """
    sigma, largest = z_values(residual, residual.delta)
    joint, every = z_values(residual, nothing)
    null = inflation * every
    return DifferenceMap(
        sigma=sigma,
        effect=residual.curves(residual.delta).mean(axis=0),
        value=float(largest),
        threshold=threshold_of(null, alpha),
        p_value=p_value_of(null, float(largest)),
        null=np.sort(null),
        single=inflation * np.quantile(np.abs(joint), 1.0 - POINTWISE_ALPHA, axis=0),
        by_task=z_of_tasks(residual, residual.delta),
    )


def presence(
    residual: Residual,
    found: DifferenceMap,
    shapes: Mapping[str, Sequence[np.ndarray]],
    nothing: np.ndarray,
    alpha: float,
    inflation: float,
) -> tuple[Presence, ...]:
    """Whether there is a gap, by each of the tests with its share of the false alarms.

    Parameters
    ----------
    residual : difference and noise
    found : map of it, at the share of :data:`MAX_T`
    shapes : slopes (D, P) of the effects that tests look for, by name of the test
    nothing, inflation : as for :func:`difference_map`
    alpha : false alarms of all tests together
    """
    parts = shares(shapes)
    results = {MAX_T: (found.p_value, found.value, found.threshold)}
    for name in set(parts) - {MAX_T}:
        value, null = effect_shaped(residual, shapes[name], nothing)
        null = inflation * null
        results[name] = p_value_of(null, value), value, threshold_of(null, alpha * parts[name])
    thresholds = {name: results[name][2] for name in parts if name != MAX_T}
    findings = []
    for name, part in parts.items():
        p_value, value, threshold = results[name]
        p_value = min(p_value / part, 1.0)
        findings.append(Presence(p_value <= alpha, p_value, name, value, threshold, thresholds))
    return tuple(findings)


def tested(
    residual: Residual,
    shapes: Mapping[str, Sequence[np.ndarray]],
    alpha: float,
    inflation: float,
    seed: int,
) -> tuple[DifferenceMap, tuple[Presence, ...]]:
    """Map of a difference at its share of the false alarms, and all tests for a gap.

    Parameters are those of :func:`presence`, and the seed of what is drawn without any effect.
    """
    nothing = draws(residual, DRAWS, seed)
    found = difference_map(residual, nothing, alpha * shares(shapes)[MAX_T], inflation)
    return found, presence(residual, found, shapes, nothing, alpha, inflation)


def p_value_of(null: np.ndarray, value: float) -> float:
    """How often draws without any effect, (draws,), are as large, the value itself one of them."""
    return float((1 + np.sum(null >= value)) / (1 + len(null)))


def threshold_of(null: np.ndarray, alpha: float) -> float:
    """The value above which a p value by draws without any effect, (draws,), is at most `alpha`.

    P values count the value itself as one more draw; so does the threshold.
    """
    most = int(alpha * (1 + len(null)))
    return float(np.sort(null)[-most]) if most else np.inf


def surest(findings: Sequence[Presence]) -> Presence:
    """The finding of several tests that counts: one of a gap before any other.

    P values are bounded: of equal ones, that counts which is nearest to its threshold, or most
    above it.
    """
    return min(findings, key=lambda one: (not one.present, one.p_value, one.threshold - one.value))


def effect_shaped(
    residual: Residual, slopes: Sequence[np.ndarray], nothing: np.ndarray
) -> tuple[float, np.ndarray]:
    """Largest part of the difference that has the shape of any effect, as a z value.

    Parameters
    ----------
    slopes : (D, P) of each effect
    nothing : (D, draws) differences without any effect

    Returns
    -------
    value : of the difference; null : (draws,) without any effect
    """
    columns = np.column_stack([residual.delta, nothing])
    values = shaped(residual, columns, slopes)
    return float(values[0]), values[1:]


def z_of_tasks(residual: Residual, vector: np.ndarray) -> np.ndarray:
    """z values of single tasks (T, N, K) of a difference (D,)."""
    return residual.curves(vector) / residual.spread


def z_values(residual: Residual, vectors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """z values over all tasks of differences (D, ...), and their largest.

    Returns
    -------
    joint : (..., N, K)
    largest : (...) of these and of single tasks
    """
    total = np.zeros(())
    largest = np.zeros(())
    # Task by task: curves of all draws at once would fill the memory.
    for curves, spread in zip(residual.curves_by_task(vectors), residual.spread, strict=True):
        z = curves / spread
        total = total + z
        largest = np.maximum(largest, _largest(z))
    joint = total / np.sqrt(len(residual.tasks))
    return joint, np.maximum(largest, _largest(joint))


def _largest(z: np.ndarray) -> np.ndarray:
    """Largest size (...) of z values (..., N, K)."""
    return np.abs(z).max(axis=(-2, -1))
