"""Raw EMG recordings, read from CSV and C3D and checked.

Letters: T samples, C channels. Everything returned is in seconds and volts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scapulohumeral.emg.c3d_file import read_c3d, text_of
from scapulohumeral.emg.signal_table import read_signals, write_failed_signals, write_signals
from scapulohumeral.errors import DataError, absent
from scapulohumeral.model.csv_table import uniform_rate
from scapulohumeral.model.motion import TIME_COLUMN
from scapulohumeral.model.rotations import Array

# A 4 Hz envelope has settled after a quarter of a second; shorter recordings are all ends.
SHORTEST_S = 1.0
VOLTS = {"V": 1.0, "mV": 1e-3, "uV": 1e-6, "µV": 1e-6, "Volts": 1.0}


@dataclass(frozen=True, eq=False)
class Recording:
    """Raw EMG of one trial, or of the maximal voluntary contractions (MVC).

    Attributes
    ----------
    source : file it was read from, or what made it: named in errors
    channels : (C,)
    start_s : time of the first sample on the clock of the recording
    rate_hz : sampling rate
    volts : (T, C)
    simulated : whether no electrode has seen the signals
    """

    source: str
    channels: tuple[str, ...]
    start_s: float
    rate_hz: float
    volts: Array
    simulated: bool

    @property
    def time_s(self) -> Array:
        """Times of the samples, shape (T,)."""
        return self.start_s + np.arange(len(self.volts)) / self.rate_hz


def read_recording(
    path: Path, channels: Sequence[str], labels: Mapping[str, str] | None = None
) -> Recording:
    """Read a raw recording.

    Parameters
    ----------
    path : Path                      .csv with columns time_s and <channel>_V, or .c3d with analog
                                     channels in V, mV or uV; its time counts from the first frame
    channels : (C,) wanted channels
    labels : channel -> label in the C3D file, where it differs from the name of the channel

    Raises
    ------
    DataError                        other kind of file, a missing channel, a sample that is no
                                     number, time that is not uniform, an unknown unit, or less
                                     than a second; names file, row and column
    SolveError                       a recording that could not be simulated
    """
    if not path.is_file():
        raise DataError(
            f"{path}: {absent(path)}. Check the name where the recording is referred to."
        )
    readers = {".csv": _read_csv, ".c3d": _read_c3d}
    if path.suffix.lower() not in readers:
        raise DataError(
            f"{path}: '{path.suffix}'; expected .csv or .c3d. Export it as one of them."
        )
    recording = readers[path.suffix.lower()](path, channels, labels or {})
    duration = len(recording.volts) / recording.rate_hz
    if duration < SHORTEST_S:
        raise DataError(
            f"{path}: {duration:.3f} s; an envelope needs at least {SHORTEST_S} s. Record longer."
        )
    return recording


def write_recording(path: Path, recording: Recording) -> None:
    """Write a recording as CSV: time_s, <channel>_V, simulated."""
    columns = [f"{name}_V" for name in recording.channels]
    write_signals(path, columns, recording.time_s, recording.volts, recording.simulated)


def write_failed_recording(path: Path, channels: Sequence[str], reason: str) -> None:
    """Write what stands for a recording that could not be simulated."""
    write_failed_signals(path, [f"{name}_V" for name in channels], reason)


def _read_csv(path: Path, channels: Sequence[str], labels: Mapping[str, str]) -> Recording:
    time, volts, simulated = read_signals(path, [f"{name}_V" for name in channels])
    rate = uniform_rate(path, TIME_COLUMN, time)
    return Recording(str(path), tuple(channels), float(time[0]), rate, volts, simulated)


def _read_c3d(path: Path, channels: Sequence[str], labels: Mapping[str, str]) -> Recording:
    file = read_c3d(path)
    analog = file["parameters"]["ANALOG"]
    found = [text_of(label) for label in analog["LABELS"]["value"]]
    units = [text_of(unit) for unit in analog["UNITS"]["value"]]
    columns = [_c3d_column(path, labels.get(name, name), found) for name in channels]
    scale = [_volts_per_unit(path, found[i], units[i] if i < len(units) else "") for i in columns]
    volts = file["data"]["analogs"][0, columns].T * scale
    faulty = np.argwhere(~np.isfinite(volts))
    if faulty.size:
        sample, channel = faulty[0]
        raise DataError(
            f"{path}, sample {sample + 1}, channel {found[columns[channel]]}: "
            f"{volts[sample, channel]}; expected a finite number. Cut the recording there."
        )
    rate = float(analog["RATE"]["value"][0])
    return Recording(str(path), tuple(channels), 0.0, rate, volts, simulated=False)


def _c3d_column(path: Path, label: str, found: Sequence[str]) -> int:
    if label not in found:
        raise DataError(
            f"{path}: no analog channel '{label}'; found {', '.join(found) or 'none'}. "
            "Correct the label: in the EMG map, or in emg.labels of participant.yaml."
        )
    if found.count(label) > 1:
        raise DataError(
            f"{path}: {found.count(label)} analog channels '{label}'; expected one, since nothing "
            "tells them apart. Rename all but one in the file."
        )
    return found.index(label)


def _volts_per_unit(path: Path, label: str, unit: str) -> float:
    # The micro sign and the Greek letter look the same.
    unit = unit.replace("\N{GREEK SMALL LETTER MU}", "\N{MICRO SIGN}")
    if unit not in VOLTS:
        raise DataError(
            f"{path}, channel {label}: unit '{unit}'; expected {', '.join(VOLTS)}. "
            "Set ANALOG:UNITS of the file."
        )
    return VOLTS[unit]
