"""What a case is decided from, and what is most probable of sessions and of the model's errors.

Letters: D coefficients, P parameters.
"""

from __future__ import annotations

import logging
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.special import logsumexp

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.suppositions import (
    Supposition,
    integrated,
    log_weight_of_size,
)
from scapulohumeral.gap.labels import GLR, MOVED, NO_GAP, NONE, ON_RECORD
from scapulohumeral.gap.recording.observables import SensorSetup
from scapulohumeral.gap.residual.differences import Fold, Records
from scapulohumeral.gap.residual.noise import (
    Noise,
    Scattering,
    SessionShares,
    log_density_of_scatter,
    scattered,
    scatterings,
    smooth_share,
    total_covariance,
)
from scapulohumeral.gap.residual.other_movement import SIZES_DEG, other_movement
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import UnknownInputs, unknown_input_evidence
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

log = logging.getLogger(__name__)

# Shares of what sessions are assumed to change, and of the signature error: the most probable ones
# are taken. Some people repeat themselves better than others, and laboratories their preparations;
# and the model resembles some people more than others.
SESSION_SHARES = (1.0, 0.5, 0.25)
ERROR_SHARES = (1.0, 1.0 / 3.0)
# How much more or less repeats may scatter than they say, as factors: the second where the first is
# more probable than none, else the third.
SCATTER = (1.4, 2.0, 0.7)

