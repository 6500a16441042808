"""Recorded trials for a diagnosis, read from CSV, .mot or .sto files with optional companions.

``STEM.csv`` (degrees) or ``STEM.mot`` (unit by its header) has the time and the ten joint angles;
EMG and contact force are further columns of it or companions ``STEM_emg.csv``, ``STEM_force.csv``
(or .mot, .sto) at their own rate, on the same clock. Nothing is resampled or filtered here.

Letters: T frames, S samples of a companion.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.gap.recording.case import ContactSeries, EmgSeries, GapTrial
from scapulohumeral.gap.recording.held_still import check_movement
from scapulohumeral.gap.recording.holes import filled
from scapulohumeral.gap.recording.motion_files import MotionTable, read_table
from scapulohumeral.gap.recording.movement_window import movement_window, smoothed
from scapulohumeral.gap.recording.observables import CONTACT_CHANNELS
from scapulohumeral.laboratory.record import read_channels
from scapulohumeral.laboratory.trial import MEASURED
from scapulohumeral.model.csv_table import check_increasing, first_line_names
from scapulohumeral.model.motion import COLUMNS, TIME_COLUMN, Motion, without_turns
from scapulohumeral.model.plausibility import check_ranges, check_rate, check_speed
from scapulohumeral.model.rotations import ANGLE_NAMES, Array, trial_to_pose

COMPANION = re.compile(r"(?P<stem>.+)_(?:emg|force)")
EMG_COLUMN = re.compile(r"EMG_[^/+ >]+")
SUFFIXES = (".csv", ".mot", ".sto")
FEWEST_FRAMES = 10
SHORTEST_S = 0.2
# Envelopes as shares of the maximum stay within a few units, also with a wrong gain; as percent,
# or in microvolt, they do not.
LARGEST_EMG = 10.0
# Envelopes without their rest level may be negative by noise, about 0.02 of the maximum; ten times
# that is a signal that was not rectified.
LOWEST_EMG = -0.2
# ASSUME: envelopes of an arm that moves reach this share of the maximum in one muscle at least.
LEAST_EMG = 0.005
# ASSUME: nearly seven times the weight of the heaviest person accepted, 300 kg, is no joint force.
LARGEST_FORCE_N = 2.0e4
# ASSUME: muscles press the humerus of a hanging arm against the glenoid with more than this.
LEAST_FORCE_N = 5.0
# Ends of a companion may miss the movement by this, about one frame of video.
CLOCK_TOLERANCE_S = 0.05
# Turns that an angle may have. The outer angles of the humerus are undefined while the arm hangs,
# and software that makes them continuous may wind them up by a turn with every elevation.
MOST_TURNS = np.where(np.isin(ANGLE_NAMES, ("GH_y", "GH_yy")), 20.0, 2.0)


@dataclass(frozen=True)
class TrialEntry:
    """What a participant file says of a trial; None: from the name of the file, or the motion."""

    task: str | None = None
    repeat: int | None = None
    window_s: tuple[float, float] | None = None


def trial_files(paths: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """The trials among files: companions of another trial are left out.

    Returns
    -------
    paths : trials, each file once
    notes : one sentence per companion left out

    Raises
    ------
    DataError                        no trial is left, or one is there in two formats
    """
    trials, notes = [], []
    for path in dict.fromkeys(paths):
        if (owner := _companion_of(path)) is not None:
            notes.append(f"{path}: read with {owner.name}, not as a trial of its own")
        elif _is_orphan(path):
            notes.append(
                f"{path}: left out, because the trial that it belongs to is not there (of a "
                "recording with a fault scapulohumeral convert writes none)"
            )
        else:
            trials.append(path)
    if notes and not trials:
        raise DataError(f"{notes[0]}; expected trials beside it. Name them.")
    known: dict[Path, Path] = {}
    for path in trials:
        other = known.setdefault(path.with_suffix(""), path)
        if other is not path:
            raise DataError(
                f"{other} and {path}: one trial in two formats would count as two repeats; "
                "expected one of them. Leave the other out."
            )
    return trials, notes


def check_entries(
    file: Path, entries: Mapping[str, TrialEntry], paths: Sequence[Path]
) -> list[str]:
    """Refuse entries of a participant file that nearly name a trial: they would be overlooked.

    Others may be of trials that are not compared now. If no file beside has their name, a sentence
    says so.

    Parameters
    ----------
    file : participant file; entries : what it says, by stem
    paths : trials, as from `trial_files`

    Raises
    ------
    ConfigError                      names the entry and the trial
    """
    stems, notes = {path.stem for path in paths}, []
    near = (*file.parent.glob("*"), *file.parent.glob("*/*"))
    beside = {path.stem for path in near if path.suffix.lower() in SUFFIXES}
    meant = {stem.casefold(): stem for stem in stems}
    for name in entries.keys() - stems:
        stem = meant.get(Path(name).stem.casefold() if name.endswith(SUFFIXES) else name.casefold())
        if stem is not None and stem not in entries:
            raise ConfigError(
                f"{file}, trials.{name}: no such trial; expected '{stem}', the name of its file "
                "without the suffix. Rename the entry."
            )
        if name not in beside | stems:
            notes.append(f"{file}, trials.{name}: no file of this name; look how it is spelt")
    return notes


def read_trials(
    paths: Sequence[Path], entries: Mapping[str, TrialEntry], channels: Sequence[str] = ()
) -> tuple[list[GapTrial], list[str]]:
    """Read trials with their companions.

    Parameters
    ----------
    paths : files, as from `trial_files`
    entries : stem of a file -> what the participant file says of it
    channels : of EMG that are read; none: all that there are

    Returns
    -------
    trials : in the order of `paths`
    notes : one sentence per file with columns that are not used

    Raises
    ------
    DataError                        names file, row and column, what was expected, and the remedy
    """
    trials, notes = [], []
    for path in paths:
        trial, ignored = read_trial(path, entries.get(path.stem, TrialEntry()), channels)
        trials.append(trial)
        notes += [f"{file}: columns ignored: {', '.join(names)}" for file, names in ignored.items()]
        emg = sorted({n for names in ignored.values() for n in names if EMG_COLUMN.fullmatch(n)})
        if emg:
            notes.append(
                f"{path.stem}: EMG of {', '.join(emg)} is not compared: not in emg.channels of the "
                "participant file"
            )
    return trials, notes


def read_trial(
    path: Path, entry: TrialEntry, channels: Sequence[str] = ()
) -> tuple[GapTrial, dict[Path, tuple[str, ...]]]:
    """Read one trial with its companions, and the columns that are not used, by file.

    Raises
    ------
    DataError                        see `read_trials`
    """
    if path.suffix.lower() not in SUFFIXES:
        raise DataError(
            f"{path}: suffix '{path.suffix}'; expected {' or '.join(SUFFIXES)}. "
            "Export it as one of them."
        )
    table = read_table(path).renamed({own: name for name, own in COLUMNS.items()})
    time_s = _time(table)
    angles = without_turns(_angles_rad(table))
    emg_table, emg_columns = _series_table(table, path, "emg", _emg_columns)
    force_table, force_columns = _series_table(table, path, "force", _force_columns)
    emg_columns = _known(emg_table, emg_columns, channels)
    pose = trial_to_pose(angles)
    check_speed(table, time_s, pose)
    check_ranges(table, pose)
    smooth = smoothed(filled(Motion(time_s, angles)))
    window = entry.window_s or movement_window(smooth)
    _check_window(path, time_s, window)
    moving = (smooth.time_s >= window[0]) & (smooth.time_s <= window[1])
    check_movement(path, Motion(smooth.time_s[moving], smooth.angles_rad[moving]))
    task, repeat = task_and_repeat(path.stem)
    trial = GapTrial(
        name=path.stem,
        task=(entry.task or task).strip(),
        repeat=entry.repeat or repeat,
        time_s=time_s,
        angles_rad=angles,
        smooth=smooth,
        emg=_emg(emg_table, emg_columns, window),
        contact=_contact(force_table, force_columns, window),
        window_s=window,
        source=path,
        rules={
            angle: channel
            for angle, channel in read_channels(path).items()
            if channel.status != MEASURED
        },
    )
    used = {"time", *ANGLE_NAMES, *emg_columns, *force_columns}
    tables = {part.path: part for part in (table, emg_table, force_table) if part is not None}
    ignored = {
        file: tuple(name for name in part.columns if name not in used)
        for file, part in tables.items()
    }
    return trial, {file: names for file, names in ignored.items() if names}


def task_and_repeat(stem: str) -> tuple[str, int | None]:
    """Task and repeat by the name of a file: ``frontal_r2`` is repeat 2 of ``frontal``.

    Other names are those of a task, and say no repeat.
    """
    match = re.fullmatch(r"(?P<task>.+)_r(?P<repeat>\d+)", stem)
    return (match["task"], int(match["repeat"])) if match else (stem, None)


def _is_orphan(path: Path) -> bool:
    """Whether a file is a companion by name and columns, whose trial is not there."""
    if not COMPANION.fullmatch(path.stem) or path.suffix.lower() not in SUFFIXES:
        return False
    if not path.is_file():
        return False
    is_csv = path.suffix.lower() == ".csv"
    names = first_line_names(path) if is_csv else {*read_table(path).columns}
    return not {*COLUMNS, *COLUMNS.values()} - {"time", TIME_COLUMN} & names


def _companion_of(path: Path) -> Path | None:
    """The trial whose companion a file is, or None."""
    match = COMPANION.fullmatch(path.stem)
    if match is None or path.suffix.lower() not in SUFFIXES:
        return None
    owners = (path.with_name(match["stem"] + suffix) for suffix in SUFFIXES)
    return next((owner for owner in owners if owner.is_file()), None)


def _time(table: MotionTable) -> Array:
    time_s = table.numbers(["time"])[:, 0]
    if len(time_s) < FEWEST_FRAMES:
        raise DataError(
            f"{table.path}: {len(time_s)} rows; expected {FEWEST_FRAMES} or more. "
            "Record longer, or at a higher rate."
        )
    check_increasing(table.path, table.header("time"), time_s, table.first_row)
    check_rate(table, time_s)
    return time_s


def _check_clavicle(table: MotionTable) -> None:
    """Refuse a trial of other joints alone: many laboratories do not measure the clavicle."""
    clavicle = [name for name in ANGLE_NAMES if name.startswith("SC_")]
    if not set(clavicle) & set(table.columns):
        raise DataError(
            f"{table.path}, row {table.first_row - 1}: missing column {', '.join(clavicle)}; found "
            f"{', '.join(table.columns)}. Rename or add the columns. If the clavicle was not "
            "measured, make the trial by `scapulohumeral convert` from markers or orientations of "
            "segments: it estimates the clavicle and marks it."
        )


def _angles_rad(table: MotionTable) -> Array:
    _check_clavicle(table)
    angles = table.numbers(ANGLE_NAMES)
    if not table.in_degrees:
        beyond = np.argwhere(np.abs(angles) > 2.0 * np.pi * MOST_TURNS)
        if beyond.size:
            i, k = beyond[0]
            raise DataError(
                f"{table.path}, row {table.row(i)}, column {ANGLE_NAMES[k]}: {angles[i, k]} rad is "
                f"beyond {MOST_TURNS[k]:.0f} turns, so these are degrees. Write inDegrees=yes into "
                "the header."
            )
        return angles
    # In degrees, one radian's turn would mean a scapula parallel to the clavicle, where no shoulder
    # can be (AC_y is 33 to 69 deg).
    scapula = [i for i, name in enumerate(ANGLE_NAMES) if name.startswith("AC_")]
    largest = np.abs(angles[:, scapula]).max()
    if largest <= 2.0 * np.pi:
        raise DataError(
            f"{table.path}, columns {', '.join(ANGLE_NAMES[i] for i in scapula)}: all angles are "
            f"within +-{largest:.2f}, so these are radians; expected degrees in all columns. "
            "Multiply by 180/pi, or in a .mot file write inDegrees=no."
        )
    beyond = np.argwhere(np.abs(angles) > 360.0 * MOST_TURNS)
    if beyond.size:
        i, k = beyond[0]
        raise DataError(
            f"{table.path}, row {table.row(i)}, column {table.header(ANGLE_NAMES[k])}: "
            f"{angles[i, k]} deg is beyond {MOST_TURNS[k]:.0f} turns. Check the unit, or subtract "
            "full turns."
        )
    return np.deg2rad(angles)


def _emg_columns(table: MotionTable) -> tuple[str, ...]:
    return tuple(sorted(name for name in table.columns if EMG_COLUMN.fullmatch(name)))


def _known(
    table: MotionTable | None, columns: tuple[str, ...], channels: Sequence[str]
) -> tuple[str, ...]:
    """Columns of EMG that the participant file knows: what is not compared need not be sound.

    Raises
    ------
    DataError                        it knows none of them
    """
    known = tuple(name for name in columns if name in channels)
    if table is None or not channels or known:
        return known if channels else columns
    letters = {name.casefold() for name in channels}
    capitals = any(name.casefold() in letters for name in columns)
    raise DataError(
        f"{table.path}, columns {', '.join(columns)}: none is in emg.channels of the participant "
        f"file, {', '.join(channels)}{', which differ by capital letters' if capitals else ''}. "
        "Rename the columns or the channels."
    )


def _force_columns(table: MotionTable) -> tuple[str, ...]:
    present = tuple(name for name in CONTACT_CHANNELS if name in table.columns)
    if present and present != CONTACT_CHANNELS:
        raise DataError(
            f"{table.path}: columns {', '.join(present)} alone; expected all of "
            f"{', '.join(CONTACT_CHANNELS)}. Add the missing components, or leave all out."
        )
    return present


def _series_table(
    table: MotionTable,
    path: Path,
    kind: str,
    columns_of: Callable[[MotionTable], tuple[str, ...]],
) -> tuple[MotionTable | None, tuple[str, ...]]:
    """Where a companion series stands, its own file or the trial's, and its columns there."""
    columns = columns_of(table)
    files = [path.with_name(f"{path.stem}_{kind}{suffix}") for suffix in SUFFIXES]
    files = [file for file in files if file.is_file()]
    if not files:
        return (table, columns) if columns else (None, ())
    if len(files) > 1:
        raise DataError(
            f"{files[0]} and {files[1].name}: one recording in two formats; expected one of them. "
            "Remove the other."
        )
    [file] = files
    companion = read_table(file).renamed({TIME_COLUMN: "time"})
    if columns:
        raise DataError(
            f"{path} has the columns {', '.join(columns)} and {file.name} exists too; expected one "
            "of them. Remove the columns or the file."
        )
    columns = columns_of(companion)
    if not columns:
        raise DataError(
            f"{file}, row 1: found {', '.join(companion.columns)}; expected "
            f"{'EMG_...' if kind == 'emg' else ', '.join(CONTACT_CHANNELS)}. Correct the header."
        )
    return companion, columns


