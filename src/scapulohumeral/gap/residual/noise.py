"""How repeats of one person scatter, and what else two recordings may differ by without a cause.

Repeats of real people scatter in timing and in posture: about half of it is where in the movement a
trial is, one unknown curve that all channels share. The covariance of a trial is that of this
timing and of smooth posture, as large as the repeats of a case say and else as recorded repeats of
other people were. What changes between two sessions is added, and without reference trials the
error of the model itself.

Letters: N nodes, K channels, B phase functions, T tasks, D = T K B, L trials, W warping functions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.observables import channel_kind, channel_rates
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.settings import JointSpread, ModelSpread, NoisePrior
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

# No coefficient of a channel varies less than this share of what other people's do: rounding is no
# knowledge.
LEAST_SCALE = 0.02
# What repeats say of their full covariance counts for at most this share beside the model of it:
# few repeats do not pin a covariance.
OWN_SHAPE = 0.5


class SessionShares(NamedTuple):
    """Shares of what sessions are assumed to change, by what is put on again.

    Electrodes may stay where they are while markers move, and the other way round.

    Attributes
    ----------
    markers : of segment frames and of the posture, which motion is seen by
    electrodes : of gain, offset and timing of EMG
    """

    markers: float
    electrodes: float


class Scattering(NamedTuple):
    """What scatters by itself from repeat to repeat: channels of one kind in one task."""

    task: str
    kind: str


@dataclass(frozen=True, eq=False)
class Noise:
    """Covariance of one trial about the mean of its task.

    Attributes
    ----------
    covariances : by task (K B, K B), channel by channel
    degrees : by task, degrees of freedom of the repeats behind it; 0 if there are none
    worth : by task, the same with the repeats that prior knowledge is worth
    """

    covariances: Mapping[str, np.ndarray]
    degrees: Mapping[str, int]
    worth: Mapping[str, float]

    @property
    def source(self) -> str:
        """Where it comes from: "repeats", or "configuration" for `noise` of the settings alone."""
        return "repeats" if any(self.degrees.values()) else "configuration"


@dataclass(frozen=True, eq=False)
class Repeats:
    """Repeats of one task: their mean record, and curves (L, N, K) of each side about its mean."""

    mean: Observation
    sides: tuple[np.ndarray, ...]

    @property
    def degrees(self) -> int:
        """Degrees of freedom of what they scatter."""
        return sum(len(side) - 1 for side in self.sides)


def trial_noise(
    repeats: Mapping[str, Repeats],
    channels: Sequence[str],
    functions: np.ndarray,
    prior: NoisePrior,
) -> Noise:
    """Covariance between repeats of each task.

    Parameters
    ----------
    repeats : by task; channels : (K,) names; functions : (N, B)
    prior : how repeats of other people scatter

    Notes
    -----
    People and tasks differ by factors: the scale of each channel over all tasks, and that of each
    task over all channels, is a geometric mean of what the repeats show and of what others' do.
    """
    expected = {
        task: _expected(one.mean, channels, functions, prior) for task, one in repeats.items()
    }
    samples = {task: _sample(one, functions) for task, one in repeats.items()}
    degrees = {task: one.degrees for task, one in repeats.items()}
    whole = sum(degrees.values())
    size = functions.shape[1]
    ratios = [
        degrees[task] * _channel_ratios(samples[task], expected[task], size) for task in repeats
    ]
    shown = np.sum(ratios, axis=0) / max(whole, 1)
    scale = _shrunk(shown, whole, prior.repeats)
    grown = np.repeat(np.sqrt(scale), size)
    covariances = {}
    for task, one in expected.items():
        target = one * np.outer(grown, grown)
        own = np.mean(np.diag(samples[task]) / np.diag(target), keepdims=True)
        target = target * _shrunk(own, degrees[task], prior.repeats)
        share = OWN_SHAPE * degrees[task] / (degrees[task] + prior.repeats)
        covariances[task] = share * samples[task] + (1.0 - share) * target
    worth = {task: count + prior.repeats for task, count in degrees.items()}
    return Noise(covariances, degrees, worth)


def _sample(repeats: Repeats, functions: np.ndarray) -> np.ndarray:
    """Covariance (K B, K B) of repeats about their means; zero without any."""
    parts = [compress([side - side.mean(axis=0)], functions) for side in repeats.sides]
    return sum(part @ part.T for part in parts) / max(repeats.degrees, 1)


def _channel_ratios(sample: np.ndarray, expected: np.ndarray, size: int) -> np.ndarray:
    """Variance (K,) of each channel over the expected one."""
    own, other = (np.diag(one).reshape(-1, size).sum(axis=1) for one in (sample, expected))
    return own / other


def _shrunk(ratio: np.ndarray, degrees: int, worth: float) -> np.ndarray:
    """Geometric mean of a ratio and one: by degrees of freedom, and what the one is worth."""
    return np.maximum(ratio, LEAST_SCALE) ** (degrees / (degrees + worth))


def _expected(
    mean: Observation, channels: Sequence[str], functions: np.ndarray, prior: NoisePrior
) -> np.ndarray:
    """Covariance (K B, K B) of one trial as repeats of other people have it."""
    levels = np.array([deviation(prior, name) for name in channels])
    if mean.emg is not None:
        heights = np.sqrt(np.mean(mean.emg**2, axis=0))
        of_emg = _of_emg(channels)
        levels[of_emg] = np.hypot(levels[of_emg], prior.emg_relative * heights)
    columns = timing(mean, functions, prior.phase_shift)
    return np.diag(_variances(levels, functions, 1.0).ravel()) + columns @ columns.T


def _of_emg(channels: Sequence[str]) -> np.ndarray:
    """Which channels are EMG, (K,)."""
    return np.array([channel_kind(name) == "emg" for name in channels])


def deviation(spread: NoisePrior | ModelSpread, channel: str) -> float:
    """Standard deviation of a channel, in its unit."""
    kind = channel_kind(channel)
    if kind == "emg":
        return spread.emg
    if kind == "contact_force":
        return spread.contact_N
    joints = spread.kinematics_deg
    if isinstance(joints, JointSpread):
        return float(getattr(joints, channel.split("_")[0]))
    return joints


def timing(mean: Observation, functions: np.ndarray, phase_shift: Sequence[float]) -> np.ndarray:
    """Change (K B, W) of a record by being elsewhere in the movement, all channels alike.

    Parameters
    ----------
    mean : record; functions : (N, B)
    phase_shift : (W,) standard deviation of each cosine of phase [share of the duration]
    """
    rates = channel_rates(mean)
    phase = np.linspace(0.0, 1.0, len(rates))
    shifts = [sd * np.cos(np.pi * i * phase) for i, sd in enumerate(phase_shift)]
    return compress([np.stack([shift[:, None] * rates for shift in shifts])], functions)


def _variances(levels: np.ndarray, functions: np.ndarray, exponent: float) -> np.ndarray:
    """Variances (K, B) of coefficients of smooth curves with standard deviations (K,)."""
    shape = 1.0 / (1.0 + np.arange(functions.shape[1])) ** exponent
    return len(functions) * levels[:, None] ** 2 * shape / shape.sum()


def smooth_share(delta: np.ndarray, functions: np.ndarray, share: float) -> np.ndarray:
    """Covariance (D, D) of smooth errors as large as a share of each channel of a difference.

    Parameters
    ----------
    delta : (D,) coefficients; functions : (N, B); share : root mean square over that of the channel
    """
    each = delta.reshape(-1, functions.shape[1])
    levels = share * np.sqrt(np.sum(each**2, axis=1) / len(functions))
    return np.diag(_variances(levels, functions, 2.0).ravel())


def draws(residual: Residual, count: int, seed: int) -> np.ndarray:
    """Differences without any effect, (D, count), noise estimated from few repeats included.

    The scale of a task's noise is known by as many degrees of freedom as its repeats and prior
    knowledge are worth, so each task has Student's t tails of its own.
    """
    rng = np.random.default_rng(seed)
    factors = [
        np.linalg.cholesky(part + 1e-12 * np.eye(len(part)) * np.trace(part) / len(part))
        for part in (residual.noise, residual.covariance - residual.noise)
    ]
    noise, rest = (factor @ rng.normal(size=(len(factor), count)) for factor in factors)
    size = len(noise) // len(residual.tasks)
    degrees = np.array(residual.degrees)[:, None]
    scales = np.sqrt(degrees / rng.chisquare(degrees, (len(degrees), count)))
    return rest + noise * np.repeat(scales, size, axis=0)


def scatterings(residual: Residual) -> list[Scattering]:
    """All that scatters by itself in a comparison."""
    return [Scattering(task, kind.name) for task in residual.tasks for kind in residual.kinds]


def scattered(residual: Residual, factors: Mapping[Scattering, float]) -> Residual:
    """A comparison whose repeats scatter more or less than was told of them.

    Its covariance stays as it is: it has to be made of that again (:func:`total_covariance`).

    Parameters
    ----------
    residual : its `noise` is what was told
    factors : of the standard deviation
    """
    by_channel = [
        factors[Scattering(task, channel_kind(name))]
        for task in residual.tasks
        for name in residual.channels
    ]
    grown = np.repeat(by_channel, residual.functions.shape[1])
    return replace(residual, noise=residual.noise * np.outer(grown, grown))


def log_density_of_scatter(factor: float, degrees: float) -> float:
    """Log density of a factor of the standard deviation, over that of a factor of one.

    Of a variance that is known by some degrees of freedom: scaled inverse chi-squared (Gelman et
    al., Bayesian Data Analysis, 3rd edition, section 2.6), by the logarithm of the factor.
    """
    return -degrees * (np.log(factor) + 0.5 * (factor**-2.0 - 1.0))


def normal_draws(covariance: np.ndarray, count: int, rng: np.random.Generator) -> np.ndarray:
    """Normal vectors (count, D) of a covariance (D, D), which may lack directions."""
    variances, axes = np.linalg.eigh(covariance)
    # Rounding makes variances of nothing negative.
    deviations = np.sqrt(np.maximum(variances, 0.0))
    return (deviations * rng.normal(size=(count, len(variances)))) @ axes.T


def total_covariance(
    noise: np.ndarray,
    signatures: Sequence[TaskSignatures],
    functions: np.ndarray,
    channels: Sequence[str],
    model: ModelSpread | None,
    shares: SessionShares,
) -> np.ndarray:
    """Covariance (D, D) of a difference without any effect.

    Parameters
    ----------
    noise : (D, D) of the mean differences between repeats
    signatures : of the tasks, with nuisances and what nobody measured
    functions : (N, B)
    channels : (K,) names
    model : spread of the model's own error; None with reference trials
    shares : of the nuisances' standard deviations
    """
    total = noise.copy()
    posture = [compress([of_task.posture], functions) for of_task in signatures]
    total += shares.markers**2 * block_diag(*(columns @ columns.T for columns in posture))
    # Not a matter of sessions: no share of it is taken.
    always = [
        compress([np.concatenate([of_task.unmeasured, of_task.tempo_errors])], functions)
        for of_task in signatures
    ]
    total += block_diag(*(columns @ columns.T for columns in always))
    by_channel = np.where(_of_emg(channels), shares.electrodes, shares.markers)
    session = compress([of_task.session * by_channel for of_task in signatures], functions)
    total += session @ session.T
    if model is not None:
        levels = np.array([deviation(model, name) for name in channels])
        variances = _variances(levels, functions, 2.0)
        total += np.diag(np.tile(variances.ravel(), len(signatures)))
    return total
