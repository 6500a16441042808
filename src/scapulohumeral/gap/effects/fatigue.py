"""Muscles that tire while they move."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import KINEMATICS, Effect, Param, Setup
from scapulohumeral.gap.effects.body import ALL, Body
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "end_force_factor",
        "1",
        1.0,
        0.3,
        1.0,
        0.7,
        0.3,
        "ASSUME: exhausting contractions end at about half of the maximal force; one movement "
        "rarely costs more",
        "log",
    ),
)


@dataclass(frozen=True)
class Fatigue(Effect):
    """Active force of a group that falls evenly over the movement, to a factor at its end.

    It covers what grows within the movements that are averaged. Force that is lost already when
    they start is a loss of strength; what grows from repeat to repeat only widens their scatter,
    because effects act on the mean record; slower fibres and the EMG of a tired muscle at equal
    activation are left out.
    """

    def apply(self, body: Body, values: Array) -> Body:
        """Lower the active force over the movement, (I, M); passive fibres do not tire."""
        intervals = len(body.external_Nm)
        phase = (np.arange(intervals) + 0.5) / intervals
        left = 1.0 + phase[:, None] * (values[0] - 1.0)
        tiring = np.where(body.chosen(self.member), left, 1.0)
        muscles = replace(body.muscles, capacity=body.muscles.capacity * tiring)
        return replace(body, muscles=muscles)


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every group, and all together."""
    return tuple(
        Fatigue(
            "body", "fatigue", name, PARAMS, KINEMATICS,
            ("strength_loss", "electrode_shift", "pain_inhibition"),
            "the same movement backward, or after rest",
        )
        for name in (*setup.groups, ALL)
    )  # fmt: skip
