"""All explanations of a difference: effects, the strongest solved again, and pairs of two."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import Any

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, of_person
from scapulohumeral.gap.isolation.hypothesis import Fit, strongest
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.refit import refit
from scapulohumeral.gap.isolation.suppositions import Supposition, integrated, supposed
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
    that is solved again the fit with more evidence counts.
    """
    by_person = dict(evidence.fits)
    short = strongest(evidence.screened, evidence.prior, evidence.settings.short_list)
    # Without reference trials the prediction follows errors of the record: small, so linear.
    again = [f for f in short if _may_change(f, evidence)]
    log.info("solved again: %s", ", ".join(f"{f.label} {tuple(supposed(f))}" for f in again))
    jobs = [
        (
            f,
            evidence.residuals[f.moved_deg],
            evidence.signatures,
            model,
            evidence.sensors,
            evidence.settings,
        )
        for f in again
    ]
    for first, solved in zip(again, side_by_side(_refit_or_keep, jobs, threads), strict=True):
        if solved is None:
            warnings.append(f"{first.label}: not solved again; its amplitude is a linear estimate")
            continue
        one = supposed(first)
        by_person[one] = tuple(_better(f, solved) for f in by_person[one])
    singles = tuple(f for fits in by_person.values() for f in fits)
    pairs = tuple(f for one in _probable(evidence) for f in _pairs(evidence, by_person, one))
    every = (*singles, *pairs)
    return Explanations(every, tuple(integrated(every, evidence.suppositions)))


def _may_change(first: Fit, evidence: Evidence) -> bool:
    """Whether solving again may say more than the derivative."""
    [effect] = first.hypothesis.effects
    residual = evidence.residuals[first.moved_deg]
    visible = float(sum(residual.whiten(first.predicted) ** 2)) > INVISIBLE**2
    return visible and (evidence.referenced or effect.changes_body)


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


def _refit_or_keep(first: Fit, *arguments: Any) -> Fit | None:
    """A refit, or None where a movement with the effect has no solution."""
    try:
        return refit(first, *arguments)
    except SolveError as error:
        log.info("%s: %s", first.label, error)
        return None