Fits = Mapping[Supposition, tuple[Fit, ...]]


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the decision is made from.

    Attributes
    ----------
    residuals : difference to explain, by the supposed size of another movement [deg]; with 0 the
        movement was the same
    cautious : the same movement, with all that sessions are assumed to change: whether there is a
        gap is asked of it, because what is most probable of the sessions is least where the gap is
    folds : trials that are left out, with what they differ by without a cause
    halves : differences of two halves of the test trials, if all tasks have two
    noise : between repeats
    effects, prior : the library and the prior of its labels, alone and in pairs
    records : of the tasks that are compared, at one tempo
    signatures : nominal solutions
    unknown_inputs : smooth disturbances
    session_shares : most probable shares of what sessions are assumed to change
    scatter : most probable factor of the scatter between repeats, by task and kind of channels
    settings : those of the diagnosis, with the most probable signature error
    known : all effects at the nominal solutions, by stiffness
    fits : all effects fitted to derivatives at the nominal solutions, under each supposition
    """

    residuals: Mapping[float, Residual]
    cautious: Residual
    folds: tuple[Fold, ...]
    halves: tuple[np.ndarray, ...]
    noise: Noise
    effects: tuple[Effect, ...]
    prior: dict[str, float]
    records: Records
    signatures: tuple[TaskSignatures, ...]
    unknown_inputs: UnknownInputs
    session_shares: SessionShares
    scatter: Mapping[Scattering, float]
    settings: GapSettings
    known: Mapping[float, tuple[Hypothesis, ...]]
    fits: Fits

    @property
    def sensors(self) -> SensorSetup:
        """What is recorded."""
        return self.records.sensors

    @property
    def referenced(self) -> bool:
        """Whether the difference is that to reference trials, else to the prediction."""
        return bool(self.records.reference)

    @property
    def of_one_person(self) -> bool:
        """Whether a person made both movements, who may keep them or make others."""
        return self.records.of_one_person

    @property
    def residual(self) -> Residual:
        """Difference to explain if the movement was the same."""
        return self.residuals[0.0]

    @property
    def without_cause(self) -> Residual:
        """The same with what it may be off by without any cause.

        Two simulations of another model answer otherwise to any cause, but do not differ without.
        """
        return self.cautious if self.settings.of_simulations else self.residual

    @property
    def suppositions(self) -> list[Supposition]:
        """All that is supposed of the person."""
        return [Supposition(f, size) for f in self.known for size in self.residuals]

    @cached_property
    def screened(self) -> list[Fit]:
        """Effects fitted to derivatives, each under its most probable supposition."""
        return integrated((f for fits in self.fits.values() for f in fits), self.suppositions)

    def shapes(self, without: Collection[str] = ()) -> dict[str, list[np.ndarray]]:
        """Slopes (D, P) of the effects that each test for a gap looks for, without some labels."""
        every = [f.hypothesis for f in self.screened if f.label not in without]
        spoiling = [one.slope for one in every if one.effects[0].spoils_motion]
        return {ON_RECORD: spoiling, GLR: [one.slope for one in every]}

    def others(self) -> dict[str, float]:
        """Log evidence of another movement alone, of none of these, and of no gap."""
        return others_of(self.residuals, self.unknown_inputs.columns)


def others_of(residuals: Mapping[float, Residual], columns: np.ndarray) -> dict[str, float]:
    """Log evidence of another movement alone, of none of these, and of no gap.

    Parameters
    ----------
    residuals : by the supposed size of another movement
    columns : (D, S) smooth unknown inputs
    """
    nothing = {size: no_gap_evidence(residual) for size, residual in residuals.items()}
    moved = [log for size, log in nothing.items() if size > 0.0]
    found = {NO_GAP: nothing[0.0], NONE: _smooth(residuals, columns)}
    if moved:
        found[MOVED] = float(logsumexp(moved) - np.log(len(moved)))
    return found


def _smooth(residuals: Mapping[float, Residual], columns: np.ndarray) -> float:
    """Log evidence of smooth unknown inputs, whether or not the movement was the same."""
    logs = [
        unknown_input_evidence(residual, columns) + log_weight_of_size(size, residuals, body=True)
        for size, residual in residuals.items()
    ]
    return float(logsumexp(logs))


@dataclass(frozen=True)
class ErrorShares:
    """How large errors are, over what is assumed.

    Attributes
    ----------
    markers, electrodes : shares of what sessions change
    signature : share of the signature error
    scatter : factor of the scatter between repeats, by task and kind of channels
    """

    markers: float
    electrodes: float
    signature: float
    scatter: Mapping[Scattering, float]


def as_assumed(evidence: Evidence) -> ErrorShares:
    """Errors as large as they are assumed to be."""
    return ErrorShares(1.0, 1.0, 1.0, dict.fromkeys(scatterings(evidence.residual), 1.0))


def most_probable(evidence: Evidence) -> Evidence:
    """Evidence with the most probable sizes of errors: of sessions, of predictions, of repeats.

    Their density is that of the difference with all explanations, pairs included, or what one of
    two effects leaves would count as an error. They are tried one after the other, with the size of
    another movement that is most probable before: they hardly depend on each other.
    """
    loosest = next(iter(evidence.known))
    best = as_assumed(evidence)
    first = assumed(evidence, best)
    sizes = {s: _density(_with_fits(first, [Supposition(loosest, s)])) for s in first.residuals}
    size = max(sizes, key=lambda s: sizes[s])
    tried = _Tried(evidence, Supposition(loosest, size), best, sizes[size])
    for errors in _less_assumed(evidence):
        tried.better(**errors)
    for one in _scattering(evidence):
        more, most, less = ({one: factor} for factor in SCATTER)
        tried.scatters(most if tried.scatters(more) else less)
    log.info("another movement %g deg, %s: %.1f", size, tried.best, tried.density)
    found = assumed(evidence, tried.best)
    found = _with_fits(found, found.suppositions)
    parts = (replace(f, left_out=_single(found, f.left_out)) for f in found.folds)
    everything = replace(evidence, session_shares=SessionShares(1.0, 1.0))
    whole = _with_sessions(everything, evidence.residual)
    return replace(found, cautious=whole, folds=tuple(parts))


@dataclass
class _Tried:
    """The most probable sizes of errors so far, under one supposition, and their log density."""

    evidence: Evidence
    supposed: Supposition
    best: ErrorShares
    density: float

    def better(self, **changes: Any) -> bool:
        """Try other sizes; whether they are more probable, and kept."""
        errors = replace(self.best, **changes)
        one = _with_fits(assumed(self.evidence, errors), [self.supposed])
        density = _density(one) + _log_prior_of_scatter(self.evidence, errors.scatter)
        found = density > self.density
        if found:
            self.best, self.density = errors, density
        return found

    def scatters(self, factor: Mapping[Scattering, float]) -> bool:
        """The same of one factor of the scatter."""
        return self.better(scatter={**self.best.scatter, **factor})


def _less_assumed(evidence: Evidence) -> list[dict[str, float]]:
    """Smaller shares that are tried, by name of what they are of."""
    # Without reference trials the model's own error counts far more than what sessions change.
    sessions = SESSION_SHARES[1:] if evidence.referenced else ()
    electrodes = sessions if "emg" in {kind.name for kind in evidence.residual.kinds} else ()
    return [
        *({"electrodes": share} for share in electrodes),
        *({"markers": share} for share in sessions),
        *({"signature": share} for share in ERROR_SHARES[1:]),
    ]


def _scattering(evidence: Evidence) -> list[Scattering]:
    """What may scatter otherwise than told: without reference trials it counts as sessions do."""
    if not evidence.referenced or evidence.settings.of_simulations:
        return []
    return scatterings(evidence.residual)


def _log_prior_of_scatter(evidence: Evidence, scatter: Mapping[Scattering, float]) -> float:
    degrees = dict(zip(evidence.residual.tasks, evidence.residual.degrees, strict=True))
    return sum(log_density_of_scatter(f, degrees[one.task]) for one, f in scatter.items())


def assumed(evidence: Evidence, errors: ErrorShares) -> Evidence:
    """Evidence with sizes of errors assumed, by every size of another movement; not fitted yet."""
    signature = errors.signature * evidence.settings.signature_error
    evidence = replace(
        evidence,
        session_shares=SessionShares(errors.markers, errors.electrodes),
        scatter=errors.scatter,
        settings=replace(evidence.settings, signature_error=signature),
    )
    base = _compared(evidence, scattered(evidence.cautious, errors.scatter))
    residuals = {0.0: base}
    if evidence.of_one_person:
        unit = other_movement(base, evidence.signatures, signature)
        for size in SIZES_DEG:
            covariance = base.covariance + size**2 * unit
            residuals[size] = replace(base, covariance=covariance, moved_deg=size)
    return replace(evidence, residuals=residuals, fits={})


def _compared(evidence: Evidence, c: Residual) -> Residual:
    """A comparison with all that it may be off by: see :func:`_with_sessions`.

    Two simulations differ by next to nothing without a cause, but to any cause another model
    answers otherwise, by a share of the difference that is explained.
    """
    found = _with_sessions(evidence, c)
    if not evidence.settings.of_simulations:
        return found
    other = smooth_share(c.delta, c.functions, evidence.settings.signature_error)
    return replace(found, covariance=found.covariance + other)


def _with_sessions(evidence: Evidence, c: Residual) -> Residual:
    """A comparison with what sessions change, and without reference the model's own error."""
    model = None if evidence.referenced else evidence.settings.model
    signatures = [r for r in evidence.signatures if r.task in c.tasks]
    covariance = total_covariance(
        c.noise, signatures, c.functions, c.channels, model, evidence.session_shares
    )
    return replace(c, covariance=covariance)


