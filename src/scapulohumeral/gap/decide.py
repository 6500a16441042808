"""From evidence to the answer: probabilities, classes of what cannot be told apart, the 90 % set.

Probabilities hold if the cause is in the library, and as far as their temperature and the share of
evidence that misleads are calibrated.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from scipy.special import logsumexp, softmax
from scipy.stats import norm

from scapulohumeral.gap.attribute import Fit, distance
from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.person import freed_of_prior
from scapulohumeral.gap.result import (
    JOIN,
    NO_GAP,
    NONE,
    Amplitude,
    Candidate,
    Detectable,
    EffectClass,
    Entered,
    NextTrial,
)

APART = 0.95
COVERAGE = 0.9
POWER = 0.8
# Candidates below this probability are not compared with each other, nor more than so many.
NEGLIGIBLE = 0.01
COMPARED = 10
AT_BOUND = 1e-6
# Effects and places that a hint names.
PLACES = 2
# Prior share of two effects at once, over all pairs: less than there are, because in opened blind
# cases of one effect a second one that was not there gained up to 14 units of log evidence.
PAIRS = 0.03
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
DETECTION_ERROR = 0.05


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


@dataclass(frozen=True)
class Posterior:
    """Probabilities of all hypotheses: of labels, of none of these, and of no gap."""

    labels: Mapping[str, float]
    none: float
    no_gap: float


def priors(effects: Sequence[Effect], reserved: float) -> dict[str, float]:
    """Prior of each effect: families share what is not reserved, members share their family's."""
    families: dict[tuple[str, str], list[str]] = {}
    for effect in effects:
        families.setdefault((effect.side, effect.family), []).append(effect.label)
    each = (1.0 - reserved) / len(families)
    return {label: each / len(labels) for labels in families.values() for label in labels}


def pair_priors(single: Mapping[str, float], reserved: float) -> dict[str, float]:
    """Prior of two labels at once: all possible pairs share theirs, not only those looked at."""
    share = PAIRS * 2.0 / (1.0 - reserved) ** 2
    return {
        JOIN.join(sorted(both)): share * single[both[0]] * single[both[1]]
        for both in combinations(single, 2)
    }


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


def credible_set(found: Posterior) -> tuple[str, ...]:
    """The most probable answers that together reach 90 % of the posterior probability.

    A credible set: nothing outside of the model of the case vouches for how often it holds the
    truth, which the score card of blind cases measures.
    """
    every = {**found.labels, NONE: found.none, NO_GAP: found.no_gap}
    ordered = sorted(every, key=lambda label: -every[label])
    total = np.cumsum([every[label] for label in ordered])
    return tuple(ordered[: int(np.searchsorted(total, COVERAGE) + 1)])


def amplitudes(fitted: Fit, temperature: float) -> tuple[Amplitude, ...]:
    """Parameters with 95 % intervals, in their units, as the data alone have them.

    Intervals are tempered like probabilities: a likelihood to the power of 1 / temperature is wider
    by its square root.
    """
    params = [p for effect in fitted.hypothesis.effects for p in effect.params]
    low, high = fitted.hypothesis.bounds
    values, variance = freed_of_prior(fitted)
    halves = 1.96 * np.sqrt(temperature * variance)
    bound = _on_bound(fitted, values)
    rows = []
    for i, param in enumerate(params):
        x = float(values[i])
        ends = sorted(
            param.physical(float(np.clip(x + sign * halves[i], low[i], high[i])))
            for sign in (-1.0, 1.0)
        )
        value = param.physical(x)
        rows.append(Amplitude(param.name, value, (ends[0], ends[1]), param.unit, bool(bound[i])))
    return tuple(rows)


def likely(fits: Sequence[Fit], found: Posterior) -> list[Fit]:
    """Fits that are not negligible, the most probable first, at most `COMPARED`."""
    kept = [f for f in fits if found.labels[f.label] >= NEGLIGIBLE]
    return sorted(kept, key=lambda f: -found.labels[f.label])[:COMPARED]


def classes(fits: Sequence[Fit], apart: np.ndarray) -> list[list[str]]:
    """Labels that these trials cannot tell apart, by complete linkage in the order of the fits.

    `apart` is made by :func:`separability`.
    """
    groups: list[list[int]] = []
    for i in range(len(fits)):
        home = next((g for g in groups if all(apart[i, k] < APART for k in g)), None)
        if home is None:
            groups.append([i])
        else:
            home.append(i)
    return [[fits[i].label for i in group] for group in groups]


def separability(
    fits: Sequence[Fit], comparison: Comparison, relative_error: float, temperature: float
) -> np.ndarray:
    """Probability that these trials tell two fitted hypotheses apart, symmetric.

    Phi(d / 2) with d the distance, in units of noise and signature error, that the better of both
    refits leaves: two normal distributions at this distance are told apart as often. It is tempered
    like probabilities and intervals: evidence for one of both counts less than it claims.
    """
    count = len(fits)
    result = np.full((count, count), 0.5)
    for i in range(count):
        for k in range(i):
            d = min(
                distance(fits[i], fits[k].hypothesis, comparison, relative_error),
                distance(fits[k], fits[i].hypothesis, comparison, relative_error),
            )
            result[i, k] = result[k, i] = float(norm.cdf(0.5 * d / np.sqrt(temperature)))
    return result


