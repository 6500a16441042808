"""Muscles that are weaker than the model's: tear, palsy, atrophy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from scapulohumeral.gap.effects.base import ALL, KINEMATICS, Body, Effect, Param, Setup
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "f0_factor",
        "1",
        1.0,
        0.1,
        1.0,
        0.5,
        0.6,
        "calibrated strength 50 to 250 % (PMC3399054); wider, because palsy and massive tears "
        "leave less",
        "log",
    ),
)


@dataclass(frozen=True)
class StrengthLoss(Effect):
    """Maximal isometric force of a group times a factor."""

    changes_muscle: ClassVar[bool] = True

    def apply(self, body: Body, values: Array) -> Body:
        """Scale active and passive force alike: fibres are missing, not shorter."""
        factor = np.where(body.chosen(self.member), values[0], 1.0)
        force = body.muscles.max_isometric_force * factor
        return replace(body, muscles=replace(body.muscles, max_isometric_force=force))


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every group, and all together."""
    return tuple(
        StrengthLoss(
            "body", "strength_loss", name, PARAMS, KINEMATICS,
            ("emg_gain", "pain_inhibition", "fibre_length"),
            "maximal torque test; measured joint force; a trial near maximal effort",
        )
        for name in (*setup.groups, ALL)
    )  # fmt: skip
