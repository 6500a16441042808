"""A person to whom the place of the humeral head matters more, or less, than to the model."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "weight_factor",
        "1",
        1.0,
        0.05,
        20.0,
        3.0,
        1.0,
        "ASSUME: weights of a cost are tuned, not measured: known to an order of magnitude",
        "log",
    ),
)


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
            "control", "stability_weight", None, PARAMS, KINEMATICS,
            ("glenoid_orientation", "co_contraction"),
            "measured joint force: its direction at the same torque",
        ),
    )  # fmt: skip
