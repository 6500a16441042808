"""Tables of all predictions: status, certificate, joint force, rhythm and solution branch."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.quantities.prediction_rows import PredictionCase, plane_rows, rhythm_rows
from scapulohumeral.quantities.rhythm import shared_rhythm
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)

# What the motion that was recorded is called among the conditions.
RECORDED = "recorded"
# Objectives of one problem that differ by less belong to the same local optimum.
SAME_OPTIMUM = 1e-3
# Columns that tell a problem from others; starts and solver settings do not.
PROBLEM = ("participant", "parameters", "w_gh", "muscles", "capacity", "girdle_stiffness")
UNSOLVED = {
    "objective": np.nan,
    "peak_gh_force_bw": np.nan,
    "max_eccentricity": np.nan,
    "fraction_outside": np.nan,
    "peak_upward_rotation_deg": np.nan,
}


def summarise_predictions(
    solutions: Sequence[Path],
    summaries: Sequence[Path],
    models: Mapping[str, Path],
    tracked: Sequence[Path],
    summary: Path,
    rhythm: Path,
) -> None:
    """Write a row per participant, condition and plane, and the rhythm per phase.

    A failed solve has a row with its status and no quantities, and no rhythm. The recorded motions
    behind the tracking solutions have a rhythm, too, as the condition "recorded".
    """
    rows: list[dict[str, Any]] = []
    phases: list[dict[str, Any]] = []
    motions: list[_Motion] = []
    for path in tracked:
        # What was recorded stands in a failed solve too.
        known = read_solution(path, allow_failed=True)
        case = PredictionCase(known.header["participant"], RECORDED, np.nan, np.nan)
        motions.append(_Motion(case, known.header["trial"], known.reference_pose))
    for path, record in zip(solutions, summaries, strict=True):
        solution = read_solution(path, allow_failed=True)
        about = json.loads(record.read_text(encoding="utf-8"))
        model = read_record(models[about["participant"]])
        rows += _rows(solution, about, model)
        if about["status"] == "optimal":
            motions += [
                _Motion(_case(about), plane, solution.pose[slice(*limits)])
                for plane, limits in about["planes"].items()
            ]
    for motion in motions:
        phases += rhythm_rows(motion.case, motion.pose, {motion.plane: (0, len(motion.pose))})
    phases += _shared(motions)
    table = pd.DataFrame(rows)
    table["branch"] = _branches(table)
    table.to_csv(summary, index=False, float_format="%.6g")
    pd.DataFrame(phases).to_csv(rhythm, index=False, float_format="%.6g")


@dataclass(frozen=True, eq=False)
class _Motion:
    """One elevation, recorded or predicted: poses (N, 13)."""

    case: PredictionCase
    plane: str
    pose: np.ndarray


def _shared(motions: Sequence[_Motion]) -> list[dict[str, Any]]:
    """Rhythm over the elevations that all motions of a participant and plane pass."""
    groups: dict[tuple[str, str], dict[str, _Motion]] = {}
    for motion in motions:
        own = groups.setdefault((motion.case.participant, motion.plane), {})
        own[motion.case.condition] = motion
    rows = []
    for (_, plane), own in groups.items():
        angles = {name: thorax_angles(motion.pose) for name, motion in own.items()}
        pairs = {
            name: (a[:, ELEVATION_COLUMN], a[:, UPWARD_ROTATION_COLUMN])
            for name, a in angles.items()
        }
        for name, phase in shared_rhythm(pairs).items():
            rows.append(asdict(own[name].case) | asdict(replace(phase, plane=plane)))
    return rows


def _case(about: Mapping[str, Any]) -> PredictionCase:
    condition = about["condition"]
    return PredictionCase(
        about["participant"], condition["name"], condition["w_gh"], condition["capacity"]
    )


def _rows(solution: Solution, about: Mapping[str, Any], model: ModelRecord) -> list[dict[str, Any]]:
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
