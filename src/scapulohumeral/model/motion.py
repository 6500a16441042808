"""Recorded motions: joint angles over time, read and checked.

Letters: T frames. The ten joint angles of a frame are in the order of ``rotations.ANGLE_NAMES``.
Files hold degrees and seconds; everything returned is in radians and seconds.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.errors import DataError
from scapulohumeral.model.csv_table import check_increasing, read_numbers
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    Array,
    continuous_angles,
    pose_to_trial,
    trial_to_pose,
    unit_pose,
)

TIME_COLUMN = "time_s"
ANGLE_COLUMNS = tuple(f"{name}_deg" for name in ANGLE_NAMES)
# Tables of this project carry the unit in the name.
COLUMNS = {"time": TIME_COLUMN, **dict(zip(ANGLE_NAMES, ANGLE_COLUMNS, strict=True))}
FEWEST_FRAMES = 4


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint angles over time: `time_s` (T,), `angles_rad` (T, 10)."""

    time_s: Array
    angles_rad: Array


@dataclass(frozen=True)
class MotionPlaces:
    """Where the numbers of a motion stand in its table, see :class:`plausibility.Places`."""

    path: Path

    def row(self, index: int) -> int:
        """Number of a frame's row; the header is row 1."""
        return int(index) + 2

    def header(self, column: str) -> str:
        """Name of a column with its unit."""
        return COLUMNS[column]


def read_motion(path: Path) -> Motion:
    """Joint angles over time from a table in degrees.

    Parameters
    ----------
    path : Path                      columns time_s, SC_y_deg, ..., EL_x_deg

    Returns
    -------
    Motion                           angles without full turns that most frames have

    Raises
    ------
    DataError                        missing column or number, time that does not increase, or
                                     angles that cannot be degrees; names file, row and column
    """
    table = read_numbers(path, (TIME_COLUMN, *ANGLE_COLUMNS))
    _check_time(path, table[:, 0])
    _check_degrees(path, table[:, 1:])
    return Motion(table[:, 0], without_turns(np.deg2rad(table[:, 1:])))


def without_turns(angles: Array) -> Array:
    """Joint angles (T, 10) [rad] without the full turns that most frames of a recording have."""
    return angles - 2.0 * np.pi * np.round(np.median(angles, axis=0) / (2.0 * np.pi))


def resampled(motion: Motion, time_s: Array) -> Array:
    """Joint angles (N, 10) [rad] at other times (N,): cubic splines of the quaternions.

    Euler angles jump at gimbal lock and at +-180 degrees, and may not be interpolated. Of all
    angles that are the same pose, those nearest to the first recorded ones are taken.
    """
    pose = unit_pose(CubicSpline(motion.time_s, trial_to_pose(motion.angles_rad))(time_s))
    return continuous_angles(pose_to_trial(pose), motion.angles_rad[0])


def _check_time(path: Path, time: Array) -> None:
    if len(time) < FEWEST_FRAMES:
        raise DataError(f"{path}: {len(time)} frames; a motion needs at least {FEWEST_FRAMES}.")
    check_increasing(path, TIME_COLUMN, time)


def _check_degrees(path: Path, angles: Array) -> None:
    # Radians stay within one turn, 2 pi. In degrees that would mean all joints within 6.3 deg of
    # zero, scapula parallel to clavicle included, where no shoulder can be (AC_y is 33 to 69 deg).
    if np.abs(angles).max() <= 2.0 * np.pi:
        raise DataError(
            f"{path}: all angles are within +-{np.abs(angles).max():.2f}, so these are radians; "
            "expected degrees. Multiply the angle columns by 180/pi."
        )
    beyond = np.argwhere(np.abs(angles) > 360.0)
    if beyond.size:
        i, k = beyond[0]
        raise DataError(
            f"{path}, row {i + 2}, column {ANGLE_COLUMNS[k]}: {angles[i, k]} deg is beyond one "
            "turn. Check the unit, or subtract full turns."
        )
