"""A serratus anterior that turns the scapula on longer or shorter arms than the model's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

SERRATUS = "serr_ant"
PARAMS = (
    Param(
        "arm_factor",
        "1",
        1.0,
        0.5,
        2.0,
        1.3,
        0.25,
        "ASSUME: its digitations are a few lines over a wrapped thorax; models differ by tens of "
        "percent in their arms",
        "log",
    ),
)


@dataclass(frozen=True)
class SerratusPath(Effect):
    """Moment arms of serratus anterior times a factor, its length and speed unchanged.

    Quasi-static: what the factor adds is taken at the nominal tension, so that of a large factor
    the part by which the tension itself changes is missing.
    """

    def apply(self, body: Body, values: Array) -> Body:
        """Add what longer arms make of the tension."""
        chosen = body.chosen(SERRATUS)
        return body.loaded((values[0] - 1.0) * np.sum(body.pull[:, :, chosen], axis=2))


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family, where there is such a muscle."""
    if SERRATUS not in setup.groups:
        return ()
    return (
        SerratusPath(
            "body", "serratus_path", None, PARAMS, KINEMATICS,
            ("strength_loss", "thorax_surface", "passive_girdle"),
            "EMG of serratus anterior at known loads",
        ),
    )  # fmt: skip
