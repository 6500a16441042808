"""What repeats of one person cannot agree on, and the difference to explain on that scale.

Curves are kept as coefficients of smooth phase functions, because errors between trials are smooth
too: the unit of evidence is the trial, never the sample. Their covariance is that between repeats,
shrunk toward a prior, plus what changes between two recordings of one person without a cause, plus,
without reference trials, the error of the model itself.

Letters: N nodes, K channels, B phase functions, T tasks, D = T K B, L trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from scapulohumeral.gap.observe import channel_kind
from scapulohumeral.gap.settings import ModelSpread, NoisePrior
from scapulohumeral.gap.signatures import Response

# Phases of a movement between which errors of one trial are nearly independent.
INDEPENDENT_PHASES = 3
# No coefficient of a channel varies less than this share of its mean: rounding is no knowledge.
LEAST_VARIANCE = 0.05


@dataclass(frozen=True, eq=False)
class Noise:
    """Covariance of one trial about the mean of its task.

    Attributes
    ----------
    covariance : (K B, K B), channel by channel
    degrees : degrees of freedom of the repeats behind it; 0 if there are none
    worth : the same with the repeats that prior knowledge is worth
    """

    covariance: np.ndarray
    degrees: int
    worth: float

    @property
    def source(self) -> str:
        """Where it comes from: "repeats", or "configuration" for its section `gap.noise` alone."""
        return "repeats" if self.degrees > 0 else "configuration"


@dataclass(frozen=True, eq=False)
class Kind:
    """Channels of one kind in a comparison.

    Attributes
    ----------
    name : of the kind; rows : (R,) positions of its coefficients in (D,)
    deviations : (R,) standard deviations between repeats
    covariance : (D, D), whitened, of independent changes of all of them by one deviation
    shared : the same for changes that are alike in all tasks
    """

    name: str
    rows: np.ndarray
    deviations: np.ndarray
    covariance: np.ndarray
    shared: np.ndarray


@dataclass(frozen=True, eq=False)
class Comparison:
    """A difference to explain, and its covariance without any effect.

    Attributes
    ----------
    delta : (D,) test minus reference, or recorded minus predicted
    covariance : (D, D); noise : (D, D) the part of it that repeats determine
    functions : (N, B) phase functions
    tasks : (T,) names; channels : (K,) names
    degrees : that the noise is known with
    """

    delta: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray
    functions: np.ndarray
    tasks: tuple[str, ...]
    channels: tuple[str, ...]
    degrees: float

    @cached_property
    def _factor(self) -> np.ndarray:
        return np.linalg.cholesky(self.covariance)

    def whiten(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (D,) or (D, P) in units in which noise is independent and of size one."""
        return solve_triangular(self._factor, vectors, lower=True)

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """Kinds of channels that there are."""
        found = dict.fromkeys(channel_kind(name) for name in self.channels)
        return tuple(self._kind(name) for name in found)

    def _kind(self, name: str) -> Kind:
        rows = self.channel_rows([c for c in self.channels if channel_kind(c) == name])
        deviations = np.sqrt(np.diag(self.noise)[rows])
        columns = np.zeros((len(self.delta), len(rows)))
        columns[rows, np.arange(len(rows))] = deviations
        white = self.whiten(columns)
        alike = self.over_tasks(white)
        return Kind(name, rows, deviations, white @ white.T, alike @ alike.T)

    @cached_property
    def _whitening(self) -> np.ndarray:
        """What whitens, (D, T K, B)."""
        whitening = self.whiten(np.eye(len(self.delta)))
        return whitening.reshape(len(whitening), -1, self.functions.shape[1])

    def white_by_channel(self, vector: np.ndarray) -> np.ndarray:
        """Whitened columns (D, T K) of a vector's (D,) part of one channel of one task each."""
        return np.einsum("dcb,cb->dc", self._whitening, vector.reshape(self._whitening.shape[1:]))

    def white_by_channel_of_all_tasks(self, vector: np.ndarray) -> np.ndarray:
        """Whitened columns (D, K) of a vector's (D,) part of one channel each."""
        return self.over_tasks(self.white_by_channel(vector))

    def over_tasks(self, columns: np.ndarray) -> np.ndarray:
        """Sums of columns (D, T C) of all tasks, (D, C)."""
        return columns.reshape(len(columns), len(self.tasks), -1).sum(axis=1)

    def scaled(self, vector: np.ndarray, factors: np.ndarray) -> np.ndarray:
        """A vector (D,) with its channels times factors (K,)."""
        shape = (len(self.tasks), len(self.channels), self.functions.shape[1])
        return (vector.reshape(shape) * factors[:, None]).ravel()

    def compress(self, curves: Sequence[np.ndarray]) -> np.ndarray:
        """Curves (..., N, K) of each task as coefficients (D, ...)."""
        return compress(curves, self.functions)

    def curves(self, vector: np.ndarray) -> np.ndarray:
        """Curves (T, N, K) of coefficients (D,)."""
        shape = (len(self.tasks), len(self.channels), self.functions.shape[1])
        return np.einsum("nb,tkb->tnk", self.functions, vector.reshape(shape))

    @cached_property
    def spread(self) -> np.ndarray:
        """Standard deviations (T, N, K) of the curves without any effect."""
        return self._deviations(self.covariance)

    @property
    def floor(self) -> np.ndarray:
        """Standard deviations (T, N, K) of the curves that repeats determine."""
        return self._deviations(self.noise)

    def _deviations(self, covariance: np.ndarray) -> np.ndarray:
        count = len(self.tasks) * len(self.channels)
        size = self.functions.shape[1]
        blocks = [
            covariance[i * size : (i + 1) * size, i * size : (i + 1) * size] for i in range(count)
        ]
        variance = np.einsum("nb,ibc,nc->in", self.functions, np.array(blocks), self.functions)
        shaped = variance.reshape(len(self.tasks), len(self.channels), -1)
        return np.sqrt(shaped).transpose(0, 2, 1)

    def part(self, tasks: Sequence[str]) -> Comparison:
        """The same for some of the tasks."""
        kept = tuple(task for task in self.tasks if task in tasks)
        return replace(self._of(self.rows(tasks)), tasks=kept)

    def only(self, channels: Sequence[str]) -> Comparison:
        """The same for some of the channels."""
        kept = tuple(name for name in self.channels if name in channels)
        return replace(self._of(self.channel_rows(kept)), channels=kept)

    def _of(self, rows: np.ndarray) -> Comparison:
        square = np.ix_(rows, rows)
        return replace(
            self,
            delta=self.delta[rows],
            covariance=self.covariance[square],
            noise=self.noise[square],
        )

    def channel_rows(self, channels: Sequence[str]) -> np.ndarray:
        """Positions in (D,) that belong to some of the channels."""
        chosen = np.isin(self.channels, list(channels))
        return np.flatnonzero(np.tile(np.repeat(chosen, self.functions.shape[1]), len(self.tasks)))

    def rows(self, tasks: Sequence[str]) -> np.ndarray:
        """Positions in (D,) that belong to some of the tasks."""
        size = len(self.channels) * self.functions.shape[1]
        starts = [i * size for i, task in enumerate(self.tasks) if task in tasks]
        return np.concatenate([start + np.arange(size) for start in starts])


