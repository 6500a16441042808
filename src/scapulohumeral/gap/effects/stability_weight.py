"""A person to whom the place of the humeral head matters more, or less, than to the model."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.gap.effects.cost_weight import WEIGHT
from scapulohumeral.model.rotations import Array


@dataclass(frozen=True)
class StabilityWeight(Effect):
    """Weight of joint stability in the cost times a factor."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale it."""
        return replace(body, stability=values[0] * body.stability)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        StabilityWeight(
            "control", "stability_weight", None, (WEIGHT,), KINEMATICS,
            ("glenoid_orientation", "co_contraction"),
            "measured joint force: its direction at the same torque",
        ),
    )  # fmt: skip
