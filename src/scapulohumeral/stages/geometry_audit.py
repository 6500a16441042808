"""Muscle lengths and moment arms along a solution: what the solver used against OpenSim.

Lengths are fitted near the recorded motion; a free scapula may leave that region. The audit
evaluates OpenSim itself at the poses of a solution, recorded ones or predicted ones alike.

Letters: P poses, M muscles.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array, positive_pose
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.stages.geometry import errors_where

MM = 1e3


def audited_poses(solution: Path, step: int) -> Array:
    """Every `step`-th pose of a stored solution, shape (P, 13), with scalar parts >= 0.

    None of a failed solve, P = 0: its poses are no result.
    """
    solved = read_solution(solution, allow_failed=True)
    if not solved.optimal:
        return np.zeros((0, 13))
    return positive_pose(solved.pose[::step])


def audit_geometry(forces: MuscleForces, samples: Path) -> pd.DataFrame:
    """Errors of each muscle at audited poses.

    Parameters
    ----------
    forces : in quaternions, whose rotations are those of OpenSim's samples
    samples : Path                   of rule sample_solution_geometry: what OpenSim says there

    Returns
    -------
    table, one row per muscle
        poses; jumps (poses where OpenSim's wrapping jumps, left out of what follows);
        length_rmse_mm, length_max_mm; arm_rmse_mm, arm_max_mm over all rotations and poses, NaN
        without poses

    Raises
    ------
    DataError                        samples of other muscles
    """
    with np.load(samples, allow_pickle=False) as data:
        names = tuple(str(name) for name in data["muscles"])
        q, smooth = data["q"], data["smooth"]
        length, gradient = data["length_m"], data["rotation_gradient_m"]
    if names != forces.geometry.names:
        raise DataError(f"{samples}: samples of other muscles than the fit. Sample them again.")
    length_error = arm_error = np.full(length.shape, np.nan)
    # Of no poses, CasADi evaluates nothing.
    if len(q):
        fitted, _ = forces.lengths(q, np.zeros((len(q), 10)))
        length_error = errors_where(smooth, np.abs(fitted - length))
        arm_error = np.abs(forces.gradients(q)[..., :10] - gradient).max(axis=2)
        arm_error = errors_where(smooth, arm_error)
    kept = smooth.any(axis=0)
    table = pd.DataFrame(
        {"muscle": names, "poses": len(q), "jumps": np.count_nonzero(~smooth, axis=0)}
    )
    for quantity, error in (("length", length_error), ("arm", arm_error)):
        for kind, value in (("rmse", _root_mean_square), ("max", _largest)):
            column = np.full(len(names), np.nan)
            column[kept] = MM * value(error[:, kept])
            table[f"{quantity}_{kind}_mm"] = column
    return table


def _root_mean_square(error: Array) -> Array:
    return np.sqrt(np.nanmean(error**2, axis=0))


def _largest(error: Array) -> Array:
    # No error is negative: the initial value is only for no muscles.
    return np.nanmax(error, axis=0, initial=0.0)


def audit_table(audits: Sequence[Path], names: Sequence[tuple[str, str]]) -> pd.DataFrame:
    """One row per solution: the worst muscle in length and in moment arm, none of a failed solve.

    Parameters
    ----------
    audits : tables of `audit_geometry`; names : participant and condition of each
    """
    rows = []
    for path, (participant, condition) in zip(audits, names, strict=True):
        table = pd.read_csv(path)
        row = {"participant": participant, "condition": condition, "poses": table.poses.max()}
        row["jumps"] = table.jumps.sum()
        for quantity in ("length", "arm"):
            largest = table.set_index("muscle")[f"{quantity}_max_mm"].dropna()
            row[f"{quantity}_muscle"] = largest.idxmax() if len(largest) else ""
            row[f"{quantity}_max_mm"] = largest.max()
            row[f"{quantity}_rmse_mm"] = table[f"{quantity}_rmse_mm"].max()
        rows.append(row)
    return pd.DataFrame(rows)
