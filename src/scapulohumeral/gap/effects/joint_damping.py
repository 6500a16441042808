"""A joint with more viscous friction than the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import JOINTS, Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "damping_Nms_rad",
        "N m s/rad",
        0.0,
        0.0,
        3.0,
        1.5,
        1.0,
        "ASSUME: in addition to DAS3's 1 N m s/rad, at most threefold that",
    ),
)


@dataclass(frozen=True)
class JointDamping(Effect):
    """Additional viscous damping of one joint."""

    def apply(self, body: Body, values: Array) -> Body:
        """Add the damping."""
        extra = values[0] * (np.array(JOINTS) == self.member)
        damping = body.parameters["joint_damping"] + extra
        return replace(body, parameters={**body.parameters, "joint_damping": damping})


def members(setup: Setup) -> tuple[Effect, ...]:
    """The four joints."""
    return tuple(
        JointDamping(
            "body", "joint_damping", name, PARAMS, KINEMATICS, ("tendon_compliance", "emd"),
            "the same movement at several speeds",
        )
        for name in JOINTS
    )  # fmt: skip
