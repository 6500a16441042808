"""Tables with a time column as laboratories write them: CSV, and OpenSim's .mot and .sto.

Rows are counted as a text editor shows them, header lines of OpenSim's files included.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.model.csv_table import Row, number, read_rows, read_text
from scapulohumeral.model.rotations import Array


@dataclass(frozen=True, eq=False)
class MotionTable:
    """Cells of one file as text.

    Attributes
    ----------
    path : file
    columns : names, in the order of the file
    headers : name -> name as written in the file, where it was renamed
    rows : one dict per data row, by the names in the file
    first_row : number of the first data row in the file
    in_degrees : whether rotations are in degrees, else in radians
    """

    path: Path
    columns: tuple[str, ...]
    headers: Mapping[str, str]
    rows: Sequence[Row]
    first_row: int
    in_degrees: bool

    def renamed(self, names: Mapping[str, str]) -> MotionTable:
        """The same table with columns known by other names: written name -> name."""
        columns = tuple(names.get(name, name) for name in self.columns)
        headers = dict(zip(columns, self.columns, strict=True))
        if len(headers) < len(columns):
            twice = sorted({name for name in columns if columns.count(name) > 1})
            raise DataError(
                f"{self.path}: column {', '.join(twice)} more than once. Keep one of them."
            )
        return replace(self, columns=columns, headers=headers)

    def header(self, column: str) -> str:
        """Name of a column as written in the file."""
        return self.headers.get(column, column)

    def row(self, index: int) -> int:
        """Number of the data row with this index, as a text editor shows it."""
        return self.first_row + int(index)

    def numbers(self, columns: Sequence[str]) -> Array:
        """Finite numbers of columns, shape (rows, columns).

        Raises
        ------
        DataError                    a missing column, or a cell that is no finite number
        """
        missing = [name for name in columns if name not in self.columns]
        if missing:
            raise DataError(
                f"{self.path}, row {self.first_row - 1}: missing column {', '.join(missing)}; "
                f"found {', '.join(self.columns)}. Rename or add the column."
            )
        written = [self.header(name) for name in columns]
        return np.array(
            [
                [number(self.path, self.row(i), row, name) for name in written]
                for i, row in enumerate(self.rows)
            ]
        )


def read_table(path: Path) -> MotionTable:
    """Read a CSV file (degrees), or a .mot or .sto file (unit by ``inDegrees`` of its header).

    Raises
    ------
    DataError                        no such file, no header, a ragged row, or no rows
    """
    if path.suffix.lower() in (".mot", ".sto"):
        return _read_mot(path)
    rows = read_rows(path, ())
    return MotionTable(path, tuple(rows[0]), {}, rows, 2, True)


def _read_mot(path: Path) -> MotionTable:
    lines = read_text(path).splitlines()
    ends = [i for i, line in enumerate(lines) if line.strip().lower() == "endheader"]
    if not ends or len(lines) < ends[0] + 3:
        raise DataError(
            f"{path}: no 'endheader' with column names and rows after it. "
            "Export it as OpenSim motion file again."
        )
    end = ends[0]
    units = [re.fullmatch(r"\s*inDegrees\s*=\s*(yes|no)\s*", line, re.I) for line in lines[:end]]
    found = [match[1].lower() for match in units if match]
    if len(found) != 1:
        raise DataError(
            f"{path}, header: expected one line 'inDegrees=yes' or 'inDegrees=no'. Add the line."
        )
    columns = tuple(lines[end + 1].split())
    rows = []
    for i, line in enumerate(lines[end + 2 :], start=end + 3):
        cells = line.split()
        if len(cells) != len(columns):
            raise DataError(
                f"{path}, row {i}: {len(cells)} cells, expected {len(columns)} as in the header. "
                "Remove empty lines and incomplete rows."
            )
        rows.append(dict(zip(columns, cells, strict=True)))
    return MotionTable(path, columns, {}, rows, end + 3, found == ["yes"])
