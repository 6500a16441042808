"""Forces of anatomical muscle groups.

Letters: N nodes, M muscle elements.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.errors import ModelError


def group_force(force: np.ndarray, groups: np.ndarray) -> dict[str, np.ndarray]:
    """Summed force (N,) [N] of each group, of forces (N, M) and group names (M,).

    Elements of one group pull along different lines: the sum measures effort, not a resultant.
    Groups come in the order of their first element.

    Raises
    ------
    ModelError                       not one name for each muscle
    """
    if groups.shape != (force.shape[1],):
        raise ModelError(
            f"{groups.size} group names for {force.shape[1]} muscles; expected one for each"
        )
    return {
        str(name): force[:, groups == name].sum(axis=1) for name in dict.fromkeys(groups.tolist())
    }


def most_changed(change: np.ndarray, groups: np.ndarray, count: int = 3) -> str:
    """Groups whose sum of a change (M,) is largest either way, with it, as words for a table."""
    sums = {name: float(total[0]) for name, total in group_force(change[None], groups).items()}
    first = sorted(sums, key=lambda name: -abs(sums[name]))[:count]
    return ", ".join(f"{name} {sums[name]:+.3f}" for name in first)
