"""A person who moves and drives muscles more, or less, smoothly than the model."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.gap.effects.cost_weight import WEIGHT
from scapulohumeral.model.rotations import Array


@dataclass(frozen=True)
class RateWeight(Effect):
    """Weights of the rates of speeds and excitations in the cost times a factor."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale them."""
        return replace(body, rates=values[0] * body.rates)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        RateWeight(
            "control", "rate_weight", None, (WEIGHT,), KINEMATICS, ("joint_damping", "emd"),
            "the same movement at several speeds",
        ),
    )  # fmt: skip
