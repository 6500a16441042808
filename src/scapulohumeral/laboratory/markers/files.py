"""Marker positions over time, read from C3D, TRC and CSV files in the units that the files say.

Letters: T frames, N markers. Everything returned is in metres and seconds, in the axes of the
laboratory; a marker that was not seen is NaN.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.errors import DataError, absent
from scapulohumeral.model.csv_table import number, read_rows, read_text, uniform_rate
from scapulohumeral.model.motion import TIME_COLUMN
from scapulohumeral.model.rotations import Array

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
# The rate in a header may differ from that of the times by this share, as rounded ones do.
RATE_TOLERANCE = 0.02
CSV_COLUMN = re.compile(r"(?P<marker>.+)_(?P<axis>[xyz])_(?P<unit>m|cm|mm)")
TRC_HEADER_LINES = 5


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers of one recording.

    Attributes
    ----------
    source : file
    names : (N,) labels as written
    start_s : time of the first frame
    rate_hz : frames per second; NaN of one frame in a table, which holds no rate
    first_frame : its number in the file, and in viewers; 1 where the format has none
    points_m : (T, N, 3) [m], NaN where a marker was not seen
    up : laboratory axis that points up, such as "+z", where the file says it
    unit : of lengths in the file
    """

    source: Path
    names: tuple[str, ...]
    start_s: float
    rate_hz: float
    first_frame: int
    points_m: Array
    up: str | None
    unit: str

    @property
    def time_s(self) -> Array:
        """Times of the frames, shape (T,)."""
        # One frame has a time, whatever its rate.
        later = np.arange(1, len(self.points_m)) / self.rate_hz
        return self.start_s + np.concatenate([[0.0], later])

    def column(self, label: str) -> int:
        """Number of the marker with a label, or with this label after a subject's name and colon.

        Raises
        ------
        DataError                    no such marker, or several
        """
        found = [i for i, name in enumerate(self.names) if name == label]
        if not found:
            found = [i for i, name in enumerate(self.names) if name.rpartition(":")[2] == label]
        if len(found) == 1:
            return found[0]
        if found:
            several = ", ".join(self.names[i] for i in found)
            raise DataError(
                f"{self.source}: marker '{label}' is {several}; expected one. Write the whole "
                "label in the marker map, or rename one in the file."
            )
        raise DataError(
            f"{self.source}: no marker '{label}'; found {', '.join(self.names)}. Correct the "
            "marker map, or label the recording."
        )

    def track(self, label: str) -> Array:
        """Positions (T, 3) [m] of a marker, found as by `column`; NaN where it was not seen.

        Raises
        ------
        DataError                    no such marker, several, or one that no frame shows
        """
        track = self.points_m[:, self.column(label)]
        if not np.isfinite(track).all(axis=1).any():
            raise DataError(
                f"{self.source}, marker {label}: not seen in any of {len(track)} frames (positions "
                "of exactly zero count as not seen). Label it in the recording, or map another."
            )
        return track


def read_markers(path: Path) -> Markers:
    """Read a recording of markers.

    Parameters
    ----------
    path : .c3d, .trc, or .csv with columns time_s and <marker>_x_mm, <marker>_y_mm, <marker>_z_mm
        (or _cm, _m); empty cells, NaN and positions of exactly (0, 0, 0) mean "not seen"

    Raises
    ------
    DataError                        other kind of file, an unknown unit, uneven time, no frames
    """
    readers = {".c3d": _read_c3d, ".trc": _read_trc, ".csv": _read_csv}
    suffix = path.suffix.lower()
    if suffix not in readers:
        raise DataError(f"{path}: '{path.suffix}'; expected .c3d, .trc or .csv. Export it as one.")
    if not path.is_file():
        raise DataError(f"{path}: {absent(path)}. Check the name.")
    markers = readers[suffix](path)
    if len(markers.points_m) < 1 or not markers.names:
        raise DataError(
            f"{path}: {len(markers.points_m)} frames of {len(markers.names)} markers; expected at "
            "least one of each. Export the recording again."
        )
    # Software that cannot write "not seen" writes the origin, which no marker ever hits exactly.
    unseen = (markers.points_m == 0.0).all(axis=2)
    markers.points_m[unseen] = np.nan
    return markers


def _metres(path: Path, unit: str, place: str) -> float:
    if unit not in METRES:
        raise DataError(
            f"{path}, {place}: unit '{unit}'; expected {', '.join(METRES)}. Set it in the file."
        )
    return METRES[unit]


def _read_c3d(path: Path) -> Markers:
    from scapulohumeral.emg.c3d_file import read_c3d, text_of

    file = read_c3d(path)
    point = file["parameters"]["POINT"]
    unit = text_of(point["UNITS"]["value"][0]) if point["UNITS"]["value"] else ""
    labels = tuple(map(text_of, _labels(point)))
    scale = _metres(path, unit, "POINT:UNITS")
    # Copied: the array of the library is lost with the file.
    points = np.array(file["data"]["points"][:3].transpose(2, 1, 0), dtype=float) * scale
    rate = float(point["RATE"]["value"][0])
    if not rate > 0.0:
        raise DataError(f"{path}, POINT:RATE: {rate} Hz; expected more than 0. Set it in the file.")
    screen = point.get("Y_SCREEN", {"value": []})["value"]
    up = text_of(screen[0]).lower() if screen else None
    # Time counts from the first frame, as that of analog channels does.
    return Markers(path, labels, 0.0, rate, _first_frame(file), points[:, : len(labels)], up, unit)


