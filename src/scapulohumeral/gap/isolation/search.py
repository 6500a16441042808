"""All explanations of a difference: effects, the strongest solved again, and pairs of two."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from itertools import chain
from typing import Any

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.hypothesis import Fit, strongest
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.refit import refit
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.parallel import side_by_side

log = logging.getLogger(__name__)


def fit_all(
    evidence: Evidence, model: ParticipantModel, threads: int, warnings: list[str]
) -> list[Fit]:
    """All effects; the strongest fitted by solving again; pairs with the strongest.

    Both a derivative and a new solution are approximations of what a person would do: of an effect
    that is solved again the fit with more evidence counts. So it does of an effect, or a pair, on
    persons who keep the movement with one stiffness or another.
    """
    c, settings = evidence.residual, evidence.settings
    short = strongest(
        _most_evident(evidence.fits_by_stiffness), evidence.prior, settings.short_list
    )
    # Without reference trials the prediction follows errors of the record: small, so linear.
    listed = [f.label for f in short if evidence.referenced or f.hypothesis.effects[0].changes_body]
    log.info("solved again: %s", ", ".join(listed))
    again = [f for fits in evidence.fits_by_stiffness for f in fits if f.label in listed]
    jobs = [(f, c, evidence.signatures, model, evidence.sensors, settings) for f in again]
    found = side_by_side(_refit_or_keep, jobs, threads)
    solved = {before: after for before, after in zip(again, found, strict=True) if after}
    for label in sorted({f.label for f in again} - {f.label for f in solved}):
        warnings.append(f"{label}: not solved again; its amplitude is a linear estimate")
    fits_by_stiffness = [
        _most_evident([fits, [solved[f] for f in fits if f in solved]])
        for fits in evidence.fits_by_stiffness
    ]
    pairs = [
        paired(fits, evidence.prior, c, settings.signature_error) for fits in fits_by_stiffness
    ]
    return _most_evident([*fits_by_stiffness, *pairs])


def _most_evident(every: Iterable[Iterable[Fit]]) -> list[Fit]:
    """Of each label the fit with most evidence."""
    best: dict[str, Fit] = {}
    for f in chain.from_iterable(every):
        if f.label not in best or f.log_evidence > best[f.label].log_evidence:
            best[f.label] = f
    return list(best.values())


def _refit_or_keep(first: Fit, *arguments: Any) -> Fit | None:
    """A refit, or None where a movement with the effect has no solution."""
    try:
        return refit(first, *arguments)
    except SolveError as error:
        log.info("%s: %s", first.label, error)
        return None