def _emg(
    table: MotionTable | None, columns: tuple[str, ...], window: tuple[float, float]
) -> EmgSeries | None:
    if table is None:
        return None
    time_s, values = _time(table), table.numbers(columns)
    _check_clock(table.path, time_s, window)
    beyond = np.argwhere((values < LOWEST_EMG) | (values > LARGEST_EMG))
    if beyond.size:
        i, k = beyond[0]
        raise DataError(
            f"{table.path}, row {table.row(i)}, column {columns[k]}: {values[i, k]}; expected a "
            f"share of the maximum, {LOWEST_EMG} to {LARGEST_EMG}. Rectify and smooth raw signals; "
            "divide percent by 100, and volts by those of a maximal contraction."
        )
    if values.max() < LEAST_EMG:
        raise DataError(
            f"{table.path}, columns {', '.join(columns)}: at most {values.max():g}; expected a "
            "share of the maximum, which no movement leaves this low in all muscles. Divide volts "
            "by those of a maximal contraction."
        )
    return EmgSeries(time_s, columns, values)


def _contact(
    table: MotionTable | None, columns: tuple[str, ...], window: tuple[float, float]
) -> ContactSeries | None:
    if table is None:
        return None
    time_s = _time(table)
    _check_clock(table.path, time_s, window)
    values = table.numbers(columns)
    largest = np.linalg.norm(values, axis=1).max()
    if largest < LEAST_FORCE_N:
        raise DataError(
            f"{table.path}, columns {', '.join(columns)}: {largest:g} N at most; expected "
            f"{LEAST_FORCE_N:g} or more. Convert the forces to newtons."
        )
    beyond = np.argwhere(np.abs(values) > LARGEST_FORCE_N)
    if beyond.size:
        i, k = beyond[0]
        raise DataError(
            f"{table.path}, row {table.row(i)}, column {columns[k]}: {values[i, k]:g} N; expected "
            f"at most {LARGEST_FORCE_N:g}. Convert the forces to newtons."
        )
    return ContactSeries(time_s, values)


