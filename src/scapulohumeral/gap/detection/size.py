"""Size of a gap beyond what noise and sessions account for, with an interval over trials.

Letters: D coefficients, T tasks, L trials.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.stats import bootstrap, norm, t

from scapulohumeral.gap.detection.presence import DRAWS
from scapulohumeral.gap.residual.differences import Records
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import Size

RESAMPLES = 2000
# Fewer trials of a task on one side say too little of how they vary.
FEWEST_TRIALS = 3
NO_INTERVAL = (
    f"size of the gap: a task has fewer than {FEWEST_TRIALS} trials on a side, so it has no "
    "interval"
)

# Coefficients (L, D / T) of the trials of one side, by task.
Side = Mapping[str, np.ndarray]


def sides(residual: Residual, records: Records) -> list[Side]:
    """Trials behind a comparison, about anything: only how they differ among each other counts.

    Those of the reference have the other sign, as their mean has in the difference.
    """
    signs = {"test": 1.0, "reference": -1.0}
    return [
        {
            task: signs[name] * residual.compress([records.about_mean(task, side[task])]).T
            for task in residual.tasks
        }
        for name, side in records.sides.items()
        if side
    ]


def gap_size(residual: Residual, trials: Sequence[Side], seed: int) -> Size:
    """Root mean square of the whitened difference beyond what is expected without any effect.

    With w the whitened difference, ``sqrt(max(|w|^2 / D - m, 0))``, where m is the mean of the same
    without any effect: one if noise was known exactly, more as few repeats hardly tell it. Every
    coefficient counts, none is picked because it is large. The interval joins a bootstrap over
    trials, test and reference apart and task by task, with how far noise alone is from m.

    Parameters
    ----------
    residual : mean difference and its covariance
    trials : of the test side, and of the reference side if there is one; see :func:`sides`
    seed : of the bootstrap, and of what is simulated without any effect
    """
    white = residual.whiten(residual.delta)
    nothing = np.mean(residual.whiten(draws(residual, DRAWS, seed)) ** 2, axis=0)
    expected = float(nothing.mean())
    excess = float(white @ white) / len(white) - expected
    groups = [
        _influence(residual, white, task, coefficients)
        for side in trials
        for task, coefficients in side.items()
    ]
    if min(len(group) for group in groups) < FEWEST_TRIALS:
        return Size(_length(excess), None)
    found = bootstrap(
        groups, _mean_sum, n_resamples=RESAMPLES, method="basic", random_state=seed
    ).confidence_interval
    # Few trials do not know their own spread: as Student's t is wider than a normal distribution.
    degrees = sum(len(group) - 1 for group in groups)
    wider = t.ppf(0.975, degrees) / norm.ppf(0.975)
    # What noise adds at most is what may have to be taken off, and the other way round.
    least, most = np.quantile(nothing, [0.025, 0.975]) - expected
    low = excess - float(np.hypot(wider * found.low, most))
    high = excess + float(np.hypot(wider * found.high, least))
    return Size(_length(excess), (_length(low), _length(high)))


def _influence(
    residual: Residual, white: np.ndarray, task: str, coefficients: np.ndarray
) -> np.ndarray:
    """By how much each trial (L,) moves the excess, were it the mean of its group.

    To first order: resampled squares would hold the noise of the trials twice. The order that is
    left out is that of the noise, which the length of `white` holds already.
    """
    # Deviations from a mean of their own are too small by this factor.
    grown = np.sqrt(len(coefficients) / max(len(coefficients) - 1.0, 1.0))
    whole = np.zeros((len(white), len(coefficients)))
    whole[residual.rows([task])] = grown * (coefficients - coefficients.mean(axis=0)).T
    return 2.0 * white @ residual.whiten(whole) / len(white)


def _mean_sum(*groups: np.ndarray, axis: int = -1) -> np.ndarray:
    return sum((group.mean(axis=axis) for group in groups), start=np.zeros(()))


def _length(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))
