"""A mass in the hand that the model does not know of."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "mass_kg",
        "kg",
        0.0,
        0.0,
        5.0,
        1.0,
        1.5,
        "ASSUME: objects of daily tasks, a full shopping bag at most",
    ),
    Param(
        "offset_m",
        "m",
        0.0,
        -0.05,
        0.15,
        0.05,
        0.05,
        "ASSUME: held between wrist and one hand length beyond the hand's mass centre",
    ),
)


@dataclass(frozen=True)
class HandLoad(Effect):
    """A point mass on the axis of the forearm, near the hand's mass centre."""

    def apply(self, body: Body, values: Array) -> Body:
        """Add the mass and move it along the forearm."""
        mass, offset = values
        centre = body.parameters["com_load"]
        changed = {
            "mass_load": body.parameters["mass_load"] + mass,
            "com_load": centre * (1.0 + offset / np.linalg.norm(centre)),
        }
        return replace(body, parameters={**body.parameters, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        HandLoad(
            "body", "hand_load", None, PARAMS, KINEMATICS,
            ("segment_mass", "external_force", "strength_loss"),
            "static holds with the elbow at 0 and 90 deg; a fast trial",
        ),
    )  # fmt: skip
