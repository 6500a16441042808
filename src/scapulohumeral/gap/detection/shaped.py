"""How much of a difference has the shape of an effect, measured by what has no such shape.

Few repeats hardly tell how much a task scatters, so a difference may be large because the task
scatters more than assumed. Then all of it is: its many coefficients tell the scale, of which an
effect with a few parameters explains little. It is what makes a t value of a mean difference
(for noise with Student's t tails: Lange, Little and Taylor 1989, J Am Stat Assoc 84: 881-896).

Letters: D coefficients, T tasks, d = D / T, M differences, P parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2, norm

from scapulohumeral.gap.residual.residual import Residual

# Of a chi-square variable: z values of 37 and -8. Where an effect hardly shows, p would be one.
P_RANGE = 1e-300, 1.0 - 1e-15
# Parameters whose changes differ by less than this share in shape change a difference alike: slopes
# are central differences, good to about as many digits.
DISTINCT = 1e-4


def shaped(residual: Residual, vectors: np.ndarray, slopes: Sequence[np.ndarray]) -> np.ndarray:
    """Largest part of differences that has the shape of any effect, as z values (M,).

    Parameters
    ----------
    residual : covariance without any effect
    vectors : (D, M) differences
    slopes : (D, P) of each effect
    """
    white = residual.whiten(steadied(residual, vectors))
    largest: dict[int, np.ndarray] = {}
    for slope in slopes:
        if np.any(slope):
            basis = directions(residual, slope)[0]
            rank, own = basis.shape[1], _squared_lengths(white, basis)
            largest[rank] = np.maximum(largest.get(rank, own), own)
    # A z value grows with the length, so that of the longest is the largest of its rank.
    return np.max([_z_values(own, rank) for rank, own in largest.items()], axis=0)


def each_shaped(
    residual: Residual, vectors: np.ndarray, slopes: Sequence[np.ndarray]
) -> list[np.ndarray]:
    """The same (M,) of each effect by itself; every slope has to change something."""
    white = residual.whiten(steadied(residual, vectors))
    return [_z_along(white, directions(residual, slope)[0]) for slope in slopes]


def closest(residual: Residual, slopes: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The effect whose shape the difference has most of.

    Returns
    -------
    change : (D,) that part of the difference
    basis : (D, P) its directions in the whitened difference
    """
    white = residual.whiten(steadied(residual, residual.delta[:, None]))
    shown = [(s, *directions(residual, s)) for s in slopes if np.any(s)]
    best, basis, amounts = max(shown, key=lambda one: _z_along(white, one[1])[0])
    return best @ (amounts @ (basis.T @ white))[:, 0], basis


def directions(residual: Residual, slope: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions that an effect (D, P) can change a whitened difference in.

    Parameters that change it alike have one direction together: two would hold noise.

    Returns
    -------
    basis : (D, R) orthonormal, R at most P
    amounts : (P, R) parameters of a unit along each
    """
    white = residual.whiten(slope)
    lengths = np.linalg.norm(white, axis=0)
    units = np.where(lengths > 0.0, lengths, 1.0)
    left, sizes, right = np.linalg.svd(white / units, full_matrices=False)
    rank = int(np.sum(sizes > DISTINCT * sizes[0]))
    return left[:, :rank], right[:rank].T / sizes[:rank] / units[:, None]


def _z_along(white: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Lengths of whitened differences (D, M) along a basis (D, R), as z values (M,)."""
    return _z_values(_squared_lengths(white, basis), basis.shape[1])


def _squared_lengths(white: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """Squared lengths (M,) of whitened differences (D, M) along a basis (D, R)."""
    return np.sum((basis.T @ white) ** 2, axis=0)


def _z_values(squared_lengths: np.ndarray, rank: int) -> np.ndarray:
    """Squared lengths (M,) in some directions as z values."""
    return z_value(chi2.sf(squared_lengths, rank))


def z_value(p_value: ArrayLike) -> np.ndarray:
    """z value of one-sided p values; it stays finite at 0 and 1."""
    return norm.isf(np.clip(p_value, *P_RANGE))


def steadied(residual: Residual, vectors: np.ndarray) -> np.ndarray:
    """Differences (D, M) over the scale of the scatter that each of their tasks shows."""
    by_task = scales(residual, squares(residual, vectors))
    return vectors / np.repeat(by_task, len(vectors) // len(by_task), axis=0)


def white_by_task(residual: Residual, vectors: np.ndarray) -> np.ndarray:
    """Differences (D, M) whitened task by task, (T, d, M)."""
    parts = np.split(vectors, len(residual.tasks))
    return np.array([own.whiten(part) for own, part in zip(residual.by_task, parts, strict=True)])


def squares(residual: Residual, vectors: np.ndarray) -> np.ndarray:
    """Whitened sums of squares (T, M) of differences (D, M), task by task."""
    return np.sum(white_by_task(residual, vectors) ** 2, axis=1)


def scales(residual: Residual, whole: np.ndarray) -> np.ndarray:
    """Scales (T, M) of the scatter in units of the assumed one, from sums of squares (T, M).

    What was assumed counts for as much as the repeats behind it are worth. Never below one:
    covariances hold what sessions change, and trials of one session are no proof against that.
    """
    worth = np.array(residual.degrees)[:, None]
    size = len(residual.delta) // len(residual.tasks)
    return np.sqrt(np.maximum((worth + whole) / (worth + size), 1.0))
