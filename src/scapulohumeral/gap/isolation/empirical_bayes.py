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
from scapulohumeral.gap.recording.observables import SensorSetup
from scapulohumeral.gap.residual.differences import TrialDifference
from scapulohumeral.gap.residual.noise import Noise, total_covariance
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import UnknownInputs, unknown_input_evidence
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

log = logging.getLogger(__name__)

DENSITY = attrgetter("density")

# Shares of what sessions are assumed to change, and of the signature error: the most probable ones
# are taken. Some people repeat themselves better than others, and laboratories their preparations;
# and the model resembles some people more than others.
SESSION_SHARES = (1.0, 0.5, 0.25)
ERROR_SHARES = (1.0, 1.0 / 3.0)
# Units of log density within which another stiffness is kept beside the most probable one: what
# decides between them may be known only once the strongest effects are solved again.
CLOSE = 3.0


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the decision is made from.

    Attributes
    ----------
    residual : difference to explain; trials : of single test trials
    noise : between repeats
    effects, prior : the library and the prior of its labels, alone and in pairs
    sensors : what is recorded
    signatures : nominal solutions
    unknown_inputs : smooth disturbances
    referenced : whether the difference is that to reference trials, else to the prediction
    session_share : most probable share of what sessions are assumed to change
    settings : those of the diagnosis, with the most probable signature error
    fits_by_stiffness : all effects fitted to derivatives at the nominal solutions, for each
        stiffness with which the person may keep the movement, the most probable first
    """

    residual: Residual
    trials: tuple[TrialDifference, ...]
    noise: Noise
    effects: tuple[Effect, ...]
    prior: dict[str, float]
    sensors: SensorSetup
    signatures: tuple[TaskSignatures, ...]
    unknown_inputs: UnknownInputs
    referenced: bool
    session_share: float
    settings: GapSettings
    fits_by_stiffness: tuple[tuple[Fit, ...], ...]

    @property
    def screened(self) -> tuple[Fit, ...]:
        """Fits of all effects on the most probable person."""
        return self.fits_by_stiffness[0]


def most_probable(evidence: Evidence, known: Mapping[float, tuple[Hypothesis, ...]]) -> Evidence:
    """Evidence with what is most probable of the person, the sessions and the signature error.

    Parameters
    ----------
    evidence : without effects; known : effects by stiffness. Without reference trials that is the
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
    less_probable = (
        _screened(found, [f.hypothesis for f in one.evidence.screened])
        for one in less
        if one.density > best.density - CLOSE
    )
    singles = (replace(t, residual=_supposed(found, t.residual)) for t in found.trials)
    return replace(found, trials=tuple(singles), fits_by_stiffness=(found.screened, *less_probable))


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
    supposed = replace(evidence, residual=_supposed(evidence, evidence.residual))
    supposed = replace(supposed, fits_by_stiffness=(_screened(supposed, hypotheses),))
    found = _Tried(_density(supposed), supposed)
    stiffness = hypotheses[0].stiffness
    log.info("stiffness %g, session %g, error %g: %.1f", stiffness, session, error, found.density)
    return found


def _screened(evidence: Evidence, hypotheses: Sequence[Hypothesis]) -> tuple[Fit, ...]:
    """Effects fitted to derivatives at the nominal solutions."""
    error = evidence.settings.signature_error
    return tuple(fit(hypothesis, evidence.residual, error) for hypothesis in hypotheses)


def _supposed(evidence: Evidence, c: Residual) -> Residual:
    """A comparison with what sessions change, and without reference the model's own error."""
    model = None if evidence.referenced else (evidence.settings.model, c.channels)
    signatures = [r for r in evidence.signatures if r.task in c.tasks]
    share = evidence.session_share
    covariance = total_covariance(c.noise, signatures, c.functions, model, share)
    return replace(c, covariance=covariance)


def _density(evidence: Evidence) -> float:
    """Log density of the difference, over all explanations.

    Pairs are among them, or what one of two effects leaves would count as an error.
    """
    c, settings = evidence.residual, evidence.settings
    pairs = paired(evidence.screened, evidence.prior, c, settings.signature_error)
    known = [*evidence.screened, *pairs]
    logs = [f.log_evidence + np.log(evidence.prior[f.label]) for f in known]
    logs.append(
        unknown_input_evidence(c, evidence.unknown_inputs.columns) + np.log(settings.prior_none)
    )
    logs.append(no_gap_evidence(c) + np.log(settings.prior_no_gap))
    _, logdet = np.linalg.slogdet(c.covariance)
    return float(logsumexp(logs) - 0.5 * logdet)
