"""How far a predicted shoulder girdle is from the recorded one and from healthy people.

Of elevations the rise is compared, at equal elevation of the arm: a prediction on the published arm
rises at another time, and higher, than the recording. Nodes above the recorded peak are left out;
below its lowest elevation the recording counts as it began. Daily tasks are compared at equal time.

Letters: N nodes, T frames.
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from scapulohumeral.quantities.population import (
    INTERNAL_ROTATION,
    POSTERIOR_TILT,
    UPWARD_ROTATION,
    healthy_band,
)
from scapulohumeral.quantities.rhythm import rising_part
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN, thorax_angles

CLAVICLE_ELEVATION = 1


@dataclass(frozen=True)
class RecordingDistance:
    """Distances of one elevation; predicted minus recorded where they have a sign.

    Attributes
    ----------
    ur_rmse_deg, ur_bias_rest_deg : upward rotation over the rise, and mean difference at rest
    tilt_rmse_deg, internal_rotation_rmse_deg, clavicle_elevation_rmse_deg : over the rise
    in_band_share : nodes of the rise with upward rotation in the band of healthy people [1]; not a
        number without a band
    recorded_in_band_share : the same of the recording, at the same nodes [1]: what lies near a
        recording outside the band cannot lie inside
    compared_to_deg : elevation up to which the recording goes
    """

    ur_rmse_deg: float
    ur_bias_rest_deg: float
    tilt_rmse_deg: float
    internal_rotation_rmse_deg: float
    clavicle_elevation_rmse_deg: float
    in_band_share: float
    recorded_in_band_share: float
    compared_to_deg: float


@dataclass(frozen=True)
class TaskDistance:
    """Distances of one daily task over all its nodes; predicted minus recorded if with a sign.

    Attributes
    ----------
    ur_rmse_deg, ur_bias_deg : upward rotation, and its mean difference
    tilt_rmse_deg, internal_rotation_rmse_deg, clavicle_elevation_rmse_deg : see names
    arm_rmse_deg : elevation of the arm, which is followed and not predicted
    ur_recorded_sd_deg : standard deviation of the recorded upward rotation over the task: the error
        of a scapula that keeps the right mean
    """

    ur_rmse_deg: float
    ur_bias_deg: float
    tilt_rmse_deg: float
    internal_rotation_rmse_deg: float
    clavicle_elevation_rmse_deg: float
    arm_rmse_deg: float
    ur_recorded_sd_deg: float


def task_distance(pose: np.ndarray, recorded: np.ndarray) -> TaskDistance:
    """Distance of a predicted daily task from the recorded one, both poses (N, 13) on one mesh."""
    known = thorax_angles(recorded)
    error = thorax_angles(pose) - known
    rmse = np.sqrt(np.mean(error**2, axis=0))
    return TaskDistance(
        ur_rmse_deg=float(rmse[UPWARD_ROTATION]),
        ur_bias_deg=float(error[:, UPWARD_ROTATION].mean()),
        tilt_rmse_deg=float(rmse[POSTERIOR_TILT]),
        internal_rotation_rmse_deg=float(rmse[INTERNAL_ROTATION]),
        clavicle_elevation_rmse_deg=float(rmse[CLAVICLE_ELEVATION]),
        arm_rmse_deg=float(rmse[ELEVATION_COLUMN]),
        ur_recorded_sd_deg=float(known[:, UPWARD_ROTATION].std()),
    )


def recording_distance(
    pose: np.ndarray, recorded: np.ndarray, plane: str, rest_below_deg: float
) -> RecordingDistance:
    """Distance of one predicted elevation, poses (N, 13), from a recorded one, poses (T, 13).

    Not a number where the arm does not rise from below the recorded peak, as in a trial that lowers
    it, and at rest where it is never as low.
    """
    rise, known = _rise(pose), _rise(recorded)
    elevation, peak = rise[:, ELEVATION_COLUMN], known[-1, ELEVATION_COLUMN]
    rise = rise[elevation <= peak]
    elevation = rise[:, ELEVATION_COLUMN]
    if len(rise) < 2:
        return RecordingDistance(*[np.nan] * len(fields(RecordingDistance)))

    def difference(column: int) -> np.ndarray:
        levels = np.maximum.accumulate(known[:, ELEVATION_COLUMN])
        return rise[:, column] - np.interp(elevation, levels, known[:, column])

    def rmse(column: int) -> float:
        return float(np.sqrt(np.mean(difference(column) ** 2)))

    resting, upward = elevation <= rest_below_deg, rise[:, UPWARD_ROTATION]
    return RecordingDistance(
        ur_rmse_deg=rmse(UPWARD_ROTATION),
        ur_bias_rest_deg=(
            float(difference(UPWARD_ROTATION)[resting].mean()) if resting.any() else np.nan
        ),
        tilt_rmse_deg=rmse(POSTERIOR_TILT),
        internal_rotation_rmse_deg=rmse(INTERNAL_ROTATION),
        clavicle_elevation_rmse_deg=rmse(CLAVICLE_ELEVATION),
        in_band_share=_in_band(plane, elevation, upward),
        recorded_in_band_share=_in_band(plane, elevation, upward - difference(UPWARD_ROTATION)),
        compared_to_deg=float(elevation[-1]),
    )


def _rise(pose: np.ndarray) -> np.ndarray:
    """Angles in the thorax, (N, 10) [deg], of the rising part of an elevation."""
    angles = thorax_angles(pose)
    return angles[rising_part(angles[:, ELEVATION_COLUMN])]


def _in_band(plane: str, elevation: np.ndarray, upward: np.ndarray) -> float:
    band = healthy_band(plane, UPWARD_ROTATION, elevation)
    if band is None:
        return np.nan
    known = ~np.isnan(band.low)
    inside = (upward[known] >= band.low[known]) & (upward[known] <= band.high[known])
    return float(inside.mean()) if known.any() else np.nan
