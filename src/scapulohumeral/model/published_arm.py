"""The arm motion of the published predictions, with the girdle as it was recorded.

A prediction compares with a published one where both follow the same humerus and elbow. Scapula and
clavicle of the published motion are a result, so they enter nothing here: the recorded girdle takes
their place, at the elevation of the arm at which it was recorded.

Letters: N nodes, T frames.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.errors import DataError
from scapulohumeral.model.girdle_range import arm_elevation
from scapulohumeral.model.motion import Motion, read_motion
from scapulohumeral.model.participant import Participant
from scapulohumeral.model.rotations import (
    Array,
    make_continuous,
    pose_to_trial,
    trial_to_pose,
    unit_pose,
    with_girdle,
)

# The authors' mesh [s], and their composite motion: three elevations of 101 rows with 40 rows
# between them, 383 rows splined to 268 nodes (merge_motions.m). First node of each elevation and
# the one after its last; and of the windows in which they measure rhythm (plot_results.m).
NODE_S = 0.04
PUBLISHED_PLANES = {"frontal": (0, 70), "scapular": (99, 169), "sagittal": (197, 268)}
PUBLISHED_RISES = {"frontal": (0, 41), "scapular": (100, 135), "sagittal": (203, 236)}
PUBLISHED_NODES = 268
JOINTS = (slice(0, 4), slice(4, 8), slice(8, 12))


def published_pose(motion: Motion, step: float = NODE_S) -> Array:
    """Poses (268, 13) of a published prediction at the nodes of its mesh.

    Raises
    ------
    DataError                        another mesh interval, or a motion of another length
    """
    time_s = NODE_S * np.arange(PUBLISHED_NODES)
    if abs(step - NODE_S) > 1e-9:
        raise DataError(
            f"mesh interval {step} s: the published composite motion has {NODE_S} s; set "
            "solve.time_step_s to it"
        )
    if abs(motion.time_s[-1] - time_s[-1]) > 1e-6:
        raise DataError(
            f"published composite motion of {motion.time_s[-1]:.2f} s: expected {time_s[-1]:.2f} s"
        )
    pose = trial_to_pose(motion.angles_rad)
    for joint in JOINTS:
        pose[:, joint] = make_continuous(pose[:, joint])
    return unit_pose(CubicSpline(motion.time_s, pose)(time_s))


def published_on_recorded_girdle(published: Array, recorded: Mapping[str, Array]) -> Array:
    """The arm of a published prediction on the recorded girdle, poses (268, 13).

    While the arm rises or sinks, the girdle is that of the recording at the same elevation, or at
    its peak where the published arm goes higher. In the pauses it changes evenly.

    Parameters
    ----------
    published : (268, 13) of :func:`published_pose`
    recorded : poses (T, 13) of the recorded elevations by plane

    Raises
    ------
    DataError                        a plane of the published motion was not recorded
    """
    elevation = _elevation(published)
    nodes, girdle = [], []
    for plane, (first, stop) in PUBLISHED_PLANES.items():
        if plane not in recorded:
            raise DataError(
                f"the published composite motion has a {plane} elevation, which is not among the "
                f"recorded ones ({', '.join(recorded)}): add it to 'planes'"
            )
        nodes.append(np.arange(first, stop))
        girdle.append(_at_elevation(recorded[plane], elevation[first:stop]))
    return with_girdle(published, np.concatenate(nodes), np.concatenate(girdle))


def followed_poses(participant: Participant, condition: str = "healthy") -> Array:
    """Poses (268, 13) of a participant's published arm on its own recorded girdle."""
    motion = read_motion(participant.predictions[condition])
    girdles = {
        plane: trial_to_pose(participant.trial(plane).motion.angles_rad)
        for plane in PUBLISHED_PLANES
    }
    return published_on_recorded_girdle(published_pose(motion), girdles)


def _elevation(pose: Array) -> Array:
    """Elevation of the arm in the thorax, (T,) [rad]."""
    return arm_elevation(pose_to_trial(pose))


def _at_elevation(recorded: Array, elevation: Array) -> Array:
    """Girdle (N, 8) of a recording at elevations (N,) [rad] of another rise and descent."""
    girdle = recorded[:, :8].copy()
    for joint in JOINTS[:2]:
        girdle[:, joint] = make_continuous(girdle[:, joint])
    own = _elevation(recorded)
    own_peak, peak = int(np.argmax(own)), int(np.argmax(elevation))
    rise = np.maximum.accumulate(own[: own_peak + 1])
    descent = np.maximum.accumulate(own[own_peak:][::-1])
    halves = (
        (elevation[: peak + 1], rise, girdle[: own_peak + 1]),
        (elevation[peak + 1 :], descent, girdle[own_peak:][::-1]),
    )
    return np.concatenate(
        [
            np.stack([np.interp(levels, known, column) for column in part.T], axis=1)
            for levels, known, part in halves
        ]
    )
