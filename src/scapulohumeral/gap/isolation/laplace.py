"""Amplitudes and log evidence of a hypothesis by Laplace's method.

The Gaussian likelihood of the difference is integrated over the prior of the parameters.

Letters: D coefficients, P parameters.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import lsq_linear
from scipy.stats import chi2

from scapulohumeral.gap.isolation.allowed import constraints, log_share
from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.model_error import SignatureError
from scapulohumeral.gap.residual.residual import Residual

# Least squares are repeated with new errors until parameters change by less than this share of
# their prior spread, at most so often.
REWEIGHTINGS, SETTLED = 12, 0.01
# A task that tells of an amplitude less than this share of what its prior does, tells nothing.
LEAST_OF_PRIOR = 0.05


def fit(hypothesis: Hypothesis, residual: Residual, relative_error: float) -> Fit:
    """Most probable parameters inside their bounds, and evidence by Laplace's method."""
    system = _System(
        hypothesis,
        residual,
        relative_error,
        slope=residual.axes.whiten(hypothesis.slope),
        target=residual.axes.whiten(
            residual.delta - hypothesis.value.sum(axis=1) + hypothesis.slope @ hypothesis.at
        ),
    )
    low, high = hypothesis.bounds
    first = np.eye(len(low))[0] * hypothesis.prior_sd
    # Errors grow with predictions: what contradicts a small effect, a large one may bear.
    starts = [np.clip(hypothesis.at + sign * first, low, high) for sign in (0.0, 1.0, -1.0)]
    different = sorted({tuple(start) for start in starts})
    settled = (system.settled(np.array(start)) for start in different)
    x, error = min(((x, system.error(x)) for x in settled), key=lambda found: system.loss(*found))
    curvature = system.curvature(error)
    covariance = np.linalg.inv(curvature)
    left = system.left(x)
    _, logdet = np.linalg.slogdet(curvature)
    gradient = system.gradient(x, error)
    unconstrained = x - covariance @ gradient
    log_evidence = (
        error.log_density(error.squares(left), len(left))
        - residual.log_volume
        + _log_prior(hypothesis, x)
        + 0.5 * (len(x) * np.log(2.0 * np.pi) - float(logdet))
        + system.allowed(x, unconstrained, curvature, covariance)
    )
    return Fit(
        hypothesis,
        x,
        covariance,
        log_evidence,
        moved_deg=residual.moved_deg,
        unbounded=system.unbounded(x, curvature, gradient),
        unconstrained=unconstrained,
    )


