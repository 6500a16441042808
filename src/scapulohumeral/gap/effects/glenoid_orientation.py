"""A glenoid that faces another way than the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

SOURCE = "spread over 172 shoulder pairs (Churchill et al. 2001, JSES 10: 327-332)"
PARAMS = (
    Param("version_deg", "deg", 0.0, -15.0, 15.0, 10.0, 7.0, SOURCE),
    Param("inclination_deg", "deg", 0.0, -15.0, 15.0, 8.0, 6.0, SOURCE),
)


@dataclass(frozen=True)
class GlenoidOrientation(Effect):
    """Rotation of the cone in which the cost keeps the joint force."""

    def apply(self, body: Body, values: Array) -> Body:
        """Turn the glenoid."""
        version, inclination = np.deg2rad(values)
        turned = body.glenoid_rad + np.array([inclination, version])
        return replace(body, glenoid_rad=turned)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        GlenoidOrientation(
            "body", "glenoid_orientation", None, PARAMS, KINEMATICS, ("strength_loss",),
            "direction of the measured joint force",
        ),
    )  # fmt: skip
