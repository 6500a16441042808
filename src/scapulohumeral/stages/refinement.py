"""Muscle scalers that make predicted excitations agree with EMG, with confidence intervals.

The paper lets scalers lower effort and EMG error in one objective, which pays for stronger muscles
whatever the EMG says. Here the motion and the excitations stay those that are best for given
scalers (the tracking problem with joint stability), and the scalers are moved by Gauss-Newton until
these excitations agree with the envelopes as well as the noise of EMG allows. Derivatives come from
one factorisation of the KKT matrix per step.

Letters: N nodes, C channels, G groups, P = 2 G scalers, forces first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import lsq_linear
from scipy.signal import butter, sosfiltfilt

from scapulohumeral.emg.accuracy import GAIN_BIAS, GAIN_SD, correlation_time_s, noise_sd
from scapulohumeral.emg.envelope import EnvelopeSettings
from scapulohumeral.errors import SolveError
from scapulohumeral.ocp.kkt import assemble_kkt
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.sensitivity import (
    Variant,
    condition_derivatives,
    sensitivity,
    variant,
)
from scapulohumeral.ocp.solver import SolverSettings, Start, solve
from scapulohumeral.stages.posed_problem import PosedProblem

# Rates of change of an excitation are seen through the low-pass of the envelope.
FILTER_ORDER = 2


@dataclass(frozen=True)
class RefinementSettings:
    """How scalers are refined.

    Attributes
    ----------
    barrier_target : smooths activation bounds, see :mod:`scapulohumeral.ocp.sensitivity`
    prior_sd_force, prior_sd_fibre : standard deviations of scalers about one [1]
    largest_step, smallest_step : of a scaler in one iteration; below the latter it has converged
    iterations : at most
    """

    barrier_target: float
    prior_sd_force: float
    prior_sd_fibre: float
    largest_step: float
    smallest_step: float
    iterations: int


@dataclass(frozen=True, eq=False)
class Evidence:
    """Envelopes on the mesh and what is known about them.

    Attributes
    ----------
    channels : (C, M) share of each muscle element in a channel
    envelopes : (N, C) fractions of MVC
    nodes : first node and node after the last of each motion; outside there is no EMG
    envelope : how they were made; step_s : mesh interval
    """

    channels: np.ndarray
    envelopes: np.ndarray
    nodes: Mapping[str, tuple[int, int]]
    envelope: EnvelopeSettings
    step_s: float

    def seen(self, excitation: np.ndarray) -> np.ndarray:
        """Channels of excitations (N, M, ...) through the low-pass of envelopes, motion by motion.

        Returns the nodes of all motions one after the other, (N', C, ...).
        """
        sections = butter(FILTER_ORDER, 2 * self.envelope.cutoff_hz * self.step_s, output="sos")
        channels = np.tensordot(excitation, self.channels.T, axes=(1, 0))
        channels = np.moveaxis(channels, -1, 1)
        parts = [sosfiltfilt(sections, channels[a:b], axis=0) for a, b in self.nodes.values()]
        return np.concatenate(parts)

    def recorded(self) -> np.ndarray:
        """Envelopes of all motions one after the other, (N', C)."""
        return np.concatenate([self.envelopes[a:b] for a, b in self.nodes.values()])

    def sd(self) -> np.ndarray:
        """Standard deviation of each sample as if all were independent, (N', C)."""
        shared = max(1.0, correlation_time_s(self.envelope) / self.step_s)
        return noise_sd(self.recorded(), self.envelope) * np.sqrt(shared)


@dataclass(frozen=True, eq=False)
class Refined:
    """Scalers that agree with EMG.

    Attributes
    ----------
    values : (2, G), forces first; covariance : (P, P) of the values in that order
    misfit : root mean square of residuals over the noise of EMG, 1 if that explains them all
    converged : whether the last step was small; history : one record per iteration
    point : solution for the values
    """

    values: np.ndarray
    covariance: np.ndarray
    misfit: float
    converged: bool
    point: Start
    history: list[dict] = field(repr=False)


@dataclass(frozen=True, eq=False)
class _Linearised:
    """Weighted residuals and their derivatives, prior included, at some scalers."""

    residual: np.ndarray
    jacobian: np.ndarray
    samples: int

    @property
    def cost(self) -> float:
        return float(self.residual @ self.residual)


def refine(
    posed: PosedProblem,
    scalers: Scalers,
    evidence: Evidence,
    start: Start,
    settings: RefinementSettings,
) -> Refined:
    """Gauss-Newton on the scalers from one.

    Parameters
    ----------
    posed : problem with generic muscles, without EMG in its objective
    start : solution near that for scalers of one

    Raises
    ------
    SolveError
        If the problem cannot be solved for the scalers of an iteration.
    """
    values = np.ones((2, len(scalers.names)))
    gains = np.zeros(len(evidence.channels))
    history: list[dict] = []
    converged = False
    for _ in range(settings.iterations):
        start, at = _linearise(posed, scalers, evidence, start, settings, values, gains)
        step = _bounded_step(at, scalers, settings, values)
        largest = float(np.abs(step[: values.size]).max())
        history.append({"cost": at.cost, "largest_step": largest, "values": values.tolist()})
        print(f"refinement {len(history)}: cost {at.cost:.4g}, step {largest:.3f}", flush=True)
        converged = largest < settings.smallest_step
        if converged:
            break
        values = values + step[: values.size].reshape(values.shape)
        gains = gains + step[values.size :]
    if not converged:
        start, at = _linearise(posed, scalers, evidence, start, settings, values, gains)
    misfit = _misfit(at, evidence)
    covariance = np.linalg.inv(at.jacobian.T @ at.jacobian)[: values.size, : values.size]
    return Refined(
        values=values,
        covariance=covariance * max(1.0, misfit**2),
        misfit=misfit,
        converged=converged,
        point=start,
        history=history,
    )


def _linearise(
    posed: PosedProblem,
    scalers: Scalers,
    evidence: Evidence,
    start: Start,
    settings: RefinementSettings,
    values: np.ndarray,
    gains: np.ndarray,
) -> tuple[Start, _Linearised]:
    """Solve for scalers and differentiate: residuals by scalers and by the gains of channels."""
    generic = posed.muscles
    posed = replace(posed, muscles=scalers.apply(generic, values))
    result = solve(
        posed.problem, start, SolverSettings(tolerance=1e-6, barrier_target=settings.barrier_target)
    )
    if not result.optimal:
        raise SolveError(f"refinement: scalers {values.round(3).tolist()}: {result.message}")
    problem = posed.problem("exact")
    kkt = assemble_kkt(problem, result.point)
    base = variant(problem)

    def variant_of(theta: np.ndarray) -> Variant:
        scaled = scalers.apply(generic, theta.reshape(values.shape))
        return replace(base, collocation=replace(base.collocation, muscles=scaled))

    conditions = condition_derivatives(kkt, result.point, variant_of, values.ravel())
    slopes = sensitivity(kkt, conditions).free
    excitation = problem.trajectory(result.point.free).e
    by_scaler = np.stack([problem.trajectory(column).e for column in slopes.T], axis=-1)
    return result.point, _weighted(
        evidence, settings, values, gains, evidence.seen(excitation), evidence.seen(by_scaler)
    )


def _weighted(
    evidence: Evidence,
    settings: RefinementSettings,
    values: np.ndarray,
    gains: np.ndarray,
    seen: np.ndarray,
    by_scaler: np.ndarray,
) -> _Linearised:
    """Residuals of all samples over their noise, then of the prior of scalers and gains."""
    sd, (samples, channels) = evidence.sd(), seen.shape
    gain = 1.0 + gains
    residual = (gain * seen - evidence.recorded()) / sd
    by_gain = np.zeros((samples, channels, channels))
    index = np.arange(channels)
    by_gain[:, index, index] = seen / sd
    rows = np.concatenate([by_scaler * (gain[:, None] / sd[..., None]), by_gain], axis=2)
    prior_sd = np.repeat([settings.prior_sd_force, settings.prior_sd_fibre], values.shape[1])
    prior_sd = np.concatenate([prior_sd, np.full(channels, GAIN_SD)])
    prior = np.concatenate([values.ravel() - 1.0, gains - GAIN_BIAS]) / prior_sd
    return _Linearised(
        residual=np.concatenate([residual.ravel(), prior]),
        jacobian=np.vstack([rows.reshape(residual.size, -1), np.diag(1.0 / prior_sd)]),
        samples=residual.size,
    )


def _bounded_step(
    at: _Linearised, scalers: Scalers, settings: RefinementSettings, values: np.ndarray
) -> np.ndarray:
    """Gauss-Newton step of scalers and gains, inside the bounds of the scalers."""
    bounds = np.array([scalers.force_bounds, scalers.fibre_bounds])
    largest = settings.largest_step
    low = np.maximum(bounds[:, :1] - values, -largest).ravel()
    high = np.minimum(bounds[:, 1:] - values, largest).ravel()
    free = at.jacobian.shape[1] - values.size
    low = np.concatenate([np.minimum(low, -1e-9), np.full(free, -np.inf)])
    high = np.concatenate([np.maximum(high, 1e-9), np.full(free, np.inf)])
    return lsq_linear(at.jacobian, -at.residual, (low, high)).x


def _misfit(at: _Linearised, evidence: Evidence) -> float:
    """Root mean square of residuals over noise, undoing the allowance for its correlation."""
    shared = max(1.0, correlation_time_s(evidence.envelope) / evidence.step_s)
    return float(np.sqrt(np.mean(at.residual[: at.samples] ** 2) * shared))