def _first_frame(file: Mapping[str, Any]) -> int:
    """Number of the first frame of a C3D file, which is above 1 once a recording was cut."""
    trial = file["parameters"].get("TRIAL", {})
    words = [int(word) for word in trial.get("ACTUAL_START_FIELD", {"value": ()})["value"]]
    if len(words) == 2 and any(words):
        # The header has 16 bits for it; here are two words of 16, the low one first.
        return (words[1] & 0xFFFF) << 16 | words[0] & 0xFFFF
    # The library counts from zero.
    return int(file["header"]["points"]["first_frame"]) + 1


def _labels(point: Mapping[str, Mapping[str, Sequence[str]]]) -> list[str]:
    """Labels of a C3D file: beyond 255 markers they go on in LABELS2, LABELS3 ..."""
    names = [f"LABELS{k or ''}" for k in [0, *range(2, 100)]]
    return [label for name in names if name in point for label in point[name]["value"]]


def _read_trc(path: Path) -> Markers:
    lines = read_text(path).splitlines()
    if len(lines) <= TRC_HEADER_LINES or not lines[0].startswith("PathFileType"):
        raise DataError(f"{path}: no header of a TRC file. Export the recording again.")
    settings = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=False))
    unit = settings.get("Units", "").strip()
    scale = _metres(path, unit, "row 3, Units")
    names = tuple(name.strip() for name in lines[3].split("\t")[2:] if name.strip())
    columns = ["Frame#", "Time", *(f"{name} {axis}" for name in names for axis in "XYZ")]
    body = [(i, line) for i, line in enumerate(lines[5:], start=6) if line.strip()]
    rows = [_trc_row(path, i, line, columns) for i, line in body]
    table = np.array(rows).reshape(-1, len(columns))
    # Some programs leave an empty row before the numbers.
    first = body[0][0] if body else 6
    rate = _rate(path, "Time", table[:, 1], first)
    if len(table) > 1:
        _check_rate(path, settings.get("DataRate", ""), rate)
    points = table[:, 2:].reshape(len(table), len(names), 3) * scale
    # Data of OpenSim stand y up, but the format does not say so.
    first_frame = _first_number(table[:, 0])
    return Markers(path, names, float(table[0, 1]), rate, first_frame, points, None, unit)


def _first_number(numbers: Array) -> int:
    """First of the numbers of frames (T,) in a file; 1 where they are missing or skip some."""
    counted = np.isfinite(numbers).all() and (np.diff(numbers) == 1.0).all()
    return int(numbers[0]) if counted else 1


def _rate(path: Path, column: str, time_s: Array, first_row: int) -> float:
    """Frames per second by the times of a table; NaN of one frame, a posture that needs none."""
    return np.nan if len(time_s) == 1 else uniform_rate(path, column, time_s, first_row)


def _check_rate(path: Path, written: str, rate_hz: float) -> None:
    """Refuse a header that contradicts the times of the frames."""
    stated = _cell(path, 3, "DataRate", written)
    if not abs(stated - rate_hz) <= RATE_TOLERANCE * rate_hz:
        raise DataError(
            f"{path}, row 3, DataRate: {written.strip()} Hz, but the column Time has {rate_hz:.2f} "
            "frames per second. Correct the one that is wrong: speeds hang on it."
        )


def _trc_row(path: Path, row: int, line: str, columns: Sequence[str]) -> list[float]:
    width = len(columns)
    cells = line.rstrip("\r\n").split("\t")
    # A tab after the last number is common, and so are missing cells of unseen markers at the end.
    cells = (cells + [""] * width)[:width] if not any(c.strip() for c in cells[width:]) else cells
    if len(cells) != width:
        raise DataError(
            f"{path}, row {row}: {len(cells)} cells; expected {width} for the markers named in "
            "row 4. Export the recording again."
        )
    return [_cell(path, row, name, cell) for name, cell in zip(columns, cells, strict=True)]


def _cell(path: Path, row: int, column: str, text: str) -> float:
    if not text.strip():
        return np.nan
    try:
        return float(text)
    except ValueError:
        raise DataError(
            f"{path}, row {row}, column {column}: '{text}' is not a number. "
            "Write a decimal number with a point."
        ) from None


def _read_csv(path: Path) -> Markers:
    rows = read_rows(path, (TIME_COLUMN,))
    found = {name: CSV_COLUMN.fullmatch(name) for name in rows[0]}
    columns = {name: match for name, match in found.items() if match}
    names = tuple(dict.fromkeys(match["marker"] for match in columns.values()))
    units = {match["unit"] for match in columns.values()}
    if len(units) != 1:
        raise DataError(
            f"{path}, row 1: {'several units' if units else 'no marker columns'}; expected "
            "<marker>_x_mm, <marker>_y_mm, <marker>_z_mm (or _cm, or _m) throughout. Rename them."
        )
    [unit] = units
    wanted = [f"{name}_{axis}_{unit}" for name in names for axis in "xyz"]
    missing = [name for name in wanted if name not in columns]
    if missing:
        raise DataError(f"{path}, row 1: missing column {', '.join(missing)}. Add it.")
    table = np.array(
        [
            [_cell(path, i, name, row[name]) for name in wanted]
            for i, row in enumerate(rows, start=2)
        ]
    )
    time = np.array([number(path, i, row, TIME_COLUMN) for i, row in enumerate(rows, start=2)])
    rate = _rate(path, TIME_COLUMN, time, first_row=2)
    points = table.reshape(len(table), len(names), 3) * METRES[unit]
    return Markers(path, names, float(time[0]), rate, 1, points, None, unit)
