"""Tables of all predictions: status, certificate, joint force, rhythm and solution branch."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.stages.quantities import PredictionCase, plane_rows, rhythm_rows

# Objectives of one problem that differ by less belong to the same local optimum.
SAME_OPTIMUM = 1e-3
# Columns that tell a problem from others; starts and solver settings do not.
PROBLEM = ("participant", "parameters", "w_gh", "muscles", "capacity", "girdle_stiffness")
UNSOLVED = {
    "peak_gh_force_bw": np.nan,
    "max_eccentricity": np.nan,
    "fraction_outside": np.nan,
    "peak_upward_rotation_deg": np.nan,
}


def summarise_predictions(
    solutions: Sequence[Path],
    summaries: Sequence[Path],
    models: Mapping[str, Path],
    summary: Path,
    rhythm: Path,
) -> None:
    """Write a row per participant, condition and plane, and the rhythm per phase.

    A failed solve has a row with its status and no quantities, and no rhythm.
    """
    rows: list[dict[str, Any]] = []
    phases: list[dict[str, Any]] = []
    for path, record in zip(solutions, summaries, strict=True):
        solution = read_solution(path, allow_failed=True)
        about = json.loads(record.read_text(encoding="utf-8"))
        model = json.loads(models[about["participant"]].read_text(encoding="utf-8"))
        rows += _rows(solution, about, model)
        if about["status"] == "optimal":
            phases += rhythm_rows(_case(about), solution.pose, about["planes"])
    table = pd.DataFrame(rows)
    table["branch"] = _branches(table)
    table.to_csv(summary, index=False, float_format="%.6g")
    pd.DataFrame(phases).to_csv(rhythm, index=False, float_format="%.6g")


def _case(about: Mapping[str, Any]) -> PredictionCase:
    condition = about["condition"]
    return PredictionCase(
        about["participant"], condition["name"], condition["w_gh"], condition["capacity"]
    )


def _rows(
    solution: Solution, about: Mapping[str, Any], model: Mapping[str, Any]
) -> list[dict[str, Any]]:
    condition = about["condition"]
    proof = about["certificate"] or {"kkt_error": np.nan, "holds": False}
    common = {
        "participant": about["participant"],
        "condition": condition["name"],
        "parameters": condition["parameters"],
        "w_gh": condition["w_gh"],
        "muscles": " ".join(condition["muscles"]),
        "capacity": condition["capacity"],
        "girdle_stiffness": condition["girdle_stiffness_Nm_per_rad"],
        "start": condition["start"],
        "status": about["status"],
        "kkt_error": proof["kkt_error"],
        "certified": proof["holds"],
        "iterations": about["iterations"],
        "seconds": about["seconds"],
        "objective": about["objective"],
    }
    if about["status"] != "optimal":
        return [{**common, "plane": plane, **UNSOLVED} for plane in about["planes"]]
    quantities = plane_rows(_case(about), solution, model, about["planes"])
    return [{**common, **row} for row in quantities]


def _branches(table: pd.DataFrame) -> list[str]:
    """Letter of the local optimum of each row, A the best of all starts of the same problem."""
    keys = table[list(PROBLEM)].apply(lambda row: "|".join(map(str, row)), axis=1)
    branches = []
    for key, objective, status in zip(keys, table["objective"], table["status"], strict=True):
        if status != "optimal":
            branches.append("")
            continue
        same = table[(keys == key) & (table["status"] == "optimal")]["objective"]
        levels: list[float] = []
        for value in sorted(same.unique()):
            if not levels or value / levels[-1] - 1.0 > SAME_OPTIMUM:
                levels.append(value)
        rank = sum(objective / level - 1.0 > SAME_OPTIMUM for level in levels)
        branches.append(chr(ord("A") + min(rank, len(levels) - 1)))
    return branches
