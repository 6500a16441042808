"""How well each effect explains a difference: evidence, amplitudes, refits by solving again.

The difference d has covariance C without effects. Effect k predicts m(x) of internal parameters x,
with an error of its own in units of `signature_error`: a person may share out a load among muscles
and joints in another way than the model's least effort, so that each channel changes more or less
than predicted, much alike in all tasks, and that angles or EMG change about as much, but elsewhere
and at other phases. Its log evidence integrates the Gaussian likelihood of d over the prior of x by
Laplace's method. "None of these" are smooth generalised forces and smooth errors of EMG channels of
unknown size: what the black box can explain, no effect has explained.

Letters: D coefficients, P parameters, T tasks, K channels, N nodes, B phase functions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import lsq_linear
from scipy.stats import chi2, norm

from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.result import JOIN

# Share of the signature error that is spread over all channels, for effects on the record.
SPREAD_SHARE = 0.3
# Errors of what muscles change, in units of the signature error. In simulated persons with another
# control, channels of EMG that changed much had the shape that the model predicts (cosine 0.94 to
# 0.99) and sizes off by 0.6 to 2, alike in all tasks; angles had hardly its shape (0 to 0.5).
# Factor on a channel, of a person in all tasks and of one task by itself:
PERSON_FACTOR, TASK_FACTOR = 1.7, 0.7
# Share of the error of the shape that is the same in all tasks.
SHAPE_SHARED = 0.5
SHAPE_ERROR = {"kinematics": 2.0, "emg": 1.0, "contact_force": 1.0}
# Signature error of effects on the record, which no muscle has to act for, over that of others.
RECORD_SHARE = 0.5
# Least squares are repeated with new errors until parameters change by less than this share of
# their prior spread, at most so often.
REWEIGHTINGS, SETTLED = 12, 0.01
BLACK_BOX_SIZES = (0.1, 0.3, 1.0, 3.0, 10.0)


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """An effect, or a pair of them, linearised.

    Attributes
    ----------
    effects : one, or the two of a pair
    at : (P,) internal parameters of the linearisation
    value : (D, E) change that each effect makes there; slope : (D, P) per unit of a parameter
    firmness : with which the person keeps the movement against the effects
    """

    effects: tuple[Effect, ...]
    at: np.ndarray
    value: np.ndarray
    slope: np.ndarray
    firmness: float

    @property
    def label(self) -> str:
        """Label in answers."""
        return JOIN.join(sorted(effect.label for effect in self.effects))

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper internal bounds (P,)."""
        ends = np.array([p.bounds for effect in self.effects for p in effect.params])
        return ends[:, 0], ends[:, 1]

    @property
    def prior_sd(self) -> np.ndarray:
        """Prior spread of the internal parameters, (P,)."""
        return np.array([p.prior_sd for effect in self.effects for p in effect.params])

    @property
    def order(self) -> list[tuple[int, int]]:
        """Pairs of parameters of which the first is never above the second."""
        starts = np.cumsum([0, *(len(effect.params) for effect in self.effects)])
        return [
            (int(start) + i, int(start) + j)
            for start, effect in zip(starts, self.effects, strict=False)
            for i, j in effect.order
        ]

    def predict(self, x: np.ndarray) -> np.ndarray:
        """Change (D,) at internal parameters (P,)."""
        return self.changes(x).sum(axis=1)

    def changes(self, x: np.ndarray) -> np.ndarray:
        """Change (D, E) by each effect at internal parameters (P,)."""
        ends = np.cumsum([len(effect.params) for effect in self.effects])[:-1]
        parts = zip(np.split(self.slope, ends, axis=1), np.split(x - self.at, ends), strict=True)
        return self.value + np.stack([slope @ by for slope, by in parts], axis=1)

    def error(self, x: np.ndarray, comparison: Comparison, relative: float) -> SignatureError:
        """Error of the change predicted at internal parameters (P,), of each effect by itself."""
        covariance = np.zeros((len(self.slope), len(self.slope)))
        for effect, change in zip(self.effects, self.changes(x).T, strict=True):
            share = own_error(effect, relative)
            covariance += change_error(comparison, change, share, effect.changes_body)
        return SignatureError(covariance)

    def part(self, rows: np.ndarray) -> Hypothesis:
        """The same for some coefficients."""
        return replace(self, value=self.value[rows], slope=self.slope[rows])


