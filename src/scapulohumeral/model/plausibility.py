"""Refusal of recordings that no shoulder makes: another unit of time, gaps, jumps, turned girdles.

Letters: T frames.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Protocol

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    Array,
    pose_to_trial,
    relative_angle,
    segment_orientations,
)
from scapulohumeral.model.tables import read_tables
from scapulohumeral.provenance import MODEL_TABLES

# ASSUME: a whole reach fits into a second, so nobody knows what the arm did in a longer gap.
LONGEST_GAP_S = 1.0
# ASSUME: beyond the ranges of the model. Living persons exceed these, the shipped recordings by
# up to 23 deg, and an offset of the scapula markers adds as much again.
MARGIN_DEG = 60.0
# The humerus has no unique form.
RANGED = tuple(name for name in ANGLE_NAMES if not name.startswith("GH_"))
# Less between two rows is noise, which at high rates is fast too.
LEAST_JUMP_DEG = 10.0
# Arm motion reaches 6 Hz (Winter 2009, section 3.4.4.2), so nobody samples it below 5 Hz; in
# milliseconds steps are longer than this up to 5 kHz.
LONGEST_STEP_S = 0.2
# Clavicle and scapula in the thorax turn at 250 deg/s in fast arm motions.
GIRDLE_DEG_PER_S = 1000.0
# Humerus in the thorax, and elbow: throwing is slower about every axis but that of the humerus.
ARM_DEG_PER_S = 2500.0


class Places(Protocol):
    """Where the numbers of a recording stand: for messages."""

    @property
    def path(self) -> Path:
        """The file."""

    def row(self, index: int) -> int:
        """Number of the data row with this index, as a text editor shows it."""

    def header(self, column: str) -> str:
        """Name in the file of ``time`` or of a joint angle."""


def largest_speed(segment: str) -> float:
    """How fast a segment in the thorax, or the forearm, may turn [deg/s]."""
    return GIRDLE_DEG_PER_S if segment in ("clavicle", "scapula") else ARM_DEG_PER_S


def turns_deg(pose: Array) -> dict[str, Array]:
    """Turns between frames (T - 1,) by name: clavicle, scapula and humerus in the thorax, forearm
    on the humerus.
    """
    segments = segment_orientations(pose)
    turns = {name: relative_angle(q[:-1], q[1:]) for name, q in segments.items()}
    turns["forearm"] = np.abs(np.diff(pose[:, 12]))
    return {name: np.rad2deg(turn) for name, turn in turns.items()}


def check_rate(table: Places, time_s: Array) -> None:
    """Refuse gaps, and times in another unit than seconds: their steps are too long for an arm.

    Raises
    ------
    DataError                        names file, and row of a gap
    """
    path, column = table.path, table.header("time")
    step = float(np.median(np.diff(time_s)))
    if step > LONGEST_STEP_S:
        raise DataError(
            f"{path}, column {column}: steps of {step:g} s; expected {LONGEST_STEP_S} s or less, "
            "as arm motion needs. If these are milliseconds, divide by 1000; if they are frames, "
            "by the rate; else record at a higher one."
        )
    longest = int(np.diff(time_s).argmax())
    if time_s[longest + 1] - time_s[longest] > LONGEST_GAP_S:
        raise DataError(
            f"{path}, row {table.row(longest + 1)}, column {column}: "
            f"{time_s[longest + 1]:g} s follows {time_s[longest]:g} s; expected {LONGEST_GAP_S:g} "
            "s or less between rows. Make a trial of each part."
        )


def check_ranges(table: Places, pose: Array) -> None:
    """Refuse clavicle, scapula or elbow turned further than any person's, however they are wound.

    Parameters
    ----------
    table : where the pose is from; pose : (T, 13)

    Raises
    ------
    DataError                        names file, row and column
    """
    columns = [ANGLE_NAMES.index(name) for name in RANGED]
    canonical = np.rad2deg(pose_to_trial(pose))[:, columns]
    low, high = _limits_deg()
    beyond = np.argwhere((canonical < low) | (canonical > high))
    if beyond.size:
        i, k = beyond[0]
        raise DataError(
            f"{table.path}, row {table.row(i)}, column {table.header(RANGED[k])}: the joint is at "
            f"{canonical[i, k]:.0f} deg; expected {low[k]:.0f} to {high[k]:.0f} deg, since no "
            "shoulder turns further. Check axes, sequence and signs of the joint angles."
        )


def check_speed(table: Places, time_s: Array, pose: Array) -> None:
    """Refuse jumps of a segment in the thorax, or of the elbow: markers lost, exchanged, or at 0.

    Parameters
    ----------
    table : where the pose is from; time_s : (T,); pose : (T, 13)

    Raises
    ------
    DataError                        names file, row and segment
    """
    for name, turn in turns_deg(pose).items():
        speed, limit = turn / np.diff(time_s), largest_speed(name)
        beyond = np.flatnonzero((speed > limit) & (turn > LEAST_JUMP_DEG))
        if beyond.size:
            k = int(beyond[0])
            raise DataError(
                f"{table.path}, row {table.row(k + 1)}: the {name} turns by "
                f"{turn[k]:.0f} deg from the row before, {speed[k]:.0f} deg/s; "
                f"expected at most {limit:.0f}. Fill gaps of the record by interpolation, or cut "
                "the rows."
            )


@cache
def _limits_deg() -> tuple[Array, Array]:
    """Lowest and highest angle of `RANGED` that is believed."""
    coordinates = read_tables(MODEL_TABLES).coordinates
    ranges = [(coordinates[name].min_rad, coordinates[name].max_rad) for name in RANGED]
    low, high = np.rad2deg(ranges).T
    return low - MARGIN_DEG, high + MARGIN_DEG
