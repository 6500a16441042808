"""One table of all tracking solves."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import pandas as pd

COLUMNS = {
    "participant": "participant",
    "trial": "plane",
    "formulation": "formulation",
    "status": "status",
    "iterations": "iterations",
    "seconds": "seconds",
    "objective": "objective",
    "constraint_violation": "constraint_violation",
    "rmse_clavicle_deg": "rmse_clavicle_deg",
    "rmse_thoracoscapular_deg": "rmse_thoracoscapular_deg",
    "rmse_thoracohumeral_deg": "rmse_thoracohumeral_deg",
    "angle_clavicle_deg": "angle_clavicle_deg",
    "angle_scapula_deg": "angle_scapula_deg",
    "angle_humerus_deg": "angle_humerus_deg",
    "norm_rmse": "norm_rmse",
    "max_activation_step": "max_activation_step",
}


# What a solve that failed does not know.
RESULTS = tuple(name for name in COLUMNS.values() if name.startswith(("rmse_", "angle_")))
RESULTS += ("objective", "norm_rmse", "max_activation_step")


def summarise(paths: Sequence[Path]) -> pd.DataFrame:
    """Summary files of tracking solves as a table, one row per solve; of failed ones no results."""
    rows = [json.loads(Path(path).read_text(encoding="utf-8")) for path in paths]
    table = pd.DataFrame([{name: row[key] for key, name in COLUMNS.items()} for row in rows])
    table.loc[table["status"] != "optimal", list(RESULTS)] = float("nan")
    return table
