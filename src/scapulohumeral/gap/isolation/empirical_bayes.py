"""What a case is decided from, and what is most probable of the person, sessions and errors.

Letters: D coefficients, P parameters.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.recording.observables import Recorder
from scapulohumeral.gap.residual.differences import TrialDifference
from scapulohumeral.gap.residual.noise import Noise, total_covariance
from scapulohumeral.gap.residual.residual import Comparison
from scapulohumeral.gap.residual.unknown_input import Disturbances, black_box_evidence
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import Response

log = logging.getLogger(__name__)

DENSITY = attrgetter("density")

# Shares of what sessions are assumed to change, and of the signature error: the most probable ones
# are taken. Some people repeat themselves better than others, and laboratories their preparations;
# and the model resembles some people more than others.
SESSION_SHARES = (1.0, 0.5, 0.25)
ERROR_SHARES = (1.0, 1.0 / 3.0)
# Units of log density within which another firmness is kept beside the most probable one: what
# decides between them may be known only once the strongest effects are solved again.
CLOSE = 3.0


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the decision is made from.

    Attributes
    ----------
    comparison : difference to explain; trials : of single test trials
    noise : between repeats
    effects, prior : the library and the prior of its labels, alone and in pairs
    recorder : what is recorded
    responses : nominal solutions
    boxes : smooth disturbances
    referenced : whether the difference is that to reference trials, else to the prediction
    session_share : most probable share of what sessions are assumed to change
    settings : those of the diagnosis, with the most probable signature error
    persons : all effects fitted to derivatives at the nominal solutions, for each firmness with
        which the person may keep the movement, the most probable first
    """

    comparison: Comparison
    trials: tuple[TrialDifference, ...]
    noise: Noise
    effects: tuple[Effect, ...]
    prior: dict[str, float]
    recorder: Recorder
    responses: tuple[Response, ...]
    boxes: Disturbances
    referenced: bool
    session_share: float
    settings: GapSettings
    persons: tuple[tuple[Fit, ...], ...]

    @property
    def screened(self) -> tuple[Fit, ...]:
        """Fits of all effects on the most probable person."""
        return self.persons[0]


def most_probable(evidence: Evidence, known: Mapping[float, tuple[Hypothesis, ...]]) -> Evidence:
    """Evidence with what is most probable of the person, the sessions and the signature error.

    Parameters
    ----------
    evidence : without effects; known : effects by firmness. Without reference trials that is the
        loosest: the prediction follows the recording, however firmly that was kept

    Notes
    -----
    All sessions are tried for the loosest; for firmer ones only if these are more probable with the
    one that was found for it.
    """
    # Without reference trials the model's own error counts far more than what sessions change.
    shares = SESSION_SHARES if evidence.referenced else SESSION_SHARES[:1]
    every = [(share, error) for share in shares for error in ERROR_SHARES]

    def best_of(hypotheses: Sequence[Hypothesis], errors: Sequence[tuple[float, float]]) -> _Tried:
        return max((_tried(evidence, hypotheses, *pair) for pair in errors), key=DENSITY)

    loosest, *firmer = known.values()
    tried = [best_of(loosest, every)]
    for hypotheses in firmer:
        best = max(tried, key=DENSITY)
        alike = [errors for errors in every if errors[0] == best.evidence.session_share]
        first = best_of(hypotheses, alike)
        if first.density > best.density:
            others = [errors for errors in every if errors not in alike]
            first = max(first, best_of(hypotheses, others), key=DENSITY)
        tried.append(first)
    best, *less = sorted(tried, key=DENSITY, reverse=True)
    found = best.evidence
    rivals = (
        _screened(found, [f.hypothesis for f in one.evidence.screened])
        for one in less
        if one.density > best.density - CLOSE
    )
    singles = (replace(t, comparison=_supposed(found, t.comparison)) for t in found.trials)
    return replace(found, trials=tuple(singles), persons=(found.screened, *rivals))


class _Tried(NamedTuple):
    """Evidence with something assumed, and its log density."""

    density: float
    evidence: Evidence


def _tried(
    evidence: Evidence, hypotheses: Sequence[Hypothesis], session: float, error: float
) -> _Tried:
    """Evidence with shares of what sessions change and of the signature error, screened."""
    evidence = replace(
        evidence,
        session_share=session,
        settings=replace(
            evidence.settings, signature_error=error * evidence.settings.signature_error
        ),
    )
    supposed = replace(evidence, comparison=_supposed(evidence, evidence.comparison))
    supposed = replace(supposed, persons=(_screened(supposed, hypotheses),))
    found = _Tried(_density(supposed), supposed)
    firmness = hypotheses[0].firmness
    log.info("firmness %g, session %g, error %g: %.1f", firmness, session, error, found.density)
    return found


def _screened(evidence: Evidence, hypotheses: Sequence[Hypothesis]) -> tuple[Fit, ...]:
    """Effects fitted to derivatives at the nominal solutions."""
    error = evidence.settings.signature_error
    return tuple(fit(hypothesis, evidence.comparison, error) for hypothesis in hypotheses)


def _supposed(evidence: Evidence, c: Comparison) -> Comparison:
    """A comparison with what sessions change, and without reference the model's own error."""
    model = None if evidence.referenced else (evidence.settings.model, c.channels)
    responses = [r for r in evidence.responses if r.task in c.tasks]
    share = evidence.session_share
    covariance = total_covariance(c.noise, responses, c.functions, model, share)
    return replace(c, covariance=covariance)


def _density(evidence: Evidence) -> float:
    """Log density of the difference, over all explanations.

    Pairs are among them, or what one of two effects leaves would count as an error.
    """
    c, settings = evidence.comparison, evidence.settings
    pairs = paired(evidence.screened, evidence.prior, c, settings.signature_error)
    known = [*evidence.screened, *pairs]
    logs = [f.log_evidence + np.log(evidence.prior[f.label]) for f in known]
    logs.append(black_box_evidence(c, evidence.boxes.columns) + np.log(settings.prior_none))
    logs.append(no_gap_evidence(c) + np.log(settings.prior_no_gap))
    _, logdet = np.linalg.slogdet(c.covariance)
    return float(logsumexp(logs) - 0.5 * logdet)
