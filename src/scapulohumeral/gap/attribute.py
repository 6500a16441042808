"""How well each effect explains a difference: evidence, amplitudes, refits by solving again.

The difference d has covariance C without effects. Effect k predicts m(x) of internal parameters x,
with an error of its own: each channel of each task may be off by a common factor, a little of
everything anywhere (`signature_error`), and a person may share out a load among muscles in another
way than the model's least effort, so that EMG changes in channels that the model leaves silent. Its
log evidence integrates the Gaussian likelihood of d over the prior of x by Laplace's method. "None
of these" are smooth generalised forces and smooth errors of EMG channels of unknown size: what the
black box can explain, no effect has explained.

Letters: D coefficients, P parameters, T tasks, K channels, N nodes, B phase functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import lsq_linear, minimize_scalar
from scipy.stats import chi2, norm

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.floor import Comparison

# Share of the signature error that is spread over all channels, also those an effect leaves alone.
SPREAD_SHARE = 0.3
# Error of the share by which EMG channels change with a load, in units of the signature error: at a
# signature error of 0.3, channels that the model leaves silent may change by as much as the others.
RECRUITMENT = 3.0
# Signature error of effects on the record, which no muscle has to act for, over that of others.
RECORD_SHARE = 0.5
# Spread of the gain with which a muscle that has changed itself appears on its electrodes, for a
# change of one unit on the internal scale: torn or wasted parts of it are no longer driven.
OWN_GAIN = 1.0
# Sizes over that of least squares among which the most probable one is looked for.
SMALLEST_FACTOR, LARGEST_FACTOR = 0.5, 6.0
BLACK_BOX_SIZES = (0.1, 0.3, 1.0, 3.0, 10.0)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect, or a pair of them, linearised.

    Attributes
    ----------
    effects : one, or the two of a pair
    at : (P,) internal parameters of the linearisation
    value : (D,) change predicted there; slope : (D, P) per unit
    own : (D,) EMG of channels over muscles that the effects themselves change, zero elsewhere;
        None if there are none
    """

    effects: tuple[Effect, ...]
    at: np.ndarray
    value: np.ndarray
    slope: np.ndarray
    own: np.ndarray | None = None

    @property
    def label(self) -> str:
        """Label in answers."""
        return " + ".join(sorted(effect.label for effect in self.effects))

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper internal bounds (P,)."""
        ends = np.array([p.bounds for effect in self.effects for p in effect.params])
        return ends[:, 0], ends[:, 1]

    @property
    def prior_sd(self) -> np.ndarray:
        """Prior spread of the internal parameters, (P,)."""
        return np.array([p.prior_sd for effect in self.effects for p in effect.params])

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Change (D,) at internal parameters (P,)."""
        return self.value + self.slope @ (x - self.at)

    def error(self, x: np.ndarray, comparison: Comparison, relative: float) -> SignatureError:
        """Error of the change predicted at internal parameters (P,).

        What acts on the record itself is known better than what a person's control makes of it.
        """
        controlled = any(effect.changes_body for effect in self.effects)
        share = relative if controlled else RECORD_SHARE * relative
        own = None if self.own is None or not relative else OWN_GAIN * abs(x[0]) * self.own
        return SignatureError(comparison, self.predict(x), share, controlled, own)

    def part(self, rows: np.ndarray) -> Hypothesis:
        """The same for some coefficients."""
        own = None if self.own is None else self.own[rows]
        return replace(self, value=self.value[rows], slope=self.slope[rows], own=own)


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis fitted to a difference.

    Attributes
    ----------
    hypothesis : that was fitted
    x : (P,) internal parameters; covariance : (P, P) of them
    log_evidence : log density of the difference, whitened
    left : sum of squares of the whitened difference that remains
    """

    hypothesis: Hypothesis
    x: np.ndarray
    covariance: np.ndarray
    log_evidence: float
    left: float

    @property
    def label(self) -> str:
        """Label in answers."""
        return self.hypothesis.label

    @property
    def predicted(self) -> np.ndarray:
        """Change (D,) that the fit predicts."""
        return self.hypothesis.predict(self.x)


class SignatureError:
    """Covariance I + E of a whitened residual, E the error of a predicted change.

    Parameters
    ----------
    comparison : what is explained
    predicted : (D,) predicted change
    relative : error of each channel's predicted change, relative
    recruits : whether the change comes from muscles that share out a load: then it may appear in
        other EMG channels than those of the muscles that the model recruits
    own : (D,) further error of single channels, common to one channel of one task
    """

    def __init__(
        self,
        comparison: Comparison,
        predicted: np.ndarray,
        relative: float,
        recruits: bool,
        own: np.ndarray | None = None,
    ) -> None:
        whole = comparison.whiten(predicted)
        spread = (SPREAD_SHARE * relative) ** 2 * float(whole @ whole) / len(whole)
        columns = [relative * comparison.by_channel(predicted)]
        if own is not None:
            columns.append(comparison.by_channel(own))
        white = comparison.whiten(np.hstack(columns))
        covariance = white @ white.T
        covariance[np.diag_indices_from(covariance)] += 1.0 + spread
        if recruits and comparison.levels is not None:
            level = RECRUITMENT * relative * _share(predicted, comparison.levels)
            covariance += level**2 * comparison.recruitment
        self._factor = cho_factor(covariance, lower=True)
        self.logdet = 2.0 * float(np.log(np.diag(self._factor[0])).sum())

    def solve(self, vectors: np.ndarray) -> np.ndarray:
        """Inverse of I + E times vectors (D,) or (D, P)."""
        return cho_solve(self._factor, vectors)

    def log_density(self, residual: np.ndarray) -> float:
        """Log density of a whitened residual (D,)."""
        quadratic = float(residual @ self.solve(residual))
        return -0.5 * (quadratic + self.logdet + len(residual) * np.log(2.0 * np.pi))


def _share(predicted: np.ndarray, levels: np.ndarray) -> float:
    """Share of its level by which EMG changes in total."""
    seen = levels != 0.0
    return float(np.linalg.norm(predicted[seen])) / max(float(np.linalg.norm(levels)), 1e-12)


def fit(hypothesis: Hypothesis, comparison: Comparison, relative_error: float) -> Fit:
    """Most probable parameters inside their bounds, and evidence by Laplace's method."""
    low, high = hypothesis.bounds
    first = np.eye(len(low))[0] * hypothesis.prior_sd
    # Errors grow with predictions: what contradicts a small effect, a large one may bear.
    starts = [np.clip(hypothesis.at + sign * first, low, high) for sign in (0.0, 1.0, -1.0)]
    fits = [_reweighted(hypothesis, comparison, relative_error, start) for start in starts]
    losses = [_loss(hypothesis, comparison, relative_error, x) for x in fits]
    x = fits[int(np.argmin(losses))]
    if relative_error > 0.0:
        x = _reweighted(hypothesis, comparison, relative_error, x)
        x = _rescaled(hypothesis, comparison, x, relative_error)
    slope, white = comparison.whiten(hypothesis.slope), comparison.whiten(comparison.delta)
    error = hypothesis.error(x, comparison, relative_error)
    curvature = slope.T @ error.solve(slope) + np.diag(hypothesis.prior_sd**-2.0)
    residual = white - comparison.whiten(hypothesis.predict(x))
    one_sided = np.sum((low >= 0.0) | (high <= 0.0))
    _, logdet = np.linalg.slogdet(curvature)
    log_evidence = (
        -_loss(hypothesis, comparison, relative_error, x)
        + one_sided * np.log(2.0)
        + 0.5 * (len(x) * np.log(2.0 * np.pi) - float(logdet))
    )
    left = float(residual @ residual)
    return Fit(hypothesis, x, np.linalg.inv(curvature), log_evidence, left)