def _check_clock(path: Path, time_s: Array, window: tuple[float, float]) -> None:
    if time_s[0] > window[0] + CLOCK_TOLERANCE_S or time_s[-1] < window[1] - CLOCK_TOLERANCE_S:
        raise DataError(
            f"{path}: {time_s[0]:.3f} to {time_s[-1]:.3f} s; expected to cover the movement, "
            f"{window[0]:.3f} to {window[1]:.3f} s. Put both files on one clock."
        )


def _check_window(path: Path, time_s: Array, window: tuple[float, float]) -> None:
    if window[0] < time_s[0] - CLOCK_TOLERANCE_S or window[1] > time_s[-1] + CLOCK_TOLERANCE_S:
        raise DataError(
            f"{path}: {time_s[0]:.3f} to {time_s[-1]:.3f} s; expected to cover window_s of the "
            f"participant file, {window[0]:g} to {window[1]:g} s. Correct the window: it is on the "
            "clock of the trial."
        )
    inside = np.count_nonzero((time_s >= window[0]) & (time_s <= window[1]))
    if window[1] - window[0] < SHORTEST_S or inside < FEWEST_FRAMES:
        raise DataError(
            f"{path}: the movement, {window[0]:.3f} to {window[1]:.3f} s, has {inside} frames; "
            f"expected {FEWEST_FRAMES} or more and {SHORTEST_S} s or longer. Record at a higher "
            "rate, or give window_s in the participant file."
        )
