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
FEWEST_FRAMES = 4


@dataclass(frozen=True, eq=False)
class Motion:
    """Joint angles over time: `time_s` (T,), `angles_rad` (T, 10)."""

    time_s: Array
    angles_rad: Array


def read_motion(path: Path) -> Motion:
    """Joint angles over time from a table in degrees.

    Parameters
    ----------
    path : Path                      columns time_s, SC_y_deg, ..., EL_x_deg

    Raises
    ------
    DataError                        missing column or number, time that does not increase, or
                                     angles that cannot be degrees; names file, row and column
    """
    table = read_numbers(path, (TIME_COLUMN, *ANGLE_COLUMNS))
    _check_time(path, table[:, 0])
    _check_degrees(path, table[:, 1:])
    return Motion(table[:, 0], np.deg2rad(table[:, 1:]))


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
