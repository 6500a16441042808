"""Reading of CSV tables with named columns; every refusal names file, row, column and remedy.

Rows are counted as a text editor shows them: the header is row 1.
"""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from scapulohumeral.errors import DataError, absent

# Time steps may differ by this share of their mean, as the clocks of recorders do.
STEP_TOLERANCE = 0.02
# Largest number of decimals of times that count as rounded.
MOST_DECIMALS = 6
Row = dict[str, str]


def read_rows(path: Path, columns: Sequence[str]) -> list[Row]:
    """Rows of a table as text.

    Parameters
    ----------
    path : Path
    columns : names that must be in the header; further columns are kept

    Returns
    -------
    list of dict                     one per data row, column name -> cell without outer spaces

    Raises
    ------
    DataError                        no such file, a missing column, a ragged row, or no rows
    """
    try:
        table = csv.reader(io.StringIO(read_text(path), newline=""))
        lines = [[cell.strip() for cell in line] for line in table]
    except csv.Error as error:
        raise DataError(f"{path}: no table ({error}). Save it as CSV again.") from error
    if len(lines) < 2:
        raise DataError(
            f"{path}: {len(lines)} lines; expected a header and at least one row. Export it again."
        )
    header = lines[0]
    _check_header(path, header, lines[1])
    twice = sorted({name for name in header if name and header.count(name) > 1})
    if twice:
        raise DataError(
            f"{path}, row 1: column {', '.join(twice)} more than once. Keep one of them."
        )
    missing = [name for name in columns if name not in header]
    if missing:
        raise _without(path, missing, header)
    for number, cells in enumerate(lines[1:], start=2):
        if len(cells) != len(header):
            raise DataError(
                f"{path}, row {number}: {len(cells)} cells, expected {len(header)} as in the "
                "header. Remove empty lines and stray commas, also decimal ones."
            )
    return [dict(zip(header, cells, strict=True)) for cells in lines[1:]]


def _without(path: Path, missing: Sequence[str], found: Iterable[str]) -> DataError:
    return DataError(
        f"{path}, row 1: missing column {', '.join(missing)}; found {', '.join(found)}. "
        "Rename or add the column: names carry their unit."
    )


def _check_header(path: Path, header: list[str], second: list[str]) -> None:
    """Refuse tables with other separators than commas, or with a title above the header."""
    if len(header) != 1:
        return
    if ";" in header[0] or "\t" in header[0]:
        found = "semicolons" if ";" in header[0] else "tabs"
        raise DataError(
            f"{path}, row 1: cells are separated by {found}; expected commas. Export it as CSV "
            "with commas between cells, and numbers with decimal points."
        )
    if len(second) > 1:
        raise DataError(
            f"{path}, row 1: '{header[0]}' alone, and {len(second)} cells in row 2; expected the "
            "names of the columns in row 1. Remove title lines."
        )


def read_text(path: Path) -> str:
    """Text of a file in UTF-8, with the ends of lines as they are.

    Raises
    ------
    DataError                        no such file, no right to read it, or no such text
    """
    if not path.is_file():
        raise DataError(f"{path}: {absent(path)}. Check the name where the table is referred to.")
    try:
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DataError(
            f"{path}: byte {error.start + 1} is no text in UTF-8. Save the table as text in UTF-8: "
            "spreadsheets call it 'CSV UTF-8'."
        ) from error
    except OSError as error:
        raise DataError(f"{path}: {error.strerror}. Allow it to be read.") from error


def first_line_names(path: Path) -> frozenset[str]:
    """Names of the columns of a table, by its first line, whatever kind of text it is."""
    line = path.read_text(encoding="utf-8", errors="replace").partition("\n")[0]
    return frozenset(name.strip() for name in line.removeprefix("\ufeff").split(","))


def number(path: Path, row_number: int, row: Row, column: str) -> float:
    """The finite number in a cell.

    Raises
    ------
    DataError                        if the cell holds text, nothing, NaN or infinity, or the table
                                     has no such column
    """
    if column not in row:
        raise _without(path, [column], row)
    text = row[column]
    try:
        value = float(text)
    except ValueError:
        raise DataError(
            f"{path}, row {row_number}, column {column}: '{text}' is not a number. "
            "Write a decimal number with a point, without unit."
        ) from None
    if not math.isfinite(value):
        raise DataError(
            f"{path}, row {row_number}, column {column}: {text}; expected a finite number. "
            "Fill the gap by interpolation, or cut the rows."
        )
    return value


