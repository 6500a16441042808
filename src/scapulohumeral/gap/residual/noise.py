"""How repeats of one person scatter, and what else two recordings may differ by without a cause.

The covariance between repeats is shrunk toward a prior. What changes between two sessions is added,
and without reference trials the error of the model itself.

Letters: N nodes, K channels, B phase functions, T tasks, D = T K B, L trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from scapulohumeral.gap.recording.observables import channel_kind
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.settings import ModelSpread, NoisePrior
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

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


def draws(residual: Residual, count: int, seed: int) -> np.ndarray:
    """Differences without any effect, (D, count), noise estimated from few repeats included."""
    rng = np.random.default_rng(seed)
    factors = [
        np.linalg.cholesky(part + 1e-12 * np.eye(len(part)) * np.trace(part) / len(part))
        for part in (residual.noise, residual.covariance - residual.noise)
    ]
    noise, rest = (factor @ rng.normal(size=(len(factor), count)) for factor in factors)
    # The size of the noise is estimated itself; channels share their estimates, each with several
    # independent phases, which counts like as many more repeats.
    degrees = residual.degrees * INDEPENDENT_PHASES
    return rest + noise * np.sqrt(degrees / rng.chisquare(degrees, count))


def total_covariance(
    noise: np.ndarray,
    signatures: Sequence[TaskSignatures],
    functions: np.ndarray,
    model: tuple[ModelSpread, Sequence[str]] | None,
    share: float,
) -> np.ndarray:
    """Covariance (D, D) of a difference without any effect.

    Parameters
    ----------
    noise : (D, D) of the mean differences between repeats
    signatures : of the tasks, with nuisances
    functions : (N, B)
    model : spread of the model's own error and names of the channels; None with reference trials
    share : of the nuisances' standard deviations
    """
    total = noise.copy()
    posture = [compress([of_task.posture], functions) for of_task in signatures]
    total += share**2 * block_diag(*(columns @ columns.T for columns in posture))
    session = compress([of_task.session for of_task in signatures], functions)
    total += share**2 * session @ session.T
    if model is not None:
        spread, channels = model
        total += np.diag(
            np.tile(_variances(channels, vars(spread), functions).ravel(), len(signatures))
        )
    return total
