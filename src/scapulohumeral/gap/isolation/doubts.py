"""Why evidence for a cause may count less: what it leaves, and amplitudes on their bounds.

Letters: P parameters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.isolation.hypothesis import Fit

AT_BOUND = 1e-6


# What a cause leaves of what exceeds noise and sessions counts against it beside its evidence:
# above the first share, so many units of log probability per share, all of them where what exceeds
# noise and sessions is at least as much as these. Errors of its own prediction, which grow with
# it, give evidence even to a cause that shrinks no gap. Of 12 opened cases of muscles that had
# lost strength or hurt, or of another thorax, 4 instead of 2 were named rightly with it, of 44
# other single causes 37 instead of 36; 20 and 80 units do as well within one case.
USELESS, AGAINST = 0.8, 40.0


# Where no cause shrinks the gap, that is no comparison: a cause that leaves more than this share
# of what exceeds noise and sessions is doubted. In six opened cases right causes left 0.28 to
# 0.60 of the reducible difference, a wrong one 1.04.
DOUBTED = 0.8


# So is one that leaves a quarter to a half of it (none to all of the doubt) and more than noise and
# its own errors account for, from 1.2 to 1.5 times in mean square: then all causes are compared by
# errors that are too small. Noise counts as large as effect-free cases ask for. In 17 opened cases
# right causes had 0.4 to 1.3 then; in a published simulation without cuff against the healthy one,
# where the library has no single cause, the best had 1.4. So is one that leaves as much with an
# amplitude on its bound, its prior notwithstanding: it would be larger than anybody has found. And
# so are two together: the second is there to explain what the first leaves. In five opened cases
# right pairs left 0.1 at most.
LEAVING, MISFIT = (0.25, 0.5), (1.2, 1.5)


# No cause is doubted more than half: in 57 opened cases with EMG and reference trials, doubts alone
# gave none of these 0.9 or more seven times, and it was right once.
LARGEST_DOUBT = 0.5


@dataclass(frozen=True)
class Squares:
    """Sums of squares of a whitened difference.

    Attributes
    ----------
    whole : of the difference itself
    expected : of noise and of what sessions change, without any cause
    excess : factor on standard deviations that effect-free cases ask for
    """

    whole: float
    expected: float
    excess: float


def _exceeding(fitted: Fit, squares: Squares) -> float:
    """Share that a fit leaves of what exceeds noise and sessions; none if nothing does.

    A small gap may stand out in one channel and lie below what sessions change in all of them:
    no cause could explain most of it then, the right one neither.
    """
    return _share_left(fitted.left, squares.whole, squares.expected)


def _against(fitted: Fit, squares: Squares) -> float:
    """Units of log probability that a fit loses by what it leaves."""
    weight = np.clip(squares.whole / squares.expected - 1.0, 0.0, 1.0)
    return float(AGAINST * weight * max(_exceeding(fitted, squares) - USELESS, 0.0))


def _doubt(fitted: Fit, squares: Squares) -> float:
    """Share of a fit's probability that belongs to none of these."""
    left = _exceeding(fitted, squares)
    misfit = fitted.misfit / squares.excess**2
    has_to_explain = len(fitted.hypothesis.effects) > 1 or _as_large_as_may_be(fitted)
    misfitting = 1.0 if has_to_explain else _ramp(misfit, *MISFIT)
    doubt = max(_ramp(left, DOUBTED, 1.0), min(_ramp(left, *LEAVING), misfitting))
    return min(doubt, LARGEST_DOUBT)


def _as_large_as_may_be(fitted: Fit) -> bool:
    """Whether an amplitude of any effect lies on a bound: the primary one, or one in its unit.

    Their priors, which pull them from there, count: in two opened cases right causes lay on a bound
    without them only.
    """
    amplitude = [
        param.unit == effect.params[0].unit
        for effect in fitted.hypothesis.effects
        for param in effect.params
    ]
    return bool(_on_bound(fitted, fitted.x)[amplitude].any())


def _on_bound(fitted: Fit, values: np.ndarray) -> np.ndarray:
    """Which internal parameters (P,) lie on bounds that data run into.

    The value at which an effect is absent is none.
    """
    ends = np.array(fitted.hypothesis.bounds)
    near = AT_BOUND + 1e-3 * (ends[1] - ends[0])
    return ((np.abs(values - ends) < near) & (np.abs(ends) > near)).any(axis=0)


def _ramp(value: float, low: float, high: float) -> float:
    """Zero below `low`, one above `high`, linear between them."""
    return float(np.clip((value - low) / (high - low), 0.0, 1.0))


def _share_left(left: float, whole: float, least: float) -> float:
    return max(left - least, 0.0) / max(whole - least, 1e-9)
