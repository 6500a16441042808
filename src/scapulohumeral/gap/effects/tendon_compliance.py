"""Tendons that stretch, where the model's are rigid."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import ALL, Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "strain_at_f0",
        "1",
        0.0,
        0.0,
        0.10,
        0.05,
        0.04,
        "3.3 % in Hill models (Zajac 1989, Crit Rev Biomed Eng 17: 359-411); ASSUME at most "
        "threefold",
    ),
)


@dataclass(frozen=True)
class TendonCompliance(Effect):
    """Slack length grows with the tension of the nominal movement.

    Quasi-static: the speed of stretching is left out, and the tension is that of the nominal
    solution, so the fibre sees a schedule and the equations keep their form.
    """

    def apply(self, body: Body, values: Array) -> Body:
        """Lengthen the tendons over the movement, (I, M)."""
        strain = values[0] * np.where(body.chosen(self.member), body.tendon_load, 0.0)
        slack = body.muscles.tendon_slack_length * (1.0 + strain)
        return replace(body, muscles=replace(body.muscles, tendon_slack_length=slack))


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every group, and all together."""
    return tuple(
        TendonCompliance(
            "body", "tendon_compliance", name, PARAMS, KINEMATICS, ("fibre_length", "emd"),
            "the same movement fast and slow",
        )
        for name in (*setup.groups, ALL)
    )  # fmt: skip