@dataclass(frozen=True, eq=False)
class _System:
    """Least squares of a hypothesis, whitened.

    Attributes
    ----------
    hypothesis, residual, relative_error : as for :func:`fit`
    slope : (D, P) change per unit of a parameter
    target : (D,) difference to explain, from the origin of the parameters
    """

    hypothesis: Hypothesis
    residual: Residual
    relative_error: float
    slope: np.ndarray
    target: np.ndarray

    @cached_property
    def error(self) -> Callable[[np.ndarray], SignatureError]:
        """Error of what parameters (P,) predict."""
        return self.hypothesis.errors(self.residual, self.relative_error)

    def left(self, x: np.ndarray) -> np.ndarray:
        """What parameters (P,) leave of the difference, (D,)."""
        return self.target - self.slope @ x

    def loss(self, x: np.ndarray, error: SignatureError) -> float:
        """Negative log density of the difference and parameters (P,), up to one-sided priors."""
        left = self.left(x)
        density = error.log_density(error.squares(left), len(left))
        return -density - _log_prior(self.hypothesis, x)

    def curvature(self, error: SignatureError) -> np.ndarray:
        """That of the negative log density, (P, P), with the error of one prediction."""
        told = self.slope.T @ error.solve(self.slope)
        return told + np.diag(self.hypothesis.prior_sd**-2.0)

    def gradient(self, x: np.ndarray, error: SignatureError) -> np.ndarray:
        """That of the negative log density at parameters (P,), with the error of one prediction."""
        return x / self.hypothesis.prior_sd**2 - self.slope.T @ error.solve(self.left(x))

    def allowed(
        self,
        x: np.ndarray,
        unconstrained: np.ndarray,
        curvature: np.ndarray,
        covariance: np.ndarray,
    ) -> float:
        """What bounds and order cost: log of the integral over what is allowed, over Laplace's.

        That is the share of the density that is allowed, over the share of the prior.

        Parameters
        ----------
        x : (P,) most probable parameters inside all bounds
        unconstrained : (P,) the same without any
        curvature : (P, P) of the negative log density; covariance : (P, P) its inverse
        """
        low, high = self.hypothesis.bounds
        inside = constraints(low, high, self.hypothesis.order, x)
        step = unconstrained - x
        gained = 0.5 * float(step @ curvature @ step)
        share = log_share(inside, unconstrained, covariance)
        prior = np.diag(self.hypothesis.prior_sd**2)
        return gained + share - log_share(inside, np.zeros_like(x), prior)

    def unbounded(self, x: np.ndarray, curvature: np.ndarray, gradient: np.ndarray) -> np.ndarray:
        """Where the density is largest without bounds at zero, (P,).

        Parameters at a bound far from zero stay there: what data ask for beyond it, no person has.

        Parameters
        ----------
        x : (P,) most probable parameters inside all bounds
        curvature : (P, P) of the negative log density; gradient : (P,) of it at `x`
        """
        low, high = self.hypothesis.bounds
        free = ~(((x <= low) & (low < 0.0)) | ((x >= high) & (high > 0.0)))
        found = x.copy()
        found[free] -= np.linalg.solve(curvature[np.ix_(free, free)], gradient[free])
        return found

    def settled(self, start: np.ndarray) -> np.ndarray:
        """Parameters (P,) that least squares with the error of their own prediction returns.

        The most probable ones would be too small wherever predictions are better than their error
        says, because a smaller effect claims a smaller error.
        """
        x = start
        for _ in range(REWEIGHTINGS if self.relative_error > 0.0 else 1):
            before, x = x, self.reweighted(x)
            if np.all(np.abs(x - before) < SETTLED * self.hypothesis.prior_sd):
                break
        return x

    def reweighted(self, start: np.ndarray) -> np.ndarray:
        """Most probable parameters (P,) with the error that a prediction has at a start (P,)."""
        weighted = self.error(start).solve(self.slope)
        normal = self.slope.T @ weighted + np.diag(self.hypothesis.prior_sd**-2.0)
        right = weighted.T @ self.target
        low, high = self.hypothesis.bounds
        if not self.hypothesis.order:
            return _least(normal, right, low, high)
        alike, kept = np.eye(len(low)), list(range(len(low)))
        while True:
            basis = alike[:, kept]
            x = basis @ _least(basis.T @ normal @ basis, basis.T @ right, low[kept], high[kept])
            swapped = [pair for pair in self.hypothesis.order if x[pair[0]] > x[pair[1]]]
            if not swapped:
                return x
            # Where two would change places, the best of a convex problem has them equal.
            first, second = swapped[0]
            alike[second] = alike[first]
            kept.remove(second)


