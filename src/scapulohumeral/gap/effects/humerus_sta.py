"""Skin of the upper arm that does not follow its axial rotation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    segment_orientations,
)

# Place of the long axis of the humerus, y, in a quaternion.
LONG_AXIS = 2
PARAMS = (
    Param(
        "lost_share", "1", 0.0, -1.0, 0.8, 0.35, 0.3,
        "a cuff on the upper arm is off by 5 deg in elevation and by nearly 30 deg at the ends of "
        "axial rotation (Hamming et al. 2012, J Biomech 45: 1161-1168); ASSUME: 0.8 at worst; "
        "below 0 the other record is the one that loses it",
    ),
)  # fmt: skip


@dataclass(frozen=True)
class HumerusSta(Effect):
    """Share of the axial rotation of the humerus since the start that is not recorded."""

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Turn the humerus back about its long axis."""
        back = -values[0] * axial_rotation(observed.pose)
        vectors = back[:, None] * np.eye(3)[LONG_AXIS - 1]
        return replace(observed, pose=turn_frame(observed.pose, "humerus", vectors))


def axial_rotation(pose: Array) -> Array:
    """Rotation (N,) [rad] of the humerus about its long axis since the first of poses (N, 13).

    The twist of a swing-twist decomposition: what is left once the axis has swung the shortest way.
    """
    humerus = segment_orientations(pose)["humerus"]
    since = quaternion_multiply(quaternion_conjugate(humerus[:1]), humerus)
    return np.unwrap(2.0 * np.arctan2(since[:, LONG_AXIS], since[:, 0]))


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member, of two records of one movement: sessions of one laboratory lose as much."""
    if not setup.of_one_movement:
        return ()
    return (
        HumerusSta(
            "measurement", "humerus_sta", None, PARAMS, KINEMATICS,
            ("frame_misalignment",),
            "axial rotation at the end of its range",
        ),
    )  # fmt: skip