def _reweighted(
    hypothesis: Hypothesis, comparison: Comparison, relative_error: float, start: np.ndarray
) -> np.ndarray:
    """Most probable parameters (P,) with the error that a prediction has at a start (P,)."""
    slope = comparison.whiten(hypothesis.slope)
    target = comparison.whiten(comparison.delta - hypothesis.value) + slope @ hypothesis.at
    error = hypothesis.error(start, comparison, relative_error)
    prior = np.diag(1.0 / hypothesis.prior_sd)
    return _bounded(slope, target, error, prior, hypothesis.bounds)


def _loss(
    hypothesis: Hypothesis, comparison: Comparison, relative_error: float, x: np.ndarray
) -> float:
    """Negative log density of the difference and the parameters (P,), up to one-sided priors."""
    residual = comparison.whiten(comparison.delta - hypothesis.predict(x))
    density = hypothesis.error(x, comparison, relative_error).log_density(residual)
    return -density - float(np.sum(norm.logpdf(x, scale=hypothesis.prior_sd)))


def _rescaled(
    hypothesis: Hypothesis, comparison: Comparison, x: np.ndarray, relative_error: float
) -> np.ndarray:
    """The same mixture of parameters, of the most probable size.

    Least squares with the error of a given prediction makes effects too small, because the error
    grows with them: a larger effect is contradicted less.
    """
    low, high = hypothesis.bounds
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = np.where(x > 0.0, high / x, np.where(x < 0.0, low / x, np.inf))
    largest = min(float(reach.min()), LARGEST_FACTOR)
    if not np.any(x) or largest <= SMALLEST_FACTOR:
        return x

    def loss(log_factor: float) -> float:
        return _loss(hypothesis, comparison, relative_error, np.exp(log_factor) * x)

    ends = (np.log(SMALLEST_FACTOR), np.log(largest))
    best = minimize_scalar(loss, bounds=ends, method="bounded", options={"xatol": 0.05})
    return np.clip(np.exp(best.x) * x, low, high)


