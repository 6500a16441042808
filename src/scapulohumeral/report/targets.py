"""What the results must reach, and whether they do.

Limits are those of config/targets.yaml. The same targets are shown at the top of the report and
tested on the results.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

MEASURE_NAMES = {
    "rmse_clavicle_deg": "clavicle without axial rotation, RMSE of the angles",
    "rmse_thoracoscapular_deg": "thoracoscapular, RMSE of the angles",
    "rmse_thoracohumeral_deg": "thoracohumeral, RMSE of the angles",
    "angle_clavicle_deg": "clavicle, angle between the long axes",
    "angle_scapula_deg": "scapula, angle between the orientations",
    "angle_humerus_deg": "humerus, angle between the orientations",
}
GEOMETRY_NAMES = {
    "length_rmse_mm": "muscle length",
    "arm_rmse_median_mm": "moment arm, median over the rotations",
    "arm_rmse_worst_mm": "moment arm, worst rotation",
}


@dataclass(frozen=True)
class Verdict:
    """One target and what was reached.

    Attributes
    ----------
    name : what is judged; value, target : in words, with units
    holds : whether the target is met
    worse : what misses the target by itself, even if the mean holds
    """

    name: str
    value: str
    target: str
    holds: bool
    worse: tuple[str, ...] = ()


def verdicts(
    summary: pd.DataFrame, quality: pd.DataFrame, limits: Mapping[str, Any]
) -> list[Verdict]:
    """All targets of tracking and muscle paths.

    Parameters
    ----------
    summary : one row per solve, columns as in results/tracking/summary.csv
    quality : muscle geometry with columns participant, formulation, path and errors
    limits : config/targets.yaml, of which sections ``tracking`` and ``geometry`` count
    """
    tracking, paths = limits["tracking"], limits["geometry"]
    solved = summary[summary.status == "optimal"]
    quaternion = solved[solved.formulation == "quaternion"]
    means = [mean_error(quaternion, *limit) for limit in tracking["mean_error_deg"].items()]
    geometry = [
        geometry_error(quality, key, kind, paths[section][key])
        for key in GEOMETRY_NAMES
        for kind, section in (("median", "median_mm"), ("max", "worst_mm"))
        if key in paths[section]
    ]
    norm = unit_norm(quaternion, tracking["norm_rmse"])
    broken = violation(solved, tracking["constraint_violation"])
    return [all_solved(summary), broken, *means, norm, *geometry]


def changed_afterwards(name: str, targets: Mapping[str, Any]) -> str:
    """What was done to a row of the verdicts after results were seen: added, tightened, or nothing.

    Parameters
    ----------
    name : of the verdict
    targets : config/targets.yaml, of which section ``afterwards`` counts
    """
    listed = targets["afterwards"].items()
    return next((word for word, rows in listed if name.startswith(tuple(rows))), "")


def run_names(rows: pd.DataFrame) -> tuple[str, ...]:
    """Participant, plane and formulation of each row."""
    return tuple(f"{r.participant} {r.plane} {r.formulation}" for r in rows.itertuples())


def all_solved(summary: pd.DataFrame) -> Verdict:
    """Every solve is optimal."""
    failed = summary[summary.status != "optimal"]
    value = f"{len(summary) - len(failed)} of {len(summary)} optimal"
    return Verdict("solves", value, "all optimal", failed.empty, run_names(failed))


def violation(solved: pd.DataFrame, limit: float) -> Verdict:
    """No converged solve violates a constraint by more than allowed."""
    return _largest(solved, "constraint_violation", limit, "constraint violation")


def unit_norm(quaternion: pd.DataFrame, limit: float) -> Verdict:
    """Quaternions keep unit length."""
    name = "deviation of quaternion norms from one, root mean square"
    return _largest(quaternion, "norm_rmse", limit, name)


def _largest(rows: pd.DataFrame, column: str, limit: float, name: str) -> Verdict:
    if rows.empty:
        return _nothing(name, f"≤ {limit:.0e}")
    largest = float(rows[column].max())
    worse = run_names(rows[rows[column] > limit])
    return Verdict(name, f"at most {largest:.1e}", f"≤ {limit:.0e}", largest <= limit, worse)


def mean_error(quaternion: pd.DataFrame, column: str, limit: float) -> Verdict:
    """Mean tracking error over the converged quaternion solves."""
    name = f"{MEASURE_NAMES[column]}, mean of the quaternion solves"
    if quaternion.empty:
        return _nothing(name, f"≤ {limit:g} deg")
    mean = float(quaternion[column].mean())
    above = quaternion[quaternion[column] > limit]
    worse = tuple(
        f"{run} {value:.2f} deg" for run, value in zip(run_names(above), above[column], strict=True)
    )
    return Verdict(name, f"{mean:.2f} deg", f"≤ {limit:g} deg", mean <= limit, worse)


def geometry_error(quality: pd.DataFrame, column: str, kind: str, limit: float) -> Verdict:
    """Median or worst error of muscle geometry; the participant with the largest counts."""
    wrapping = quality[quality.path != "straight"]
    by_fit = wrapping.groupby(["participant", "formulation"])[column].agg(kind)
    above = wrapping[wrapping[column] > limit] if kind == "max" else wrapping.iloc[:0]
    worse: Sequence[str] = [
        f"{r.participant} {r.formulation} {r.muscle} {getattr(r, column):.3f} mm"
        for r in above.itertuples()
    ]
    if kind == "median":
        worse = [
            f"{' '.join(map(str, f))} {v:.3f} mm"
            for f, v in zip(by_fit.index, by_fit, strict=True)
            if v > limit
        ]
    largest = float(np.max(by_fit))
    word = {"median": "median", "max": "worst"}[kind]
    return Verdict(
        f"{GEOMETRY_NAMES[column]}, {word} RMSE of the wrapping elements on held-out poses",
        f"at most {largest:.3f} mm",
        f"≤ {limit:g} mm",
        largest <= limit,
        tuple(worse),
    )


def _nothing(name: str, target: str) -> Verdict:
    return Verdict(name, "no converged solve", target, holds=False)
