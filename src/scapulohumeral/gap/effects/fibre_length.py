"""Fibres or tendons of other length than the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.model.rotations import Array

SOURCE = "calibration practice: fibre and slack lengths within 20 % (PMC3399054)"
PARAMS = (
    Param("fibre_factor", "1", 1.0, 0.8, 1.2, 0.9, 0.1, SOURCE, "log"),
    Param("slack_factor", "1", 1.0, 0.8, 1.2, 0.95, 0.05, SOURCE, "log"),
)


@dataclass(frozen=True)
class FibreLength(Effect):
    """Optimal fibre and tendon slack lengths of a group times factors."""

    def apply(self, body: Body, values: Array) -> Body:
        """Scale both lengths."""
        fibre, slack = (np.where(body.chosen(self.member), value, 1.0) for value in values)
        muscles = replace(
            body.muscles,
            optimal_fibre_length=fibre * body.muscles.optimal_fibre_length,
            tendon_slack_length=slack * body.muscles.tendon_slack_length,
        )
        return replace(body, muscles=muscles)


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every group."""
    return tuple(
        FibreLength(
            "body", "fibre_length", name, PARAMS, KINEMATICS, ("strength_loss",),
            "efforts in postures with short and with long fibres",
        )
        for name in setup.groups
    )  # fmt: skip