def _bounded(
    slope: np.ndarray,
    target: np.ndarray,
    error: SignatureError,
    prior: np.ndarray,
    bounds: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Least squares with a prior and bounds, residuals weighted by the signature error."""
    normal = slope.T @ error.solve(slope) + prior.T @ prior
    right = slope.T @ error.solve(target)
    factor = np.linalg.cholesky(normal)
    low, high = bounds
    span = np.maximum(high - low, 1e-9)
    solved = lsq_linear(factor.T, np.linalg.solve(factor, right), (low - 1e-12 * span, high))
    return np.clip(solved.x, low, high)


def no_gap_evidence(comparison: Comparison) -> float:
    """Log evidence of no difference at all."""
    white = comparison.whiten(comparison.delta)
    return -0.5 * (float(white @ white) + len(white) * np.log(2.0 * np.pi))


def black_box_evidence(
    comparison: Comparison, columns: np.ndarray, sizes: Sequence[float] = BLACK_BOX_SIZES
) -> float:
    """Log evidence of smooth disturbances (D, S) of unknown common size, the best of a few sizes.

    Averaged over the sizes, so that a better fit by a freer box is paid for.
    """
    white, columns = comparison.whiten(comparison.delta), comparison.whiten(columns)
    values = []
    for size in sizes:
        covariance = np.eye(len(white)) + size**2 * columns @ columns.T
        factor = np.linalg.cholesky(covariance)
        scaled = np.linalg.solve(factor, white)
        values.append(
            -0.5 * (scaled @ scaled + len(white) * np.log(2.0 * np.pi))
            - np.log(np.diag(factor)).sum()
        )
    return float(np.logaddexp.reduce(values) - np.log(len(values)))


def black_box_left(comparison: Comparison, columns: np.ndarray) -> float:
    """Sum of squares that smooth disturbances (D, S) leave of the whitened difference.

    It stands for the floor: more than this no cause that acts smoothly can explain.
    """
    white, columns = comparison.whiten(comparison.delta), comparison.whiten(columns)
    left = white - columns @ np.linalg.lstsq(columns, white, rcond=None)[0]
    free = max(len(white) - columns.shape[1], 1)
    return min(float(left @ left) * len(white) / free, float(len(white)))


def task_agreement(
    hypothesis: Hypothesis, comparison: Comparison, relative_error: float
) -> tuple[float | None, list[tuple[str, float, float]]]:
    """Whether all tasks ask for the same primary amplitude (Cochran's Q test).

    Returns
    -------
    p : None with one task
    rows : task, internal primary amplitude and its standard error
    """
    rows = []
    for task in comparison.tasks:
        part = fit(
            hypothesis.part(comparison.rows([task])), comparison.part([task]), relative_error
        )
        rows.append((task, float(part.x[0]), float(np.sqrt(part.covariance[0, 0]))))
    if len(rows) < 2:
        return None, rows
    values, errors = np.array([row[1:] for row in rows]).T
    weights = 1.0 / errors**2
    mean = np.sum(weights * values) / weights.sum()
    return float(chi2.sf(np.sum(weights * (values - mean) ** 2), len(rows) - 1)), rows


def pair(first: Fit, second: Fit) -> Hypothesis:
    """Both effects at once, their changes added."""
    one, two = first.hypothesis, second.hypothesis
    return Hypothesis(
        effects=(*one.effects, *two.effects),
        at=np.concatenate([one.at, two.at]),
        value=one.value + two.value,
        slope=np.hstack([one.slope, two.slope]),
        own=one.own if two.own is None else two.own,
    )


def distance(
    fitted: Fit, other: Hypothesis, comparison: Comparison, relative_error: float
) -> float:
    """How far another hypothesis stays from what a fit predicts, in units of the noise."""
    target = replace(comparison, delta=fitted.predicted)
    closest = fit(other, target, 0.0)
    remaining = comparison.whiten(fitted.predicted - closest.predicted)
    error = fitted.hypothesis.error(fitted.x, comparison, relative_error)
    return float(np.sqrt(remaining @ error.solve(remaining)))


def strongest(fits: Sequence[Fit], priors: dict[str, float], count: int) -> list[Fit]:
    """The fits with most evidence and prior, the best first."""
    return sorted(fits, key=lambda f: -(f.log_evidence + np.log(priors[f.label])))[:count]