def read_numbers(path: Path, columns: Sequence[str]) -> np.ndarray:
    """Columns of numbers.

    Returns
    -------
    array, shape (rows, columns)     finite, in the order of `columns`

    Raises
    ------
    DataError                        as `read_rows` and `number`
    """
    table = _plain_numbers(path, columns)
    if table is not None:
        return table
    # Cell by cell, which is slow for signals, but names the place of the fault.
    return np.array(
        [
            [number(path, i, row, column) for column in columns]
            for i, row in enumerate(read_rows(path, columns), start=2)
        ]
    )


def _plain_numbers(path: Path, columns: Sequence[str]) -> np.ndarray | None:
    """Columns of a table without any fault, read fast; None for every other table."""
    # Here, because it takes half a second, which a reader of text need not wait for.
    import pandas as pd

    text = read_text(path)
    lines = text.splitlines()
    names = lines[0].split(",") if lines else []
    # What pandas would mend without a word: columns of one name, and cells that are missing.
    ragged = any(line.count(",") != len(names) - 1 for line in lines)
    if ragged or len(set(names)) < len(names) or '"' in text:
        return None
    try:
        table = pd.read_csv(io.StringIO(text), index_col=False, skip_blank_lines=False)
        table = table[list(columns)]
    except (ValueError, KeyError):
        return None
    if table.empty or any(kind.kind not in "if" for kind in table.dtypes):
        return None
    values = table.to_numpy(dtype=float)
    return values if np.isfinite(values).all() else None


def check_increasing(path: Path, column: str, time_s: np.ndarray, first_row: int = 2) -> None:
    """Refuse times that do not increase from row to row.

    Parameters
    ----------
    path : Path                      table that the times are from
    column : its column of times
    time_s : (rows,)
    first_row : number of the first row of data

    Raises
    ------
    DataError                        names the first row that does not follow the one before
    """
    stalled = np.flatnonzero(np.diff(time_s) <= 0.0)
    if stalled.size:
        i = int(stalled[0]) + 1
        remedy = "Sort the rows by time."
        if time_s[i] == time_s[i - 1]:
            remedy = "Write times with more digits if they were rounded, or remove repeated rows."
        raise DataError(
            f"{path}, row {first_row + i}, column {column}: {time_s[i]} s does not follow "
            f"{time_s[i - 1]} s. {remedy}"
        )


def uniform_rate(path: Path, column: str, time_s: np.ndarray, first_row: int = 2) -> float:
    """Rows per second of uniform times, or of uniform times that were rounded for the table.

    Parameters
    ----------
    path, column, time_s, first_row : as `check_increasing`

    Raises
    ------
    DataError                        times do not increase, or their steps differ; names the row
    """
    check_increasing(path, column, time_s, first_row)
    if len(time_s) < 2:
        raise DataError(
            f"{path}: {len(time_s)} rows of data; expected at least two. Record longer."
        )
    steps = np.diff(time_s)
    mean = float(steps.mean())
    uneven = np.abs(steps / mean - 1.0)
    if uneven.max() <= STEP_TOLERANCE:
        return 1.0 / mean
    count = np.arange(len(time_s))
    line = np.polynomial.Polynomial.fit(count, time_s, 1)
    # Rounding moves every time by half a last digit at most, and never makes room for a lost row.
    if np.abs(time_s - line(count)).max() > 0.6 * _last_digit(time_s) or uneven.max() > 0.5:
        # The first of the worst: two steps about one wrong time differ by as much.
        worst = int(np.argmax(np.round(uneven, 3)))
        raise DataError(
            f"{path}, row {first_row + worst + 1}, column {column}: {steps[worst]:.6f} s after the "
            f"row before; expected {mean:.6f} s throughout. Resample it, or write times with more "
            "digits; rows without data must stay."
        )
    return float(1.0 / line.convert().coef[1])


def _last_digit(time_s: np.ndarray) -> float:
    """Worth of the last decimal that the times were rounded to; 0 if they were not."""
    for decimals in range(MOST_DECIMALS + 1):
        if np.abs(time_s - np.round(time_s, decimals)).max() < 1e-9:
            return float(10.0**-decimals)
    return 0.0
