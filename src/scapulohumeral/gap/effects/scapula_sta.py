"""Skin that slides over the scapula when the arm is lifted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.frames import elevation, turn_frame
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array

# Skin-based sensors hold to the bone below 60 deg; from there the error sets in without a kink and
# soon grows in proportion. Amplitudes hold at 120 deg.
ONSET_RAD, PROPORTIONAL_RAD, FULL_RAD = np.deg2rad([60.0, 75.0, 120.0])
# Scapula axes: x lateral along the spine, y up, z back. Turns follow one another in the order of
# the recommendation for the scapula (Wu et al. 2005, J Biomech 38: 981-992): internal rotation
# about y, upward rotation about z, posterior tilt about x.
SEQUENCE = "YZX"
NAMES = ("upward_deg", "tilt_deg", "internal_deg")
IN_SEQUENCE = [NAMES.index(name) for name in ("internal_deg", "upward_deg", "tilt_deg")]
SOURCE = (
    "skin-based errors grow above 120 deg (Karduna et al. 2001, J Biomech Eng 123: 184-190); "
    "ASSUME: 45 deg at worst"
)
PARAMS = tuple(Param(name, "deg", 0.0, -45.0, 45.0, 10.0, 8.0, SOURCE) for name in NAMES)


@dataclass(frozen=True)
class ScapulaSta(Effect):
    """Turns of the recorded scapula that grow with elevation; the values hold at 120 deg.

    `tilt_deg` is posterior tilt, `internal_deg` internal rotation.
    """

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Turn the scapula by the share that the elevation of the arm asks for."""
        share = sliding(elevation(observed.pose)) / sliding(FULL_RAD)
        turns = share[:, None] * np.asarray(values)[IN_SEQUENCE]
        vectors = Rotation.from_euler(SEQUENCE, turns, degrees=True).as_rotvec()
        return replace(observed, pose=turn_frame(observed.pose, "scapula", vectors))


def sliding(elevation_rad: Array) -> Array:
    """Growth of the error with elevation: none, a parabola, and its tangent from there [rad]."""
    bend = PROPORTIONAL_RAD - ONSET_RAD
    lifted = np.clip(elevation_rad - ONSET_RAD, 0.0, None)
    return np.where(lifted < bend, lifted**2 / (2.0 * bend), lifted - 0.5 * bend)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family; none of a scapula that nobody measured."""
    if "scapula" in setup.unmeasured:
        return ()
    return (
        ScapulaSta(
            "measurement", "scapula_sta", None, PARAMS, KINEMATICS,
            ("thorax_surface", "strength_loss", "frame_misalignment"),
            "passive elevation to the same posture",
        ),
    )  # fmt: skip