def compress(curves: Sequence[np.ndarray], functions: np.ndarray) -> np.ndarray:
    """Coefficients (D, ...) of curves (..., N, K), one array per task."""
    parts = []
    for curve in curves:
        coefficients = np.einsum("nb,...nk->kb...", functions, curve)
        parts.append(coefficients.reshape(-1, *curve.shape[:-2]))
    return np.concatenate(parts)


def trial_noise(
    groups: Sequence[np.ndarray], channels: Sequence[str], functions: np.ndarray, prior: NoisePrior
) -> Noise:
    """Covariance between repeats.

    Parameters
    ----------
    groups : curves (L, N, K) of the repeats of one task and side, one array per group
    channels : (K,) names; functions : (N, B)
    prior : knowledge that stands in for repeats that are not there

    Notes
    -----
    The variance of each channel and the spectrum of each kind of channel are pooled over all
    groups. Half of the weight that the repeats deserve goes to their full covariance, so that what
    varies together counts once.
    """
    residuals = [
        compress([group - group.mean(axis=0)], functions).T for group in groups if len(group) > 1
    ]
    degrees = sum(len(group) - 1 for group in groups)
    size = functions.shape[1]
    prior_variance = _variances(channels, vars(prior), functions)
    if not degrees:
        return Noise(np.diag(prior_variance.ravel()), 0, prior.repeats)
    sample = sum(r.T @ r for r in residuals) / degrees
    own = np.diag(sample).reshape(-1, size)
    weight = degrees / (degrees + prior.repeats)
    kinds = np.array([channel_kind(name) for name in channels])
    total = weight * own.sum(axis=1) + (1.0 - weight) * prior_variance.sum(axis=1)
    spectrum = np.zeros_like(own)
    for kind in set(kinds):
        shares = own[kinds == kind] / np.maximum(
            own[kinds == kind].sum(axis=1, keepdims=True), 1e-12
        )
        expected = (
            prior_variance[kinds == kind] / prior_variance[kinds == kind].sum(axis=1)[:, None]
        )
        spectrum[kinds == kind] = weight * shares.mean(axis=0) + (1.0 - weight) * expected
    spectrum = np.maximum(spectrum, LEAST_VARIANCE / size)
    target = np.diag((total[:, None] * spectrum).ravel())
    covariance = 0.5 * weight * sample + (1.0 - 0.5 * weight) * target
    return Noise(covariance, degrees, degrees + prior.repeats)