def _least(normal: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Parameters (P,) of least squares with normal equations (P, P) and (P,) inside bounds."""
    if len(right) == 1:
        return np.clip(right / normal[0], low, high)
    free = np.linalg.solve(normal, right)
    if np.all((low <= free) & (free <= high)):
        return free
    if len(right) == 2:
        return _least_on_edges(normal, right, low, high)
    factor = np.linalg.cholesky(normal)
    span = np.maximum(high - low, 1e-9)
    # An active set of few parameters is exact and ten times as fast as an interior point.
    target = np.linalg.solve(factor, right)
    solved = lsq_linear(factor.T, target, (low - 1e-12 * span, high), method="bvls")
    return np.clip(solved.x, low, high)


def _least_on_edges(
    normal: np.ndarray, right: np.ndarray, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """The same for two parameters, where without bounds they would be beyond one."""
    points = []
    for held, free in ((0, 1), (1, 0)):
        for end in (low[held], high[held]):
            x = np.empty(2)
            x[held] = end
            least = (right[free] - normal[free, held] * end) / normal[free, free]
            x[free] = min(max(least, low[free]), high[free])
            points.append(x)
    return min(points, key=lambda x: 0.5 * x @ normal @ x - right @ x)


def _log_prior(hypothesis: Hypothesis, x: np.ndarray) -> float:
    sd = hypothesis.prior_sd
    return float(-0.5 * np.sum((x / sd) ** 2 + np.log(2.0 * np.pi * sd**2)))


def no_gap_evidence(residual: Residual) -> float:
    """Log evidence of no difference at all."""
    white = residual.whiten(residual.delta)
    density = -0.5 * (float(white @ white) + len(white) * np.log(2.0 * np.pi))
    return density - residual.log_volume


class TaskAmplitude(NamedTuple):
    """What one task alone tells of the primary amplitude: task, internal value, standard error."""

    task: str
    x: float
    sd: float


def task_agreement(
    hypothesis: Hypothesis, residual: Residual, relative_error: float, misfit: float
) -> tuple[float | None, list[TaskAmplitude]]:
    """Whether all tasks ask for the same parameters (Cochran's Q test, of all parameters at once).

    The prior says the same in every task, so it is taken out of what each one tells. Bounds do
    not count here: tasks that ask for more than a bound, and for more than each other, disagree.

    Parameters
    ----------
    hypothesis, residual, relative_error : as for :func:`fit`
    misfit : how many times the assumed variance the likeliest explanation leaves, one or more

    Returns
    -------
    p : None where no two tasks tell of one parameter
    rows : primary amplitude, of the tasks that tell something of it
    """
    sd = hypothesis.prior_sd
    rows, told, asked = [], [], []
    for task in residual.tasks:
        part = fit(hypothesis.part(residual.rows([task])), residual.part([task]), relative_error)
        row = _primary(task, part)
        rows += [] if row is None else [row]
        # In units of prior spreads, in which the prior has precision one.
        posterior = np.linalg.inv(part.covariance / np.outer(sd, sd))
        precision, axes = np.linalg.eigh(posterior)
        known = precision - 1.0 > LEAST_OF_PRIOR
        precision, axes = precision[known], axes[:, known]
        told.append(axes * (precision - 1.0) @ axes.T)
        asked.append(axes * precision @ axes.T @ (part.unconstrained / sd))
    squares, ranks = zip(*map(_told_square, told, asked), strict=True)
    common, rank = _told_square(np.sum(told, axis=0), np.sum(asked, axis=0))
    if (degrees := sum(ranks) - rank) < 1:
        return None, rows
    return float(chi2.sf((sum(squares) - common) / misfit, degrees)), rows


def _primary(task: str, part: Fit) -> TaskAmplitude | None:
    """What the fit to one task tells of the primary amplitude; None if next to nothing."""
    variance, prior = part.covariance[0, 0], part.hypothesis.prior_sd[0] ** -2.0
    told = 1.0 / variance - prior
    if told <= LEAST_OF_PRIOR * prior:
        return None
    return TaskAmplitude(task, float(part.unconstrained[0] / variance / told), float(told**-0.5))


def _told_square(told: np.ndarray, asked: np.ndarray) -> tuple[float, int]:
    """Squared length of what is asked for, in units of its error, and how much is told of.

    Parameters
    ----------
    told : (P, P) precision, in units of prior spreads; asked : (P,) precision times parameters
    """
    precision, axes = np.linalg.eigh(told)
    known = precision > 0.5 * LEAST_OF_PRIOR
    along = axes[:, known].T @ asked
    return float(np.sum(along**2 / precision[known])), int(known.sum())