@dataclass(frozen=True, eq=False)
class Fit:
    """A hypothesis fitted to a difference.

    Attributes
    ----------
    hypothesis : that was fitted
    x : (P,) internal parameters; covariance : (P, P) of them
    log_evidence : log density of the difference, whitened
    left : sum of squares of the whitened difference that remains
    misfit : mean square of what remains in units of noise and of the errors of the prediction:
        about one where both are as assumed
    """

    hypothesis: Hypothesis
    x: np.ndarray
    covariance: np.ndarray
    log_evidence: float
    left: float
    misfit: float

    @property
    def label(self) -> str:
        """Label in answers."""
        return self.hypothesis.label

    @property
    def predicted(self) -> np.ndarray:
        """Change (D,) that the fit predicts."""
        return self.hypothesis.predict(self.x)


class SignatureError:
    """Whitened residuals (D,), normal with covariance I + E, E (D, D) the error of a prediction."""

    def __init__(self, error: np.ndarray) -> None:
        covariance = error + np.eye(len(error))
        self._factor = cho_factor(covariance, lower=True, overwrite_a=True)
        self.logdet = 2.0 * float(np.log(np.diag(self._factor[0])).sum())

    def solve(self, vectors: np.ndarray) -> np.ndarray:
        """Inverse of I + E times vectors (D,) or (D, P)."""
        return cho_solve(self._factor, vectors)

    def squares(self, residual: np.ndarray) -> float:
        """Sum of squares of a whitened residual (D,) in units of I + E."""
        return float(residual @ self.solve(residual))

    def log_density(self, squares: float, count: int) -> float:
        """Log density of a whitened residual with a sum of squares in units of I + E."""
        return -0.5 * (squares + self.logdet + count * np.log(2.0 * np.pi))


def own_error(effect: Effect, relative: float) -> float:
    """Relative error of an effect's change, of the signature error.

    What acts on the record itself is known better than what a person's control makes of it.
    """
    return relative if effect.changes_body else RECORD_SHARE * relative


def change_error(
    comparison: Comparison, change: np.ndarray, relative: float, controlled: bool
) -> np.ndarray:
    """Covariance (D, D), whitened, of the error of a predicted change.

    Parameters
    ----------
    comparison : what is explained
    change : (D,) predicted
    relative : error of each channel's change, relative
    controlled : whether muscles make the change, so that its shape depends on a person's control
    """
    by_channel = comparison.white_by_channel(change)
    if controlled:
        of_person = comparison.over_tasks(by_channel)
        factors = relative * np.hstack([TASK_FACTOR * by_channel, PERSON_FACTOR * of_person])
        covariance = factors @ factors.T
        for kind in comparison.kinds:
            size = SHAPE_ERROR[kind.name] * relative
            mean_square = float(np.mean((change[kind.rows] / kind.deviations) ** 2))
            if mean_square > 0.0:
                covariance += size**2 * mean_square * SHAPE_SHARED * kind.shared
                covariance += size**2 * mean_square * (1.0 - SHAPE_SHARED) * kind.covariance
        return covariance
    covariance = relative**2 * by_channel @ by_channel.T
    whole = by_channel.sum(axis=1)
    spread = (SPREAD_SHARE * relative) ** 2 * float(whole @ whole) / len(whole)
    covariance[np.diag_indices_from(covariance)] += spread
    return covariance


