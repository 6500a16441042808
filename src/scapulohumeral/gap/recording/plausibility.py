"""Refusal of recordings that no shoulder makes: another unit of time, a girdle turned over, rest.

Letters: T frames.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording.motion_files import MotionTable
from scapulohumeral.laboratory.checks import Limits, turns_deg
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    Array,
    pose_to_trial,
    relative_angle,
    segment_orientations,
    trial_to_pose,
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
# ASSUME: a posture that is held sways by 1 to 2 deg, as much as repeated palpation differs.
LEAST_MOVEMENT_DEG = 5.0
# Less between two rows is noise, which at high rates is fast too.
LEAST_JUMP_DEG = 10.0


def check_rate(table: MotionTable, time_s: Array) -> None:
    """Refuse gaps, and times in another unit than seconds: their steps are too long for an arm.

    Raises
    ------
    DataError                        names file, and row of a gap
    """
    path, limit = table.path, Limits().longest_step_s
    step = float(np.median(np.diff(time_s)))
    if step > limit:
        raise DataError(
            f"{path}, column time: steps of {step:g} s; expected {limit} s or less, as "
            "arm motion needs. If these are milliseconds, divide by 1000; if they are frames, by "
            "the rate; else record at a higher one."
        )
    longest = int(np.diff(time_s).argmax())
    if time_s[longest + 1] - time_s[longest] > LONGEST_GAP_S:
        raise DataError(
            f"{path}, row {table.row(longest + 1)}, column {table.header('time')}: "
            f"{time_s[longest + 1]:g} s follows {time_s[longest]:g} s; expected {LONGEST_GAP_S:g} "
            "s or less between rows. Make a trial of each part."
        )


def check_ranges(table: MotionTable, pose: Array) -> None:
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


def check_speed(table: MotionTable, time_s: Array, pose: Array) -> None:
    """Refuse jumps of a segment in the thorax, or of the elbow: markers lost, exchanged, or at 0.

    Parameters
    ----------
    table : where the pose is from; time_s : (T,); pose : (T, 13)

    Raises
    ------
    DataError                        names file, row and segment
    """
    limits = Limits()
    turns = turns_deg(pose) | {"forearm": np.rad2deg(np.abs(np.diff(pose[:, 12])))}
    for name, turn in turns.items():
        speed, limit = turn / np.diff(time_s), limits.largest_speed(name)
        beyond = np.flatnonzero((speed > limit) & (turn > LEAST_JUMP_DEG))
        if beyond.size:
            k = int(beyond[0])
            raise DataError(
                f"{table.path}, row {table.row(k + 1)}: the {name} turns by "
                f"{turn[k]:.0f} deg from the row before, {speed[k]:.0f} deg/s; "
                f"expected at most {limit:.0f}. Fill gaps of the record by interpolation, or cut "
                "the rows."
            )


def check_movement(path: Path, smooth: Motion) -> None:
    """Refuse a trial in which no joint, nor the humerus in the thorax, turns noticeably.

    Parameters
    ----------
    path : file; smooth : its movement, smoothed

    Raises
    ------
    DataError                        names file and largest turn
    """
    pose = trial_to_pose(smooth.angles_rad)
    joints = [pose[:, i : i + 4] for i in (0, 4, 8)]
    joints.append(segment_orientations(pose)["humerus"])
    turns = [relative_angle(joint[:1], joint).max() for joint in joints]
    largest = np.rad2deg(max(*turns, np.ptp(pose[:, 12])))
    if largest < LEAST_MOVEMENT_DEG:
        raise DataError(
            f"{path}, columns {ANGLE_NAMES[0]} to {ANGLE_NAMES[-1]}: no joint turns by more than "
            f"{largest:.1f} deg; expected a movement of {LEAST_MOVEMENT_DEG:.0f} deg or more. "
            "Leave the trial out: a diagnosis compares movements. Angles in radians have to be "
            "multiplied by 180/pi."
        )


@cache
def _limits_deg() -> tuple[Array, Array]:
    """Lowest and highest angle of `RANGED` that is believed."""
    coordinates = read_tables(MODEL_TABLES).coordinates
    ranges = [(coordinates[name].min_rad, coordinates[name].max_rad) for name in RANGED]
    low, high = np.rad2deg(ranges).T
    return low - MARGIN_DEG, high + MARGIN_DEG
