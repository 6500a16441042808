"""All explanations of a difference: effects, the strongest solved again, and pairs of two."""

from __future__ import annotations

import logging
from typing import Any

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.attribute import Fit, strongest
from scapulohumeral.gap.evidence import Evidence
from scapulohumeral.gap.pairs import paired
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.refit import refit
from scapulohumeral.gap.workers import side_by_side

log = logging.getLogger(__name__)


def fit_all(
    evidence: Evidence, model: ParticipantModel, threads: int, warnings: list[str]
) -> list[Fit]:
    """All effects; the strongest fitted by solving again; pairs with the strongest.

    Both a derivative and a new solution are approximations of what a person would do: of an effect
    that is solved again the fit with more evidence counts.
    """
    c, settings = evidence.comparison, evidence.settings
    fits = {f.label: f for f in evidence.screened}
    short = strongest(evidence.screened, evidence.prior, settings.short_list)
    log.info("short list: %s", ", ".join(f.label for f in short))
    # Without reference trials the prediction follows errors of the record: small, so linear.
    again = [f for f in short if evidence.referenced or f.hypothesis.effects[0].changes_body]
    person = (model, evidence.recorder, evidence.firmness)
    jobs = [(f, c, evidence.responses, *person, settings) for f in again]
    for before, after in zip(again, side_by_side(_refit_or_keep, jobs, threads), strict=True):
        if after is None:
            warnings.append(f"{before.label}: not solved again; its amplitude is a linear estimate")
        elif after.log_evidence > before.log_evidence:
            fits[before.label] = after
    singles = list(fits.values())
    return [*singles, *paired(singles, evidence.prior, c, settings.signature_error)]


def _refit_or_keep(first: Fit, *arguments: Any) -> Fit | None:
    """A refit, or None where a movement with the effect has no solution."""
    try:
        return refit(first, *arguments)
    except SolveError as error:
        log.info("%s: %s", first.label, error)
        return None
