"""A stiff glenohumeral capsule."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

GH = slice(6, 9)
# Torque (factor - 1) TORQUE_NM (exp(RATE_PER_RAD excess) - 1): passive moments of joints grow
# exponentially toward the end of their range (Engin and Chen 1986, J Biomech 19: 215-221).
TORQUE_NM = 0.3
RATE_PER_RAD = 4.0
# The excess begins smoothly over this angle, so that its onset can be fitted.
SMOOTH_RAD = 0.1
PARAMS = (
    Param(
        "stiffness_factor",
        "1",
        1.0,
        1.0,
        40.0,
        5.0,
        6.0,
        "ASSUME: at 5, a torque of 7 N m half a radian beyond the onset, a fifth of what abductors "
        "can do",
    ),
    Param(
        "engagement_deg",
        "deg",
        40.0,
        0.0,
        90.0,
        50.0,
        15.0,
        "ASSUME: capsules engage in the middle of the range of glenohumeral elevation",
    ),
)


@dataclass(frozen=True)
class PassiveGh(Effect):
    """Torque against elevation of the humerus in the glenoid, beyond an onset.

    Quasi-static: the elevation is that of the nominal solution, which is tracked closely, so the
    equations keep their form.
    """

    def apply(self, body: Body, values: Array) -> Body:
        """Add the torque to those on the speeds of the joint."""
        factor, engagement = values
        beyond = body.gh_elevation_rad - np.deg2rad(engagement)
        excess = 0.5 * (beyond + np.hypot(beyond, SMOOTH_RAD))
        torque = (factor - 1.0) * TORQUE_NM * np.expm1(RATE_PER_RAD * excess)
        external = body.external_Nm.copy()
        external[:, GH] -= torque[:, None] * body.gh_lift
        return replace(body, external_Nm=external)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        PassiveGh(
            "body", "passive_gh", None, PARAMS, KINEMATICS, ("strength_loss", "joint_damping"),
            "passive trial to the end of range",
        ),
    )  # fmt: skip
