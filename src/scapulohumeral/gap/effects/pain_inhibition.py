"""Muscles that are spared although they could pull."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "cost_factor",
        "1",
        1.0,
        1.0,
        10.0,
        4.0,
        1.0,
        "ASSUME: an order of magnitude; no cost is published",
        "log",
    ),
    Param(
        "voluntary_cap",
        "1",
        1.0,
        0.2,
        1.0,
        0.6,
        0.4,
        "ASSUME: as voluntary activation in painful or palsied muscles",
        "log",
    ),
)


@dataclass(frozen=True)
class PainInhibition(Effect):
    """A group whose excitations cost more and cannot exceed a cap."""

    def apply(self, body: Body, values: Array) -> Body:
        """Raise the cost, lower the upper bound."""
        factor, cap = values
        chosen = body.chosen(self.member)
        return replace(
            body,
            effort=body.effort + np.where(chosen, factor - 1.0, 0.0),
            cap=body.cap * np.where(chosen, cap, 1.0),
        )


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every group."""
    return tuple(
        PainInhibition(
            "control", "pain_inhibition", name, PARAMS, KINEMATICS, ("strength_loss",),
            "a light trial (less use even when easy) against a maximal contraction",
        )
        for name in setup.groups
    )  # fmt: skip
