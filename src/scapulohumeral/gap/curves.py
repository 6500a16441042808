"""Tables behind the figures of a diagnosis: their names, columns and files ``curves/*.csv``.

A diagnosis holds those it could compute; the report draws those it finds.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path

import pandas as pd

from scapulohumeral.errors import DataError

FOLDER = "curves"

# Columns of each table; `phase_percent` runs from 0 to 100 over the movement.
TABLES: dict[str, tuple[str, ...]] = {
    # Where the gap shows: mean difference over its standard error, threshold of the null bank.
    "shows": ("channel", "phase_percent", "effect_sigma", "threshold_sigma", "repeated"),
    # Where it enters: generalised force by degree of freedom, or error by EMG channel, in `unit`.
    "enters": ("kind", "name", "phase_percent", "effect", "threshold", "unit"),
    # Observables of each task: recorded mean, nominal model, model with the effect, floor band.
    "overlay": (
        "task",
        "channel",
        "phase_percent",
        "recorded",
        "nominal",
        "with_effect",
        "floor_low",
        "floor_high",
        "unit",
    ),
    # The gap, the best signature and what it leaves, on one scale.
    "signature": ("channel", "phase_percent", "residual_sigma", "signature_sigma", "rest_sigma"),
    # Probability that these trials tell two effects apart.
    "isolability": ("label_a", "label_b", "p_apart"),
    # Amplitude of the best effect, fitted to each task alone.
    "amplitude": ("task", "parameter", "value", "low", "high", "unit"),
    # How much of its predicted change each effect of a cause makes in a channel of this person.
    "factors": ("label", "effect", "channel", "factor"),
    # What disappears on held-out trials without a cause: black box, placebos.
    "controls": ("name", "shrinkage"),
    # One row per cell of the robustness grid.
    "robustness": ("cell", "verdict", "agrees"),
    # Firmness with which the person keeps a movement, share of what sessions are assumed to change,
    # and signature error, all the most probable.
    "errors": ("error", "value"),
    # What simple methods name as the cause.
    "baselines": ("method", "label"),
}


def check_curves(curves: Mapping[str, pd.DataFrame]) -> None:
    """Refuse tables of other names or columns than `TABLES` lists.

    Raises
    ------
    DataError                        names the table, what was found and what was expected
    """
    for name, table in curves.items():
        if name not in TABLES:
            raise DataError(f"curves, '{name}': unknown; expected one of {', '.join(TABLES)}.")
        if tuple(table.columns) != TABLES[name]:
            raise DataError(
                f"curves, '{name}': columns {', '.join(map(str, table.columns))}; expected "
                f"{', '.join(TABLES[name])}."
            )


def read_table(out: Path, name: str) -> pd.DataFrame:
    """A written table.

    Raises
    ------
    DataError                        it was not written
    """
    path = out / FOLDER / f"{name}.csv"
    if not path.exists():
        raise DataError(
            f"{path}: not there; expected an answer of this version. Diagnose the case again."
        )
    return pd.read_csv(path)


def read_pairs(out: Path, name: str) -> dict[str, str]:
    """A written table of two columns as first -> second; empty if it was not written."""
    path = out / FOLDER / f"{name}.csv"
    if not path.exists():
        return {}
    with path.open(encoding="utf-8", newline="") as stream:
        return {row[TABLES[name][0]]: row[TABLES[name][1]] for row in csv.DictReader(stream)}


def write_curves(curves: Mapping[str, pd.DataFrame], out: Path) -> None:
    """Write each table to ``out/curves/NAME.csv``."""
    check_curves(curves)
    folder = out / FOLDER
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in curves.items():
        text = table.to_csv(index=False, float_format="%.6g", lineterminator="\n")
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
