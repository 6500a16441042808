"""From evidence to probabilities, and the credible set.

Probabilities hold if the cause is in the library, and as far as their temperature and the share of
evidence that misleads are calibrated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp, softmax

from scapulohumeral.gap.isolation.doubts import Squares, _against, _doubt
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.labels import JOIN, NO_GAP, NONE

COVERAGE = 0.9


# With a gap this share of all probability is taken as misled: half of it belongs to none of these,
# half to all causes as before any data. In those cases the upper three fifths of first answers were
# given 0.98 and right in 0.82. With this share, and doubts of at most a half, the calibration error
# falls from 0.21 to 0.10, and the mean log probability of the truth rises from -1.68 to -1.20.
MISLED = 0.12


# With a gap above the floor, "no gap" is at most as probable.
UNDECIDED = 0.5


# Without one it is at least as probable, with or without reference trials: in five blind draws,
# opened since, 32 of 36 such answers were right with reference and 17 of 25 without it (a right and
# a wrong one added to each).
SILENT = {True: 0.87, False: 0.67}


# With a gap "none of these" is at most as probable, but for causes that are doubted: smooth forces
# mimic some effects (joint damping above all) better than the model predicts them. In a blind draw
# of 60 cases, opened since, two of seven answers in which it came first were right (a right and a
# wrong one added).
UNKNOWN = 1.0 / 3.0


@dataclass(frozen=True)
class Posterior:
    """Probabilities of all hypotheses: of labels, of none of these, and of no gap."""

    labels: Mapping[str, float]
    none: float
    no_gap: float


def posterior(
    fits: Sequence[Fit],
    others: Mapping[str, float],
    prior: Mapping[str, float],
    temperature: float,
    no_gap: tuple[float, float],
    squares: Squares | None,
) -> Posterior:
    """Probabilities by Bayes' rule with tempered evidence.

    Parameters
    ----------
    fits : of all hypotheses; others : log evidence of "none" and "no_gap"
    prior : of each label, and of "none" and "no_gap"
    temperature : divides all log evidence: above one, evidence counts less than it claims
    no_gap : least and largest probability of "no_gap", see :func:`no_gap_range`
    squares : of the difference, by which causes are doubted; None: no cause is
    """
    logs = {label: log / temperature + np.log(prior[label]) for label, log in others.items()}
    of_fits = np.array([_support(f, prior, temperature, squares) for f in fits])
    known = logsumexp(of_fits)
    nothing = float(np.clip(softmax([known, logs[NONE], logs[NO_GAP]])[2], *no_gap))
    none = (1.0 - nothing) * float(softmax([known, logs[NONE]])[1])
    if squares is not None:
        none = min(none, UNKNOWN)
    p = (1.0 - none - nothing) * softmax(of_fits)
    if squares is not None:
        doubt = p * np.array([_doubt(f, squares) for f in fits])
        p, none = p - doubt, none + float(doubt.sum())
    return Posterior(dict(zip([f.label for f in fits], p.tolist(), strict=True)), none, nothing)


def most_probable(
    fits: Sequence[Fit],
    prior: Mapping[str, float],
    temperature: float,
    squares: Squares,
    count: int,
) -> list[Fit]:
    """So many fits of largest probability, the best first; parameters as for :func:`posterior`."""

    def rank(f: Fit) -> float:
        return _support(f, prior, temperature, squares) + np.log1p(-_doubt(f, squares))

    return sorted(fits, key=rank, reverse=True)[:count]


def _support(
    fitted: Fit, prior: Mapping[str, float], temperature: float, squares: Squares | None
) -> float:
    """Log probability of a fit before doubts, up to a constant."""
    support = fitted.log_evidence / temperature + float(np.log(prior[fitted.label]))
    return support if squares is None else support - _against(fitted, squares)


def perhaps_misled(found: Posterior, prior: Mapping[str, float]) -> Posterior:
    """Probabilities that allow for evidence that misleads: a share :data:`MISLED` of all causes'.

    `prior` is that of labels; pairs get nothing.
    """
    before = {label: 0.0 if JOIN in label else prior[label] for label in found.labels}
    misled = 0.5 * MISLED * (1.0 - found.no_gap)
    rate = misled / sum(before.values())
    return replace(
        found,
        labels={
            label: (1.0 - MISLED) * p + rate * before[label] for label, p in found.labels.items()
        },
        none=(1.0 - MISLED) * found.none + misled,
    )


def no_gap_range(present: bool, referenced: bool) -> tuple[float, float]:
    """Least and largest probability of no gap.

    Parameters
    ----------
    present : whether the difference exceeds the floor
    referenced : whether it is that to reference trials
    """
    return (0.0, UNDECIDED) if present else (SILENT[referenced], 1.0)


def credible_set(found: Posterior) -> tuple[str, ...]:
    """The most probable answers that together reach 90 % of the posterior probability.

    A credible set: nothing outside of the model of the case vouches for how often it holds the
    truth, which the score card of blind cases measures.
    """
    every = {**found.labels, NONE: found.none, NO_GAP: found.no_gap}
    ordered = sorted(every, key=lambda label: -every[label])
    total = np.cumsum([every[label] for label in ordered])
    return tuple(ordered[: int(np.searchsorted(total, COVERAGE) + 1)])
