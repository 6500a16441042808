"""Muscles that are weaker than the model's: tear, palsy, atrophy."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import ALL, CUFF, OF_CUFF, Body
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
    Param(
        "fibres_left",
        "1",
        1.0,
        0.1,
        1.0,
        0.7,
        0.6,
        "ASSUME: as the loss of force, which may be one of fibres or of the force of each",
        "log",
    ),
)


@dataclass(frozen=True)
class StrengthLoss(Effect):
    """Maximal isometric force of a group times a factor, by weaker fibres or by fewer of them.

    Fibres that are gone are silent and cost no effort: a share g of the fibres, active by a, has
    the effort g a^2 and shows g a on electrodes. That is a muscle with the activation
    b = sqrt(g) a at most sqrt(g), the effort b^2, 1 / sqrt(g) times the active force and sqrt(g) b
    on electrodes. What is left of the fibres is no stronger than it was.
    """

    order: ClassVar[tuple[tuple[int, int], ...]] = ((0, 1),)

    def apply(self, body: Body, values: Array) -> Body:
        """Scale active and passive force alike: fibres are missing or thinner, not shorter."""
        factor, left = values
        chosen = body.chosen(self.member)
        share = np.where(chosen, np.sqrt(left), 1.0)
        muscles = replace(
            body.muscles,
            max_isometric_force=body.muscles.max_isometric_force * np.where(chosen, factor, 1.0),
            capacity=body.muscles.capacity / share,
        )
        return replace(
            body,
            muscles=muscles,
            cap=body.cap * share,
            seen=body.seen * share,
        )


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every group, the torn cuff of arms that have one, and all together."""
    torn = (CUFF,) if set(OF_CUFF) <= set(setup.groups) else ()
    return tuple(
        StrengthLoss(
            "body", "strength_loss", name, PARAMS, KINEMATICS,
            ("emg_gain", "pain_inhibition", "fibre_length", "fatigue"),
            "maximal torque test; measured joint force; a trial near maximal effort",
        )
        for name in (*setup.groups, *torn, ALL)
    )  # fmt: skip
