"""All explanations of a difference: effects, the strongest solved again, and pairs of two."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.attribute import Fit, Hypothesis, SignatureError, fit, pair, strongest
from scapulohumeral.gap.evidence import Evidence
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.refit import refit
from scapulohumeral.gap.workers import side_by_side

log = logging.getLogger(__name__)

# Effects that others join in pairs, and others tried with each.
LEADERS, PARTNERS = 3, 12


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
    jobs = [(f, c, evidence.responses, model, evidence.recorder, settings) for f in again]
    for before, after in zip(again, side_by_side(_refit_or_keep, jobs, threads), strict=True):
        if after is None:
            warnings.append(f"{before.label}: not solved again; its amplitude is a linear estimate")
        elif after.log_evidence > before.log_evidence:
            fits[before.label] = after
    singles = list(fits.values())
    leaders = strongest(singles, evidence.prior, LEADERS)
    return [*singles, *paired(leaders, singles, c, settings.signature_error)]


def paired(
    leaders: Sequence[Fit], singles: Sequence[Fit], comparison: Comparison, relative_error: float
) -> list[Fit]:
    """Each leader with the effects of other families that explain most of what it leaves."""
    found: dict[str, Fit] = {}
    for leader in leaders:
        error = leader.hypothesis.error(leader.x, comparison, relative_error)
        left = comparison.whiten(comparison.delta - leader.predicted)
        family = leader.hypothesis.effects[0].family
        others = [f for f in singles if f.hypothesis.effects[0].family != family]
        gains = {f.label: _gain(f.hypothesis, left, error, comparison) for f in others}
        for other in sorted(others, key=lambda f: -gains[f.label])[:PARTNERS]:
            both = pair(leader, other)
            if both.label not in found:
                found[both.label] = fit(both, comparison, relative_error)
    return list(found.values())


def _gain(
    hypothesis: Hypothesis, left: np.ndarray, error: SignatureError, comparison: Comparison
) -> float:
    """Log density that an effect inside its bounds adds to whitened residuals (D,).

    The error of its own prediction is left out.
    """
    slope = comparison.whiten(hypothesis.slope)
    weighted = error.solve(slope)
    right = weighted.T @ left
    normal = slope.T @ weighted + np.diag(hypothesis.prior_sd**-2.0)
    x = np.clip(np.linalg.solve(normal, right), *hypothesis.bounds)
    return float(right @ x - 0.5 * x @ normal @ x)


def _refit_or_keep(first: Fit, *arguments: Any) -> Fit | None:
    """A refit, or None where a movement with the effect has no solution."""
    try:
        return refit(first, *arguments)
    except SolveError as error:
        log.info("%s: %s", first.label, error)
        return None
