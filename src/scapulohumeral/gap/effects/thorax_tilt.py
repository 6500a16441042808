"""A trunk that leans while the model's stands upright."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import (
    Array,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)

SOURCE = "ASSUME: trunk inclination between sitting slumped and upright, about 20 deg"
PARAMS = (
    Param("forward_deg", "deg", 0.0, -20.0, 20.0, 12.0, 8.0, SOURCE),
    Param("lateral_deg", "deg", 0.0, -20.0, 20.0, 8.0, 6.0, SOURCE),
)


@dataclass(frozen=True)
class ThoraxTilt(Effect):
    """Gravity turns in the thorax frame (x right, y up, z back); right is positive lateral."""

    def apply(self, body: Body, values: Array) -> Body:
        """Turn gravity against the lean of the trunk."""
        forward, lateral = np.deg2rad(values)
        turn = quaternion_to_matrix(rotation_vector_to_quaternion([forward, 0.0, lateral]))
        gravity = turn @ body.parameters["gravity"]
        return replace(body, parameters={**body.parameters, "gravity": gravity})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        ThoraxTilt(
            "input", "thorax_tilt", None, PARAMS, KINEMATICS,
            ("segment_mass", "hand_load", "external_force"),
            "the same movement in a second plane",
        ),
    )  # fmt: skip
