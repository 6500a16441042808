"""The share of a normal density that lies where parameters may be.

Some parameters have one sign only, and of some pairs the first is never above the second. Evidence
is an integral over what is allowed, which Laplace's method takes for all values.

Letters: P parameters, C constraints.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.special import log_ndtr


def constraints(
    low: np.ndarray, high: np.ndarray, order: Sequence[tuple[int, int]], free: np.ndarray
) -> np.ndarray:
    """Rows (C, P) whose products with allowed parameters are zero or less.

    Bounds that are not at zero are far from what priors expect, and are left out.

    Parameters
    ----------
    low, high : (P,) bounds
    order : pairs of which the first is never above the second; neither is above zero
    free : (P,) which parameters vary
    """
    every = np.eye(len(low))
    implied = {first for first, second in order if free[first] and free[second]}
    rows = [every[i] - every[j] for i, j in order if free[i] and free[j]]
    for i in np.flatnonzero(free):
        if low[i] >= 0.0:
            rows.append(-every[i])
        elif high[i] <= 0.0 and i not in implied:
            rows.append(every[i])
    return np.array(rows).reshape(-1, len(low))


def log_share(rows: np.ndarray, mean: np.ndarray, covariance: np.ndarray) -> float:
    """Log probability that normal parameters fulfil all constraints.

    One constraint after the other, each with the mean and variance that those before leave
    (Mendell and Elston 1974, Biometrics 30: 41-57): exact for one, off by a tenth for two.

    Parameters
    ----------
    rows : (C, P) see :func:`constraints`; mean : (P,); covariance : (P, P)
    """
    centre, spread = rows @ mean, rows @ covariance @ rows.T
    total = 0.0
    for i in range(len(rows)):
        sd = float(np.sqrt(spread[i, i]))
        z = -centre[i] / sd
        log_below = float(log_ndtr(z))
        total += log_below
        # Mean and variance of what is left below the bound, in units of sd.
        hazard = float(np.exp(-0.5 * (z**2 + np.log(2.0 * np.pi)) - log_below))
        # Never more than all of it: far from the bound the difference of two large numbers.
        lost = min(hazard * (hazard + z), 1.0)
        column = spread[:, i] / sd
        centre = centre - column * hazard
        spread = spread - lost * np.outer(column, column)
    return total
