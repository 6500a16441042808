"""Muscle scalers that make predicted excitations agree with EMG, with confidence intervals.

The paper lets scalers lower effort and EMG error in one objective, which pays for stronger muscles
whatever the EMG says. Here the motion and the excitations stay those that are best for given
scalers (the tracking problem with joint stability), and the scalers are moved by Gauss-Newton until
these excitations agree with the envelopes as well as the noise of EMG allows; the time constants of
activation and the gain of each channel are unknown beside them. Derivatives come from one
factorisation of the KKT matrix per step.

Letters: N nodes, C channels, G groups, P = 2 G scalers, forces first.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import lsq_linear

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.emg.accuracy import channel_gain, correlation_time_s, noise_sd
from scapulohumeral.emg.envelope import low_passed
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.errors import SolveError
from scapulohumeral.ocp.optimality.kkt import assemble_kkt
from scapulohumeral.ocp.optimality.sensitivity import (
    ProblemParts,
    condition_derivatives,
    parts_of,
    sensitivity,
)
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve
from scapulohumeral.problems.posed_problem import PosedProblem

# Of the solves between two steps of the scalers, whatever that of the study: they are smoothed by
# the barrier, and differ far more.
TOLERANCE = 1e-6


@dataclass(frozen=True)
class RefinementSettings:
    """How scalers are refined.

    Attributes
    ----------
    barrier_target : smooths activation bounds, see :mod:`scapulohumeral.ocp.optimality.sensitivity`
    model_sd : standard deviation of what the model cannot say about an excitation, such as
        cross-talk and the level at rest [fraction of MVC]
    prior_sd_force, prior_sd_fibre : standard deviations of scalers about one [1]
    prior_sd_time : of the factors on activation and deactivation time, which are unknown too [1]
    largest_step, smallest_step : of a scaler in one iteration; below the latter it has converged
    iterations : at most
    """

    barrier_target: float
    model_sd: float
    prior_sd_force: float
    prior_sd_fibre: float
    prior_sd_time: float
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
        rate_hz = 1.0 / self.step_s
        channels = np.tensordot(excitation, self.channels.T, axes=(1, 0))
        channels = np.moveaxis(channels, -1, 1)
        parts = [low_passed(channels[a:b], rate_hz, self.envelope) for a, b in self.nodes.values()]
        return np.concatenate(parts)

    def recorded(self) -> np.ndarray:
        """Envelopes of all motions one after the other, (N', C)."""
        return np.concatenate([self.envelopes[a:b] for a, b in self.nodes.values()])

    @property
    def shared(self) -> float:
        """Number of neighbouring samples that share their noise."""
        return max(1.0, correlation_time_s(self.envelope) / self.step_s)


@dataclass(frozen=True, eq=False)
class Refined:
    """Scalers that agree with EMG.

    Attributes
    ----------
    values : (2, G), forces first; covariance : (P, P) of the values in that order
    times : factors on activation and deactivation time (2,)
    misfit : root mean square of residuals over the noise of EMG, 1 if that explains them all
    converged : whether the last step was small; history : one record per iteration
    point : solution for the values
    """

    values: np.ndarray
    covariance: np.ndarray
    times: np.ndarray
    misfit: float
    converged: bool
    point: Start
    history: list[dict] = field(repr=False)


@dataclass(frozen=True, eq=False)
class _State:
    """Unknowns: scalers (2, G), factors on activation times (2,), gains of channels - 1 (C,)."""

    values: np.ndarray
    times: np.ndarray
    gains: np.ndarray

    @staticmethod
    def at_start(scalers: Scalers, channels: int) -> _State:
        return _State(np.ones((2, len(scalers.names))), np.ones(2), np.zeros(channels))

    def moved(self, step: np.ndarray) -> _State:
        values, times, gains = np.split(step, [self.values.size, self.values.size + 2])
        return _State(
            self.values + values.reshape(self.values.shape),
            self.times + times,
            self.gains + gains,
        )


@dataclass(frozen=True, eq=False)
class _Linearised:
    """Weighted residuals (S,) of samples and of the prior, with derivatives by all unknowns.

    ``clusters`` numbers channel and motion of each sample; ``shared`` is the number of samples that
    share their noise, by which weights are lowered.
    """

    residual: np.ndarray
    jacobian: np.ndarray
    prior: np.ndarray
    prior_jacobian: np.ndarray
    clusters: np.ndarray
    shared: float

    @property
    def cost(self) -> float:
        return float(self.residual @ self.residual + self.prior @ self.prior)

    @property
    def misfit(self) -> float:
        """Root mean square of residuals over noise, undoing the allowance for its correlation."""
        return float(np.sqrt(np.mean(self.residual**2) * self.shared))


def refine(
    posed: PosedProblem,
    scalers: Scalers,
    evidence: Evidence,
    start: Start,
    settings: RefinementSettings,
) -> Refined:
    """Gauss-Newton on the scalers from one, with activation times and gains of channels beside.

    Parameters
    ----------
    posed : problem with generic muscles, without EMG in its objective
    start : solution near that for scalers of one

    Raises
    ------
    SolveError
        If the problem cannot be solved for the scalers of an iteration.
    """
    state = _State.at_start(scalers, len(evidence.channels))
    history: list[dict] = []
    converged = False
    previous: np.ndarray | None = None
    for _ in range(settings.iterations):
        start, at = _linearise(posed, scalers, evidence, start, settings, state)
        step = _bounded_step(at, scalers, settings.largest_step, state)
        largest = float(np.abs(step[: state.values.size]).max())
        if previous is not None and step @ previous < 0.0:
            # The last step went too far: half the way back ends a swing about the optimum.
            step = 0.5 * step
        previous = step
        history.append({"cost": at.cost, "step": largest, "values": state.values.tolist()})
        print(f"refinement {len(history)}: cost {at.cost:.4g}, step {largest:.3f}", flush=True)
        converged = largest < settings.smallest_step
        if converged:
            break
        state = state.moved(step)
    if not converged:
        start, at = _linearise(posed, scalers, evidence, start, settings, state)
    return Refined(
        values=state.values,
        covariance=_covariance(at)[: state.values.size, : state.values.size],
        times=state.times,
        misfit=at.misfit,
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
    state: _State,
) -> tuple[Start, _Linearised]:
    """Solve for scalers and activation times, and differentiate what EMG sees by all unknowns."""
    generic = posed.muscles

    def muscles_of(theta: np.ndarray) -> MuscleParameters:
        rise, fall = theta[-2:]
        scaled = scalers.apply(generic, theta[:-2].reshape(state.values.shape))
        return replace(
            scaled,
            activation_time=scaled.activation_time * rise,
            deactivation_time=scaled.deactivation_time * fall,
        )

    theta = np.concatenate([state.values.ravel(), state.times])
    posed = replace(posed, muscles=muscles_of(theta))
    result = solve(
        posed.problem,
        start,
        SolverSettings(tolerance=TOLERANCE, barrier_target=settings.barrier_target),
    )
    if not result.optimal:
        raise SolveError(f"refinement: scalers {state.values.round(3).tolist()}: {result.message}")
    problem = posed.problem("exact")
    kkt = assemble_kkt(problem, result.point)
    base = parts_of(problem)

    def parts_for(theta: np.ndarray) -> ProblemParts:
        return replace(base, collocation=replace(base.collocation, muscles=muscles_of(theta)))

    slopes = sensitivity(kkt, condition_derivatives(kkt, result.point, parts_for, theta)).free
    seen = evidence.seen(problem.trajectory(result.point.free).e)
    by_theta = np.stack([problem.trajectory(column).e for column in slopes.T], axis=-1)
    return result.point, _weighted(evidence, settings, state, seen, evidence.seen(by_theta))


def _weighted(
    evidence: Evidence,
    settings: RefinementSettings,
    state: _State,
    seen: np.ndarray,
    by_theta: np.ndarray,
) -> _Linearised:
    """Residuals of all samples over their standard deviation, then of the prior."""
    samples, channels = seen.shape
    gain = 1.0 + state.gains
    noise = noise_sd(np.abs(gain * seen), evidence.envelope)
    sd = np.sqrt((noise**2 + settings.model_sd**2) * evidence.shared)
    residual = (gain * seen - evidence.recorded()) / sd
    by_gain = np.zeros((samples, channels, channels))
    index = np.arange(channels)
    by_gain[:, index, index] = seen / sd
    rows = np.concatenate([by_theta * (gain[:, None] / sd[..., None]), by_gain], axis=2)
    groups = state.values.shape[1]
    bias, gain_sd = channel_gain(evidence.envelope)
    prior_sd = np.concatenate(
        [
            np.repeat([settings.prior_sd_force, settings.prior_sd_fibre], groups),
            np.full(2, settings.prior_sd_time),
            np.full(channels, gain_sd),
        ]
    )
    prior = np.concatenate([state.values.ravel() - 1.0, state.times - 1.0, state.gains - bias])
    motions = np.repeat(np.arange(len(evidence.nodes)), [b - a for a, b in evidence.nodes.values()])
    return _Linearised(
        residual=residual.ravel(),
        jacobian=rows.reshape(residual.size, -1),
        prior=prior / prior_sd,
        prior_jacobian=np.diag(1.0 / prior_sd),
        clusters=(motions[:, None] * channels + index).ravel(),
        shared=evidence.shared,
    )


def _bounded_step(at: _Linearised, scalers: Scalers, largest: float, state: _State) -> np.ndarray:
    """Gauss-Newton step of all unknowns, inside the bounds of the scalers."""
    bounds = np.array([scalers.force_bounds, scalers.fibre_bounds])
    low = np.maximum(bounds[:, :1] - state.values, -largest).ravel()
    high = np.minimum(bounds[:, 1:] - state.values, largest).ravel()
    free = at.jacobian.shape[1] - low.size
    low = np.concatenate([np.minimum(low, -1e-9), np.full(free, -largest)])
    high = np.concatenate([np.maximum(high, 1e-9), np.full(free, largest)])
    matrix = np.vstack([at.jacobian, at.prior_jacobian])
    return lsq_linear(matrix, -np.concatenate([at.residual, at.prior]), (low, high)).x


def _covariance(at: _Linearised) -> np.ndarray:
    """Covariance of all unknowns, robust against errors that last through a motion.

    The larger of two, unknown by unknown: that of independent noise as large as the misfit, and
    the sandwich over clusters, one per channel and motion, with its small-sample factor (Liang and
    Zeger 1986, Biometrika 73: 13-22).
    """
    prior = at.prior_jacobian.T @ at.prior_jacobian
    inverse = np.linalg.inv(at.jacobian.T @ at.jacobian + prior)
    independent = inverse * max(1.0, at.misfit**2)
    count, unknowns = at.clusters.max() + 1, at.jacobian.shape[1]
    scores = np.zeros((count, unknowns))
    np.add.at(scores, at.clusters, at.jacobian * at.residual[:, None])
    effective = np.trace(inverse @ (at.jacobian.T @ at.jacobian))
    factor = count / max(1.0, count - effective)
    robust = inverse @ (factor * scores.T @ scores + prior) @ inverse
    widening = np.sqrt(np.maximum(1.0, np.diag(robust) / np.diag(independent)))
    return independent * np.outer(widening, widening)
