"""A stiff or loose glenohumeral capsule."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Body, Effect, Param, Setup
from scapulohumeral.model.rotations import (
    Array,
    euler_to_quaternion,
    matrix_to_quaternion,
    quaternion_to_euler,
    quaternion_to_matrix,
)

GH = 2
ELEVATION = 1
PARAMS = (
    Param(
        "stiffness_factor",
        "1",
        1.0,
        0.0,
        20.0,
        5.0,
        4.0,
        "ASSUME: up to 20 N m/rad, against 1 in DAS3, is a passive torque of 10 N m at half a "
        "radian",
    ),
    Param(
        "engagement_deg",
        "deg",
        0.0,
        -40.0,
        40.0,
        20.0,
        20.0,
        "ASSUME: a third of the range; moves the pose without torque",
    ),
)


@dataclass(frozen=True)
class PassiveGh(Effect):
    """Stiffness of the glenohumeral spring times a factor, about a shifted elevation."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale the spring and move the pose without torque."""
        factor, engagement = values
        stiffness = body.parameters["joint_stiffness"].copy()
        stiffness[GH] *= factor
        rest = body.parameters["rest_GH"].reshape(3, 3)
        angles = quaternion_to_euler(matrix_to_quaternion(rest), "YZY")
        angles[ELEVATION] += np.deg2rad(engagement)
        turned = quaternion_to_matrix(euler_to_quaternion(angles, "YZY")).ravel()
        changed = {"joint_stiffness": stiffness, "rest_GH": turned}
        return replace(body, parameters={**body.parameters, **changed})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        PassiveGh(
            "body", "passive_gh", None, PARAMS, KINEMATICS, ("strength_loss", "joint_damping"),
            "passive trial to the end of range",
        ),
    )  # fmt: skip
