"""Muscles across a joint, or of the whole arm, that never rest."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import ALL, JOINTS, Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "tonic_floor",
        "1",
        0.0,
        0.0,
        0.2,
        0.08,
        0.06,
        "ASSUME: a fifth of the maximum all the time cannot be kept up",
    ),
)


@dataclass(frozen=True)
class CoContraction(Effect):
    """Lower bound of the activations of all muscles that cross a joint, or any joint.

    Who stiffens on purpose or by fear tenses the arm, not a joint.
    """

    def apply(self, body: Body, values: Array) -> Body:
        """Raise the bound."""
        joints = JOINTS if self.member == ALL else (str(self.member),)
        crossing = body.crossing[:, [JOINTS.index(name) for name in joints]].any(axis=1)
        return replace(body, floor=body.floor + np.where(crossing, values[0], 0.0))


def members(setup: Setup) -> tuple[Effect, ...]:
    """The four joints, and all of them."""
    return tuple(
        CoContraction(
            "control", "co_contraction", name, PARAMS, KINEMATICS, ("emg_gain", "passive_gh"),
            "measured joint force: larger at the same torque",
        )
        for name in (*JOINTS, ALL)
    )  # fmt: skip
