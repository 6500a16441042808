"""Forces and activations of anatomical muscle groups.

Letters: N nodes, M muscle elements, G groups.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from scapulohumeral.errors import ModelError


def group_force(force: np.ndarray, groups: np.ndarray) -> dict[str, np.ndarray]:
    """Summed force (N,) [N] of each group, of forces (N, M) and group names (M,).

    Elements of one group pull along different lines: the sum measures effort, not a resultant.
    """
    return _weighted_sums(force, groups, np.ones(force.shape[1]))


def group_activation(
    activation: np.ndarray, groups: np.ndarray, max_isometric_force: np.ndarray
) -> dict[str, np.ndarray]:
    """Mean activation (N,) [1] of each group, weighted by maximum isometric force.

    Parameters
    ----------
    activation : array, shape (N, M) [1]
    groups : array, shape (M,)       names
    max_isometric_force : array, shape (M,) [N]
    """
    sums = _weighted_sums(activation, groups, max_isometric_force)
    return {name: total / max_isometric_force[groups == name].sum() for name, total in sums.items()}


def group_table(
    time_s: np.ndarray, force: dict[str, np.ndarray], activation: dict[str, np.ndarray]
) -> pd.DataFrame:
    """Long table with the columns time_s, group, force_N and activation, of arrays (N,) by group.

    Raises
    ------
    ModelError                       if the two have different groups
    """
    if force.keys() != activation.keys():
        raise ModelError(
            f"muscle groups of force and activation differ: {sorted(force.keys() ^ activation)}; "
            "expected the same. Take both from one model record"
        )
    return pd.concat(
        [
            pd.DataFrame(
                {
                    "time_s": time_s,
                    "group": name,
                    "force_N": force[name],
                    "activation": activation[name],
                }
            )
            for name in force
        ],
        ignore_index=True,
    )


def _weighted_sums(
    values: np.ndarray, groups: np.ndarray, weights: np.ndarray
) -> dict[str, np.ndarray]:
    """Sums over elements, groups in order of their first element."""
    if groups.shape != (values.shape[1],):
        raise ModelError(
            f"{groups.size} group names for {values.shape[1]} muscles; expected one for each"
        )
    return {
        str(name): values[:, groups == name] @ weights[groups == name]
        for name in dict.fromkeys(groups.tolist())
    }