def next_trial(
    fits: Sequence[Fit],
    group: Sequence[str],
    comparison: Comparison,
    relative_error: float,
    temperature: float,
) -> NextTrial | None:
    """Recorded task whose repetition would best tell the first two effects of a class apart.

    Parameters
    ----------
    fits : the most probable first; group : labels of the class of the first
    comparison : what was explained; relative_error : of predicted changes
    temperature : as for :func:`posterior`

    Returns
    -------
    NextTrial | None     with as many further test and reference trials of the task, which halve its
                         noise but not what sessions change; None if the first stands alone
    """
    pair = [f for f in fits if f.label in group][:2]
    if len(pair) < 2:
        return None

    def apart(task: str) -> float:
        rows = np.ix_(comparison.rows([task]), comparison.rows([task]))
        noise, covariance = comparison.noise.copy(), comparison.covariance.copy()
        noise[rows] *= 0.5
        covariance[rows] -= noise[rows]
        more = replace(comparison, noise=noise, covariance=covariance)
        return float(separability(pair, more, relative_error, temperature)[0, 1])

    found = {task: apart(task) for task in comparison.tasks}
    best = max(found, key=lambda task: found[task])
    return NextTrial(best, tuple(f.label for f in pair), found[best])


def hint(rows: Sequence[Candidate], found: Posterior, enters: Sequence[Entered]) -> str | None:
    """What none of the known effects resembles most, and where it enters; no verdict."""
    if found.none < max(found.labels.values()):
        return None
    near = " and ".join(
        f"{row.label} (leaves {100.0 * row.unexplained_share:.0f} % unexplained)"
        for row in rows[:PLACES]
    )
    largest = sorted(enters, key=lambda region: -region.share)[:PLACES]
    where = f"; it enters most at {', '.join(r.name for r in largest)}" if largest else ""
    return f"the closest known effects are {near}{where}"


def candidates(
    fits: Sequence[Fit],
    found: Posterior,
    groups: Sequence[Sequence[str]],
    agreement: Mapping[str, float | None],
    reducible: tuple[float, float],
    temperature: float,
) -> tuple[Candidate, ...]:
    """All hypotheses as candidates, the most probable first.

    `reducible` are sums of squares of the whitened difference, and of what no smooth cause explains
    of it.
    """
    home = {label: i + 1 for i, group in enumerate(groups) for label in group}
    rows = [
        Candidate(
            label=f.label,
            level=_level(f.label, groups),
            p=found.labels[f.label],
            class_id=home.get(f.label),
            unexplained_share=_share_left(f.left, *reducible),
            task_agreement_p=agreement.get(f.label),
            parameters=amplitudes(f, temperature),
        )
        for f in fits
    ]
    return tuple(sorted(rows, key=lambda row: -row.p))


def _level(label: str, groups: Sequence[Sequence[str]]) -> str:
    """How deep side/family/member is resolved: as far as the mates in the class agree.

    A pair that holds the label too does not contradict it.
    """
    group = next((group for group in groups if label in group), [label])
    mates = [mate for mate in group if mate == label or label not in mate.split(JOIN)]
    for depth, name in ((3, "member"), (2, "family")):
        if len({"/".join(mate.split("/")[:depth]) for mate in mates}) == 1:
            return name
    return "side"


def effect_classes(
    groups: Sequence[Sequence[str]], found: Posterior, splitting: Mapping[str, str]
) -> tuple[EffectClass, ...]:
    """Classes in words, with what would split them."""
    rows = []
    for i, group in enumerate(groups):
        p = [found.labels[label] for label in group]
        text = f"{group[0]} stands alone: these trials tell it from the others."
        if len(group) > 1:
            text = (
                f"{' or '.join(group)}; these trials cannot tell. "
                f"What would: {splitting.get(group[0], 'each effect alone')}."
            )
        rows.append(EffectClass(i + 1, tuple(group), float(sum(p)), max(p) / sum(p), text))
    return tuple(rows)


def smallest_detectable(
    fits: Sequence[Fit], comparison: Comparison, families: int
) -> tuple[Detectable, ...]:
    """Primary amplitudes that a test of each effect would find with power 0.8."""
    needed = norm.isf(DETECTION_ERROR / (2.0 * families)) + norm.ppf(POWER)
    rows = []
    for f in fits:
        if len(f.hypothesis.effects) > 1:
            continue
        param = f.hypothesis.effects[0].params[0]
        size = float(np.linalg.norm(comparison.whiten(f.hypothesis.slope[:, 0])))
        low, high = param.bounds
        internal = needed / max(size, 1e-12) * (1.0 if high > 0.0 else -1.0)
        if low <= internal <= high:
            value = param.physical(float(internal))
            rows.append(Detectable(f.label, param.name, value, param.unit, POWER))
    return tuple(rows)
