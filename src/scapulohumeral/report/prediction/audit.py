"""Muscle lengths and moment arms that the solver used, against OpenSim along each prediction."""

from __future__ import annotations

from typing import Any

import pandas as pd

from scapulohumeral.report.tables import Table


def audit_rows(audit: pd.DataFrame, limit_mm: float) -> Table:
    """Worst length and moment arm of every audited condition; marked: a length over the limit.

    Parameters
    ----------
    audit : rows of results/prediction/geometry_audit.csv, errors in mm
    limit_mm : largest error of a length that is allowed
    """
    rows = [
        (
            row["participant"],
            row["condition"],
            str(row["poses"]),
            str(row["jumps"]),
            *(_worst(row, quantity) for quantity in ("length", "arm")),
        )
        for row in audit.to_dict("records")
    ]
    columns = (
        "participant", "condition", "poses", "left out", "length, worst (RMSE) [mm]",
        "moment arm, worst (RMSE) [mm]",
    )  # fmt: skip
    return Table(columns, rows, frozenset((audit.length_max_mm > limit_mm).to_numpy().nonzero()[0]))


def _worst(row: dict[Any, Any], quantity: str) -> str:
    """Largest error with its muscle, and largest root mean square; none of a failed solve."""
    if pd.isna(row[f"{quantity}_max_mm"]):
        return "no solution"
    largest, rmse = (row[f"{quantity}_{kind}_mm"] for kind in ("max", "rmse"))
    return f"{largest:.1f} {row[f'{quantity}_muscle']} ({rmse:.1f})"