def fit(hypothesis: Hypothesis, comparison: Comparison, relative_error: float) -> Fit:
    """Most probable parameters inside their bounds, and evidence by Laplace's method."""
    system = _System(
        hypothesis,
        comparison,
        relative_error,
        slope=comparison.whiten(hypothesis.slope),
        target=comparison.whiten(
            comparison.delta - hypothesis.value.sum(axis=1) + hypothesis.slope @ hypothesis.at
        ),
    )
    low, high = hypothesis.bounds
    first = np.eye(len(low))[0] * hypothesis.prior_sd
    # Errors grow with predictions: what contradicts a small effect, a large one may bear.
    starts = [np.clip(hypothesis.at + sign * first, low, high) for sign in (0.0, 1.0, -1.0)]
    settled = (system.settled(start) for start in np.unique(starts, axis=0))
    x, error = min(((x, system.error(x)) for x in settled), key=lambda found: system.loss(*found))
    curvature = system.slope.T @ error.solve(system.slope) + np.diag(hypothesis.prior_sd**-2.0)
    residual = system.residual(x)
    squares = error.squares(residual)
    one_sided = np.sum((low >= 0.0) | (high <= 0.0))
    _, logdet = np.linalg.slogdet(curvature)
    log_evidence = (
        error.log_density(squares, len(residual))
        + _log_prior(hypothesis, x)
        + one_sided * np.log(2.0)
        + 0.5 * (len(x) * np.log(2.0 * np.pi) - float(logdet))
    )
    return Fit(
        hypothesis,
        x,
        np.linalg.inv(curvature),
        log_evidence,
        left=float(residual @ residual),
        misfit=squares / len(residual),
    )


@dataclass(frozen=True, eq=False)
class _System:
    """Least squares of a hypothesis, whitened.

    Attributes
    ----------
    hypothesis, comparison, relative_error : as for :func:`fit`
    slope : (D, P) change per unit of a parameter
    target : (D,) difference to explain, from the origin of the parameters
    """

    hypothesis: Hypothesis
    comparison: Comparison
    relative_error: float
    slope: np.ndarray
    target: np.ndarray

    def error(self, x: np.ndarray) -> SignatureError:
        """Error of what parameters (P,) predict."""
        return self.hypothesis.error(x, self.comparison, self.relative_error)

    def residual(self, x: np.ndarray) -> np.ndarray:
        """What parameters (P,) leave of the difference, (D,)."""
        return self.target - self.slope @ x

    def loss(self, x: np.ndarray, error: SignatureError) -> float:
        """Negative log density of the difference and parameters (P,), up to one-sided priors."""
        residual = self.residual(x)
        density = error.log_density(error.squares(residual), len(residual))
        return -density - _log_prior(self.hypothesis, x)

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
    free = np.linalg.solve(normal, right)
    if np.all((low <= free) & (free <= high)):
        return free
    factor = np.linalg.cholesky(normal)
    span = np.maximum(high - low, 1e-9)
    # An active set of few parameters is exact and ten times as fast as an interior point.
    target = np.linalg.solve(factor, right)
    solved = lsq_linear(factor.T, target, (low - 1e-12 * span, high), method="bvls")
    return np.clip(solved.x, low, high)


def _log_prior(hypothesis: Hypothesis, x: np.ndarray) -> float:
    return float(np.sum(norm.logpdf(x, scale=hypothesis.prior_sd)))


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
    """Both effects on the same person at once, their changes added."""
    one, two = first.hypothesis, second.hypothesis
    return Hypothesis(
        effects=(*one.effects, *two.effects),
        at=np.concatenate([one.at, two.at]),
        value=np.hstack([one.value, two.value]),
        slope=np.hstack([one.slope, two.slope]),
        firmness=one.firmness,
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


def strongest(fits: Sequence[Fit], priors: Mapping[str, float], count: int) -> list[Fit]:
    """The fits with most evidence and prior, the best first."""
    return sorted(fits, key=lambda f: -(f.log_evidence + np.log(priors[f.label])))[:count]