def _variances(
    channels: Sequence[str], spread: dict[str, float], functions: np.ndarray
) -> np.ndarray:
    """Variances (K, B) of coefficients of smooth curves with given standard deviations."""
    names = {"kinematics": "kinematics_deg", "emg": "emg", "contact_force": "contact_N"}
    shape = 1.0 / (1.0 + np.arange(functions.shape[1])) ** 2
    level = np.array([spread[names[channel_kind(name)]] for name in channels]) ** 2
    return len(functions) * level[:, None] * shape / shape.sum()


def draws(comparison: Comparison, count: int, seed: int) -> np.ndarray:
    """Differences without any effect, (D, count), noise estimated from few repeats included."""
    rng = np.random.default_rng(seed)
    factors = [
        np.linalg.cholesky(part + 1e-12 * np.eye(len(part)) * np.trace(part) / len(part))
        for part in (comparison.noise, comparison.covariance - comparison.noise)
    ]
    noise, rest = (factor @ rng.normal(size=(len(factor), count)) for factor in factors)
    # The size of the noise is estimated itself; channels share their estimates, each with several
    # independent phases, which counts like as many more repeats.
    degrees = comparison.degrees * INDEPENDENT_PHASES
    return rest + noise * np.sqrt(degrees / rng.chisquare(degrees, count))


def total_covariance(
    noise: np.ndarray,
    responses: Sequence[Response],
    functions: np.ndarray,
    model: tuple[ModelSpread, Sequence[str]] | None,
    share: float,
) -> np.ndarray:
    """Covariance (D, D) of a difference without any effect.

    Parameters
    ----------
    noise : (D, D) of the mean differences between repeats
    responses : of the tasks, with nuisances
    functions : (N, B)
    model : spread of the model's own error and names of the channels; None with reference trials
    share : of the nuisances' standard deviations
    """
    total = noise.copy()
    posture = [compress([response.posture], functions) for response in responses]
    total += share**2 * block_diag(*(columns @ columns.T for columns in posture))
    session = compress([response.session for response in responses], functions)
    total += share**2 * session @ session.T
    if model is not None:
        spread, channels = model
        total += np.diag(
            np.tile(_variances(channels, vars(spread), functions).ravel(), len(responses))
        )
    return total
