"""Segment frames that were digitised askew."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array

SOURCE = (
    "palpated landmarks move frames by 2 to 5 deg, wrong landmarks by up to 15 (de Groot 1997, "
    "Clin Biomech 12: 461-472)"
)
SEGMENTS = ("thorax", "scapula", "humerus")
PARAMS = tuple(Param(f"r{axis}_deg", "deg", 0.0, -15.0, 15.0, 6.0, 5.0, SOURCE) for axis in "xyz")


@dataclass(frozen=True)
class FrameMisalignment(Effect):
    """Constant rotation of a recorded segment frame about its own axes."""

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Turn the frame."""
        pose = turn_frame(observed.pose, str(self.member), np.deg2rad(values))
        return replace(observed, pose=pose)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The segments that markers define, of three at most."""
    return tuple(
        FrameMisalignment(
            "input", "frame_misalignment", name, PARAMS, KINEMATICS, ("thorax_tilt",),
            "a trial about a functional axis; a second plane",
        )
        for name in SEGMENTS
        if name not in setup.unmeasured
    )  # fmt: skip
