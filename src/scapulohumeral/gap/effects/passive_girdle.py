"""Ligaments and fasciae that carry clavicle and scapula more, or less, than the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import JOINTS, Body
from scapulohumeral.model.rotations import Array

GIRDLE = np.isin(JOINTS, ("SC", "AC"))
PARAMS = (
    Param(
        "stiffness_factor",
        "1",
        1.0,
        0.1,
        10.0,
        2.0,
        0.7,
        "ASSUME: DAS3 gives every joint 1 N m/rad without a measurement",
        "log",
    ),
    Param(
        "end_torque_Nm",
        "N m",
        0.0,
        0.0,
        5.0,
        1.0,
        1.0,
        "the law of Engin and Chen 1986 (J Biomech 19: 215-221), torque at 0.6 rad; ASSUME: a "
        "tenth of what the muscles of the girdle can do at most",
    ),
)


@dataclass(frozen=True)
class PassiveGirdle(Effect):
    """Linear springs of SC and AC times a factor, and springs that stiffen with their turn."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale the ones, add the others."""
        factor, torque = values
        p = body.parameters
        changed = {
            "joint_stiffness": p["joint_stiffness"] * np.where(GIRDLE, factor, 1.0),
            "spring_torque": p["spring_torque"] + np.where(GIRDLE, torque, 0.0),
        }
        return replace(body, parameters={**p, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        PassiveGirdle(
            "body", "passive_girdle", None, PARAMS, KINEMATICS,
            ("segment_mass", "thorax_surface", "strength_loss"),
            "the shoulder moved passively, muscles silent",
        ),
    )  # fmt: skip
