"""Tables of signals over time that say whether the signals are simulated.

A column says it in every row, so that no copy of a part of the table loses it. Signals that a
failed solve was to make are sealed: their table has no number, and says why.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from scapulohumeral.errors import DataError, SolveError
from scapulohumeral.model.csv_table import check_increasing, read_numbers
from scapulohumeral.model.motion import TIME_COLUMN
from scapulohumeral.model.rotations import Array

MARK_COLUMN, FAILURE_COLUMN = "simulated", "simulation_failed"


def write_signals(
    path: Path, columns: Sequence[str], time_s: Array, values: Array, simulated: bool
) -> None:
    """Write signals as a table: time_s, the columns, and `simulated` (true or false).

    Parameters
    ----------
    path : Path
    columns : (C,) names with their unit
    time_s : (T,) written to the microsecond
    values : (T, C) written with six digits, more than an amplifier resolves
    simulated : whether the signals were computed instead of measured
    """
    row = ",".join(["%.6f", *["%.6g"] * len(columns), str(simulated).lower()])
    header = ",".join([TIME_COLUMN, *columns, MARK_COLUMN])
    np.savetxt(path, np.column_stack([time_s, values]), fmt=row, header=header, comments="")


def write_failed_signals(path: Path, columns: Sequence[str], reason: str) -> None:
    """Write the table of signals (C columns) that could not be simulated, and why."""
    with path.open("w", newline="", encoding="utf-8") as handle:
        writer = csv.writer(handle)
        writer.writerow([TIME_COLUMN, *columns, MARK_COLUMN, FAILURE_COLUMN])
        writer.writerow(["", *[""] * len(columns), "true", reason])


def signal_failure(path: Path) -> str:
    """Why a table holds no signals; empty if it holds some, or is another kind of file."""
    return _failure(_first_row(path)) if path.suffix.lower() == ".csv" else ""


def read_signals(path: Path, columns: Sequence[str]) -> tuple[Array, Array, bool]:
    """Signals of a table.

    Parameters
    ----------
    path : Path                      a table without column `simulated` counts as measured
    columns : (C,) wanted columns

    Returns
    -------
    time_s (T,), values (T, C), simulated

    Raises
    ------
    DataError                        missing column, no number, or time that does not increase;
                                     names file, row and column
    SolveError                       signals that could not be simulated
    """
    first = _first_row(path)
    if failure := _failure(first):
        raise SolveError(f"{path}: {failure}; there are no signals")
    table = read_numbers(path, (TIME_COLUMN, *columns))
    check_increasing(path, TIME_COLUMN, table[:, 0])
    return table[:, 0], table[:, 1:], _is_simulated(path, first)


def _is_simulated(path: Path, first: Mapping[str, str]) -> bool:
    mark = (first.get(MARK_COLUMN) or "false").strip()
    if mark not in ("true", "false"):
        raise DataError(
            f"{path}, row 2, column {MARK_COLUMN}: '{mark}'; expected true or false. "
            "Remove the column if the signals were measured."
        )
    return mark == "true"


def _failure(first: Mapping[str, str]) -> str:
    return (first.get(FAILURE_COLUMN) or "").strip()


def _first_row(path: Path) -> dict[str, str]:
    """First row of a table by column; empty for a table without rows, and for none."""
    # Readers of numbers say what is wrong with the path, or with an encoding.
    if not path.is_file():
        return {}
    with path.open(newline="", encoding="utf-8-sig", errors="replace") as handle:
        return next(csv.DictReader(handle, skipinitialspace=True), {})
