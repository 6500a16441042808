"""Whether test and reference trials might change places: a test that needs no model of the noise.

Repeats of real people scatter with heavy tails, and few repeats do not tell how much. If a
difference between sides is no larger than between other halves of the same trials, it is no gap,
whatever the simulated thresholds say. The other way round it is not enough: trials of two sessions
differ without a cause (Good 2005, Permutation, Parametric and Bootstrap Tests of Hypotheses).

Letters: D coefficients, T tasks, L trials of a task on both sides, P arrangements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, islice, product
from math import prod

import numpy as np

from scapulohumeral.gap.detection.presence import Presence, surest
from scapulohumeral.gap.detection.shaped import closest, shaped, squares
from scapulohumeral.gap.residual.differences import Records
from scapulohumeral.gap.residual.residual import Residual

ARRANGEMENTS = 2000
# Sizes that differ by less than this share of the largest are the same.
ALIKE = 1e-9
# Scatter of a whitened length: arrangements that a change makes as large but for it hardly differ.
NOISE = 1.0


def strongest(
    findings: Sequence[Presence],
    records: Records,
    residual: Residual,
    shapes: Mapping[str, Sequence[np.ndarray]],
    alpha: float,
    seed: int,
) -> Presence:
    """The surest finding of those that stand up to other arrangements of the same trials.

    Parameters
    ----------
    findings : of all tests; shapes : what they look for, as for `presence.presence`
    records, residual, alpha, seed : as for :func:`exchangeable`
    """
    judged = [
        exchangeable(one, records, residual, shapes.get(one.statistic, ()), alpha, seed)
        for one in findings
    ]
    return surest(judged)


def exchangeable(
    found: Presence,
    records: Records,
    residual: Residual,
    slopes: Sequence[np.ndarray],
    alpha: float,
    seed: int,
) -> Presence:
    """A finding that stands only if other arrangements of the same trials differ less.

    Left as it is where so few trials cannot contradict it: without reference trials, or if even
    the most extreme arrangement would be no rarer than `alpha`. Two records of one movement do
    not change places: one system made all of one side.

    Parameters
    ----------
    found : by thresholds simulated from the noise
    records : trials of both sides
    residual : mean difference and its covariance
    slopes : (D, P) of the effects that the test looks for; without any, whole differences count
    alpha : false alarms allowed; seed : of arrangements, where there are too many for all
    """
    if records.of_one_movement or not (found.present and records.reference):
        return found
    arranged = _arranged(records, residual, seed)
    sizes = shaped(residual, arranged, slopes) if slopes else _lengths(residual, arranged)
    margin = ALIKE * sizes.max()
    least_p = float(np.mean(sizes > sizes.max() - margin))
    if slopes:
        least_p = max(least_p, float(np.mean(_made_as_large(records, residual, slopes, seed))))
    if least_p > alpha:
        return found
    p_value = float(np.mean(sizes > sizes[0] - margin))
    if p_value > alpha:
        # The smallest size that is rare enough; `least_p` says that there is one.
        threshold = float(np.sort(sizes)[-int(alpha * len(sizes) + ALIKE)])
        return replace(
            found,
            present=False,
            p_value=p_value,
            statistic="permutation",
            value=float(sizes[0]),
            threshold=threshold,
        )
    return replace(found, p_value=max(p_value, found.p_value))


def _made_as_large(
    records: Records, residual: Residual, slopes: Sequence[np.ndarray], seed: int
) -> np.ndarray:
    """Arrangements (P,) that the change which was found would make as large, were there no scatter.

    A task that it hardly changes tells nothing, whichever of its trials change places.
    """
    change, basis = closest(residual, slopes)
    arranged = _arranged(records, residual, seed, change)
    lengths = np.linalg.norm(basis.T @ residual.whiten(arranged), axis=0)
    return lengths > lengths[0] - NOISE


def _lengths(residual: Residual, arranged: np.ndarray) -> np.ndarray:
    """Whitened lengths (P,) of the mean differences of arrangements (D, P).

    Tasks are whitened one by one: what sessions change is alike in all of them, so that beside it
    sides that change places in one task only would look like the larger difference.
    """
    return np.sqrt(squares(residual, arranged).sum(axis=0))


def _arranged(
    records: Records, residual: Residual, seed: int, change: np.ndarray | None = None
) -> np.ndarray:
    """Mean differences (D, P) of all arrangements, the recorded one first.

    With a `change` (D,) they are those of trials of which the test ones have it, and nothing else.
    """
    parts, counts = [], []
    for task in residual.tasks:
        trials = [*records.test[task], *records.reference[task]]
        tests = len(records.test[task])
        signs = _signs(len(trials), tests, seed)
        counts.append(len(signs))
        if change is None:
            coefficients = residual.compress([records.about_mean(task, trials)])
        else:
            coefficients = np.outer(change[residual.rows([task])], np.arange(len(trials)) < tests)
        parts.append(coefficients @ signs.T)
    which = np.array(_arrangements(counts, seed)).T
    return np.vstack([own[:, chosen] for own, chosen in zip(parts, which, strict=True)])


def _signs(trials: int, tests: int, seed: int) -> np.ndarray:
    """Weights (C, L) of the trials in a mean difference, for choices of the test trials.

    All choices, or a sample of them; the recorded one is the first.
    """
    choices = list(islice(combinations(range(trials), tests), ARRANGEMENTS + 1))
    if len(choices) > ARRANGEMENTS:
        rng = np.random.default_rng(seed)
        drawn = rng.permuted(np.tile(np.arange(trials), (ARRANGEMENTS - 1, 1)), axis=1)
        choices = [choices[0], *map(tuple, drawn[:, :tests])]
    rows = np.full((len(choices), trials), -1.0 / (trials - tests))
    for row, chosen in zip(rows, choices, strict=True):
        row[list(chosen)] = 1.0 / tests
    return rows


def _arrangements(counts: Sequence[int], seed: int) -> list[tuple[int, ...]]:
    """One of so many choices for each task, all or a sample; the recorded one is the first."""
    if prod(counts) <= ARRANGEMENTS:
        return list(product(*(range(count) for count in counts)))
    rng = np.random.default_rng(seed)
    drawn = np.stack([rng.integers(count, size=ARRANGEMENTS - 1) for count in counts], axis=1)
    return [(0,) * len(counts), *map(tuple, drawn.tolist())]
