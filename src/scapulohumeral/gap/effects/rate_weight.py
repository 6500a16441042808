"""A person who moves and drives muscles more, or less, smoothly than the model."""

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
class RateWeight(Effect):
    """Weights of the rates of speeds and excitations in the cost times a factor."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale them."""
        return replace(body, rates=values[0] * body.rates)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        RateWeight(
            "control", "rate_weight", None, PARAMS, KINEMATICS, ("joint_damping", "emd"),
            "the same movement at several speeds",
        ),
    )  # fmt: skip
