"""Ribs under the scapula that are harder or softer than the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

PARAMS = (
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
    """Stiffness of the scapulothoracic contact times a factor."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale it."""
        stiffness = values[0] * body.parameters["contact_stiffness"]
        return replace(body, parameters={**body.parameters, "contact_stiffness": stiffness})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        StContact(
            "body", "st_contact", None, PARAMS, KINEMATICS,
            ("thorax_surface", "scapula_sta", "strength_loss"),
            "isometric push in the same posture",
        ),
    )  # fmt: skip
