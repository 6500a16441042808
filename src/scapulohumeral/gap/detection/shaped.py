"""How much of a difference has the shape of an effect, measured by what has no such shape.

Few repeats hardly tell how much a task scatters, so a difference may be large because the task
scatters more than assumed. Then all of it is: its many coefficients tell the scale, of which an
effect with a few parameters explains little. It is what makes a t value of a mean difference
(for noise with Student's t tails: Lange, Little and Taylor 1989, J Am Stat Assoc 84: 881-896).

Letters: D coefficients, T tasks, M differences, P parameters.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2, norm

from scapulohumeral.gap.residual.residual import Residual

# Of a chi-square variable: z values of 37 and -8. Where an effect hardly shows, p would be one.
P_RANGE = 1e-300, 1.0 - 1e-15


def shaped(residual: Residual, vectors: np.ndarray, slopes: Sequence[np.ndarray]) -> np.ndarray:
    """Largest part of differences that has the shape of any effect, as z values (M,).

    Parameters
    ----------
    residual : covariance without any effect
    vectors : (D, M) differences
    slopes : (D, P) of each effect
    """
    white = residual.whiten(steadied(residual, vectors))
    bases = [np.linalg.qr(residual.whiten(slope))[0] for slope in slopes if np.any(slope)]
    lengths = [
        norm.isf(np.clip(chi2.sf(np.sum((b.T @ white) ** 2, axis=0), b.shape[1]), *P_RANGE))
        for b in bases
    ]
    return np.max(lengths, axis=0)


def closest(residual: Residual, slopes: Sequence[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """The effect whose shape the difference has most of.

    Returns
    -------
    change : (D,) that part of the difference
    basis : (D, P) its directions in the whitened difference
    """
    vector = residual.delta[:, None]
    best = max((s for s in slopes if np.any(s)), key=lambda s: shaped(residual, vector, [s])[0])
    basis, root = np.linalg.qr(residual.whiten(best))
    white = residual.whiten(steadied(residual, vector))
    return best @ np.linalg.solve(root, basis.T @ white)[:, 0], basis


def steadied(residual: Residual, vectors: np.ndarray) -> np.ndarray:
    """Differences (D, M) over the scale of the scatter that each of their tasks shows."""
    return vectors / over_tasks(residual, scales(residual, squares(residual, vectors)))


def squares(residual: Residual, vectors: np.ndarray) -> np.ndarray:
    """Whitened sums of squares (T, M) of differences (D, M), task by task."""
    return np.array(
        [
            np.sum(residual.part([task]).whiten(vectors[residual.rows([task])]) ** 2, axis=0)
            for task in residual.tasks
        ]
    )


def scales(residual: Residual, whole: np.ndarray) -> np.ndarray:
    """Scales (T, M) of the scatter in units of the assumed one, from sums of squares (T, M).

    What was assumed counts for as much as the repeats behind it are worth. Never below one:
    covariances hold what sessions change, and trials of one session are no proof against that.
    """
    worth = np.array(residual.degrees)[:, None]
    size = len(residual.delta) // len(residual.tasks)
    return np.sqrt(np.maximum((worth + whole) / (worth + size), 1.0))


def over_tasks(residual: Residual, values: np.ndarray) -> np.ndarray:
    """Values (T, M) of the tasks for each of their coefficients, (D, M)."""
    return np.repeat(values, len(residual.delta) // len(residual.tasks), axis=0)
