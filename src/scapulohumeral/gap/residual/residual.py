"""The difference to explain, as coefficients of smooth phase functions, with its covariance.

Errors between trials are smooth too: the unit of evidence is the trial, never the sample.

Letters: N nodes, K channels, B phase functions, T tasks, D = T K B.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import solve_triangular

from scapulohumeral.gap.recording.observables import channel_kind
from scapulohumeral.gap.residual.axes import Axes, Kind, axes

# What is made once of a covariance.
OF_COVARIANCE = ("_factor", "log_volume", "axes", "kinds", "spread")


@dataclass(frozen=True, eq=False)
class Residual:
    """A difference to explain, and its covariance without any effect.

    Attributes
    ----------
    delta : (D,) test minus reference, or recorded minus predicted
    covariance : (D, D); noise : (D, D) the part of it that repeats determine
    functions : (N, B) phase functions
    tasks : (T,) names; channels : (K,) names
    degrees : (T,) degrees of freedom by which the noise of each task is known
    moved_deg : supposed size of another movement [deg], part of the covariance
    """

    delta: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray
    functions: np.ndarray
    tasks: tuple[str, ...]
    channels: tuple[str, ...]
    degrees: tuple[float, ...]
    moved_deg: float = 0.0

    @cached_property
    def _factor(self) -> np.ndarray:
        return np.linalg.cholesky(self.covariance)

    @cached_property
    def log_volume(self) -> float:
        """Half the logarithm of the determinant of the covariance: what whitening shrinks."""
        return float(np.log(np.diag(self._factor)).sum())

    def whiten(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (D,) or (D, P) in units in which noise is independent and of size one."""
        return solve_triangular(self._factor, vectors, lower=True)

    def unturned(self, directions: np.ndarray) -> np.ndarray:
        """Weights (D, P) of vectors whose sums are whitened vectors along directions (D, P)."""
        return solve_triangular(self._factor, directions, lower=True, trans="T")

    @cached_property
    def axes(self) -> Axes:
        """Whitened axes along which errors of the shape of a prediction are independent."""
        return axes(self._factor, self.kinds, len(self.tasks), self.functions.shape[1])

    @cached_property
    def kinds(self) -> tuple[Kind, ...]:
        """Kinds of channels that there are."""
        found = dict.fromkeys(channel_kind(name) for name in self.channels)
        return tuple(self._kind(name) for name in found)

    def _kind(self, name: str) -> Kind:
        rows = self.channel_rows([c for c in self.channels if channel_kind(c) == name])
        return Kind(name, rows, np.sqrt(np.diag(self.noise)[rows]))

    def scaled(self, vector: np.ndarray, factors: np.ndarray) -> np.ndarray:
        """A vector (D,) with its channels times factors (K,)."""
        shape = (len(self.tasks), len(self.channels), self.functions.shape[1])
        return (vector.reshape(shape) * factors[:, None]).ravel()

    def compress(self, curves: Sequence[np.ndarray]) -> np.ndarray:
        """Curves (..., N, K) of each task as coefficients (D, ...)."""
        return compress(curves, self.functions)

    def curves(self, vector: np.ndarray) -> np.ndarray:
        """Curves (T, N, K) of coefficients (D,)."""
        return np.array(list(self.curves_by_task(vector)))

    def curves_by_task(self, vectors: np.ndarray) -> Iterator[np.ndarray]:
        """Curves (..., N, K) of each task of coefficients (D, ...)."""
        shape = (len(self.tasks), len(self.channels), self.functions.shape[1])
        for own in vectors.reshape(*shape, *vectors.shape[1:]):
            yield np.einsum("nb,kb...->...nk", self.functions, own)

    @cached_property
    def spread(self) -> np.ndarray:
        """Standard deviations (T, N, K) of the curves without any effect."""
        count = len(self.tasks) * len(self.channels)
        size = self.functions.shape[1]
        blocks = [
            self.covariance[i * size : (i + 1) * size, i * size : (i + 1) * size]
            for i in range(count)
        ]
        variance = np.einsum("nb,ibc,nc->in", self.functions, np.array(blocks), self.functions)
        shaped = variance.reshape(len(self.tasks), len(self.channels), -1)
        return np.sqrt(shaped).transpose(0, 2, 1)

    def of(self, delta: np.ndarray) -> Residual:
        """Another difference (D,) of the same covariance: what was made of that is kept."""
        other = replace(self, delta=delta)
        made = vars(self)
        vars(other).update({name: made[name] for name in OF_COVARIANCE if name in made})
        return other

    def part(self, tasks: Sequence[str]) -> Residual:
        """The same for some of the tasks."""
        kept = tuple(task for task in self.tasks if task in tasks)
        degrees = tuple(
            degree for task, degree in zip(self.tasks, self.degrees, strict=True) if task in kept
        )
        return replace(self._of(self.rows(tasks)), tasks=kept, degrees=degrees)

    @cached_property
    def by_task(self) -> tuple[Residual, ...]:
        """The same for each task alone."""
        return tuple(self.part([task]) for task in self.tasks)

    def only(self, channels: Sequence[str]) -> Residual:
        """The same for some of the channels."""
        kept = tuple(name for name in self.channels if name in channels)
        return replace(self._of(self.channel_rows(kept)), channels=kept)

    def _of(self, rows: np.ndarray) -> Residual:
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
        size = curve.shape[-1] * functions.shape[1]
        parts.append(coefficients.reshape(size, *curve.shape[:-2]))
    return np.concatenate(parts)
