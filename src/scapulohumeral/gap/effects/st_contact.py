"""A thorax under the scapula of another size or stiffness."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "radius_factor",
        "1",
        1.0,
        0.85,
        1.15,
        1.04,
        0.04,
        "ASSUME: thoraces of adults of one size differ by less than 15 %",
        "log",
    ),
    Param(
        "stiffness_factor",
        "1",
        1.0,
        0.2,
        5.0,
        2.0,
        0.5,
        "ASSUME: DAS3 gives 2e4 N/m without a measurement",
        "log",
    ),
)


@dataclass(frozen=True)
class StContact(Effect):
    """Radii of the thorax ellipsoid and stiffness of the contact times factors."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale both."""
        changed = {
            "thorax_radii": values[0] * body.parameters["thorax_radii"],
            "contact_stiffness": values[1] * body.parameters["contact_stiffness"],
        }
        return replace(body, parameters={**body.parameters, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        StContact(
            "body", "st_contact", None, PARAMS, KINEMATICS, ("scapula_sta", "strength_loss"),
            "isometric push in the same posture",
        ),
    )  # fmt: skip