def _single(evidence: Evidence, trial: Residual) -> Residual:
    """A single trial with what it differs by without a cause, as the whole does."""
    own = replace(scattered(trial, evidence.scatter), moved_deg=evidence.residual.moved_deg)
    return _with_sessions(evidence, own)


def _with_fits(evidence: Evidence, suppositions: Sequence[Supposition]) -> Evidence:
    """Evidence with all effects fitted under some suppositions.

    Effects on the record are the same however firmly the movement is kept: they are fitted once.
    """
    loosest = next(iter(evidence.known))
    fits = {
        one: tuple(
            fit(
                hypothesis,
                evidence.residuals[one.moved_deg],
                evidence.settings.signature_error,
            )
            for hypothesis in evidence.known[one.stiffness]
            if one.stiffness == loosest or hypothesis.effects[0].changes_body
        )
        for one in suppositions
    }
    return replace(evidence, fits=fits)


def of_person(fits: Fits, one: Supposition) -> tuple[Fit, ...]:
    """Fits of all effects under a supposition, those on the record included."""
    # Effects on the record were fitted with the loosest stiffness alone.
    loosest = one._replace(stiffness=min(s.stiffness for s in fits))
    record = (f for f in fits[loosest] if not f.hypothesis.effects[0].changes_body)
    return fits[one] if one == loosest else (*fits[one], *record)


def _density(evidence: Evidence) -> float:
    """Log density of the difference under the one supposition that was fitted."""
    [(one, fits)] = evidence.fits.items()
    c, settings = evidence.residuals[one.moved_deg], evidence.settings
    known = [*fits, *paired(fits, evidence.prior, c, settings.signature_error)]
    logs = [f.log_evidence + np.log(evidence.prior[f.label]) for f in known]
    logs.append(
        unknown_input_evidence(c, evidence.unknown_inputs.columns) + np.log(settings.prior_none)
    )
    logs.append(no_gap_evidence(c) + np.log(settings.prior_no_gap))
    return float(logsumexp(logs))
