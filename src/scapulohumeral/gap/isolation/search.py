"""All explanations of a difference: effects, the strongest solved again, and pairs of two."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, of_person
from scapulohumeral.gap.isolation.hypothesis import Fit, strongest
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.refit import refit
from scapulohumeral.gap.isolation.suppositions import Supposition, integrated, supposed
from scapulohumeral.gap.labels import family
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.parallel import side_by_side

log = logging.getLogger(__name__)

# Units of log evidence below the most probable supposition within which pairs are looked for.
CLOSE = 3.0
# A predicted change below this length, in units of the noise, is nothing that solving again would
# make larger.
INVISIBLE = 0.5


@dataclass(frozen=True, eq=False)
class Explanations:
    """All effects and pairs, fitted.

    Attributes
    ----------
    every : under any supposition
    integrated : of each label the fit under its most probable supposition, with evidence over all
    """

    every: tuple[Fit, ...]
    integrated: tuple[Fit, ...]


def screened_only(evidence: Evidence) -> Explanations:
    """Effects at the nominal solutions, where there is no gap to explain."""
    every = tuple(f for fits in evidence.fits.values() for f in fits)
    return Explanations(every, tuple(integrated(every, evidence.suppositions)))


def fit_all(
    evidence: Evidence, model: ParticipantModel, threads: int, warnings: list[str]
) -> Explanations:
    """All effects; the strongest fitted by solving again; pairs with the strongest.

    Both a derivative and a new solution are approximations of what a person would do: of an effect
    that is solved again the fit with more evidence counts. First come the strongest of different
    families, then those that would be stronger if a new solution told as much of them as it told
    of their family.
    """
    by_person = dict(evidence.fits)
    # Without reference trials the prediction follows errors of the record: small, so linear.
    able = [f for f in evidence.screened if _may_change(f, evidence)]
    gains: dict[str, float] = {}
    done: set[str] = set()
    for count in _rounds(evidence.settings.short_list):
        again = _next(able, evidence, gains, done, count)
        done |= {f.label for f in again}
        log.info("solved again: %s", ", ".join(f"{f.label} {tuple(supposed(f))}" for f in again))
        jobs = [(_alternatives(f, evidence), evidence, model) for f in again]
        for first, solved in zip(again, side_by_side(_refit_any, jobs, threads), strict=True):
            if solved is None:
                warnings.append(
                    f"{first.label}: not solved again; its amplitude is a linear estimate"
                )
                continue
            one = supposed(solved)
            by_person[one] = tuple(_better(f, solved) for f in by_person[one])
            gain = solved.log_evidence - _alternatives(first, evidence)[0].log_evidence
            gains[family(first.label)] = max(gain, gains.get(family(first.label), 0.0))
    singles = tuple(f for fits in by_person.values() for f in fits)
    pairs = tuple(f for one in _probable(evidence) for f in _pairs(evidence, by_person, one))
    every = (*singles, *pairs)
    return Explanations(every, tuple(integrated(every, evidence.suppositions)))


def _rounds(count: int) -> tuple[int, int]:
    """How many effects are solved again at first, and once it is known what that tells."""
    return (count + 1) // 2, count // 2


def _next(
    able: Sequence[Fit],
    evidence: Evidence,
    gains: Mapping[str, float],
    done: set[str],
    count: int,
) -> list[Fit]:
    """The effects to be solved again next, the strongest first.

    Parameters
    ----------
    able : effects that a new solution may change
    gains : by family, log evidence that a new solution has added; empty at first
    done : labels that were solved again
    """
    left = [f for f in able if f.label not in done]
    expected = [f.with_evidence(f.log_evidence + gains.get(family(f.label), 0.0)) for f in left]
    ranked = strongest(expected, evidence.prior, len(expected))
    if not done:
        best = {family(f.label): f for f in reversed(ranked)}
        ranked = [f for f in ranked if best[family(f.label)] is f]
    labels = [f.label for f in ranked[:count]]
    return [f for f in left if f.label in labels]


def _may_change(first: Fit, evidence: Evidence) -> bool:
    """Whether solving again may say more than the derivative."""
    [effect] = first.hypothesis.effects
    residual = evidence.residuals[first.moved_deg]
    visible = float(sum(residual.whiten(first.predicted) ** 2)) > INVISIBLE**2
    return visible and (evidence.referenced or effect.changes_body)


def _alternatives(first: Fit, evidence: Evidence) -> list[Fit]:
    """Fits of a label to be solved again: the most probable, and with the next stiffness.

    Who keeps a movement firmly may have no solution with an effect that another person has.
    """
    same = [f for fits in evidence.fits.values() for f in fits if f.label == first.label]
    ranked = sorted(same, key=lambda f: -f.log_evidence)
    stiffness = ranked[0].hypothesis.stiffness
    other = next((f for f in ranked if f.hypothesis.stiffness != stiffness), None)
    return [ranked[0]] if other is None else [ranked[0], other]


def _better(first: Fit, solved: Fit) -> Fit:
    """The one with more evidence of two fits of one label; the first of another label."""
    same = first.label == solved.label
    return solved if same and solved.log_evidence > first.log_evidence else first


def _probable(evidence: Evidence) -> list[Supposition]:
    """Suppositions under which some effect is nearly as probable as under any."""
    best = {
        one: max(f.log_evidence for f in of_person(evidence.fits, one)) for one in evidence.fits
    }
    return [one for one, value in best.items() if value > max(best.values()) - CLOSE]


def _pairs(
    evidence: Evidence, by_person: dict[Supposition, tuple[Fit, ...]], one: Supposition
) -> list[Fit]:
    fits = of_person(by_person, one)
    residual = evidence.residuals[one.moved_deg]
    found = paired(fits, evidence.prior, residual, evidence.settings.signature_error)
    # Pairs on the record alone are the same however firmly the movement is kept.
    first = next(iter(evidence.known))
    return [
        f
        for f in found
        if one.stiffness == first or any(e.changes_body for e in f.hypothesis.effects)
    ]


def _refit_any(fits: Sequence[Fit], evidence: Evidence, model: ParticipantModel) -> Fit | None:
    """The first of some fits that can be solved again, or None."""
    for first in fits:
        residual = evidence.residuals[first.moved_deg]
        what = evidence.signatures, model, evidence.sensors, evidence.settings
        solved = _refit_or_keep(first, residual, *what)
        if solved is not None:
            return solved
    return None


def _refit_or_keep(first: Fit, *arguments: Any) -> Fit | None:
    """A refit, or None where a movement with the effect has no solution."""
    try:
        return refit(first, *arguments)
    except SolveError as error:
        log.info("%s: %s", first.label, error)
        return None
