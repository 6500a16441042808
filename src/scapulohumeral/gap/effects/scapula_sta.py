"""Skin that slides over the scapula when the arm is lifted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Observed, Param, Setup
from scapulohumeral.gap.effects.frames import elevation, turn_frame
from scapulohumeral.model.rotations import Array

# Skin-based sensors hold to the bone below 60 deg and part from it to 120 deg and beyond.
ONSET_RAD, FULL_RAD = np.deg2rad([60.0, 120.0])
# Scapula axes: x lateral along the spine, y up, z back.
AXES = {"upward_deg": [0, 0, 1], "tilt_deg": [1, 0, 0], "internal_deg": [0, 1, 0]}
SOURCE = (
    "skin-based errors grow above 120 deg (Karduna et al. 2001, J Biomech Eng 123: 184-190); "
    "ASSUME: 45 deg at worst"
)
PARAMS = tuple(Param(name, "deg", 0.0, -45.0, 45.0, 10.0, 8.0, SOURCE) for name in AXES)


@dataclass(frozen=True)
class ScapulaSta(Effect):
    """Rotation of the recorded scapula that grows with elevation; the values hold at 120 deg.

    `tilt_deg` is posterior tilt, `internal_deg` internal rotation.
    """

    def observe(self, observed: Observed, values: Array) -> Observed:
        """Turn the scapula by the share that the elevation of the arm asks for."""
        share = (elevation(observed.pose) - ONSET_RAD) / (FULL_RAD - ONSET_RAD)
        vector = np.deg2rad(values) @ np.array(list(AXES.values()), dtype=float)
        turns = np.clip(share, 0.0, None)[:, None] * vector
        return replace(observed, pose=turn_frame(observed.pose, "scapula", turns))


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        ScapulaSta(
            "measurement", "scapula_sta", None, PARAMS, KINEMATICS,
            ("st_contact", "strength_loss", "frame_misalignment"),
            "passive elevation to the same posture",
        ),
    )  # fmt: skip
