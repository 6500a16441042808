"""Electromechanical delay: envelopes that lead the force by longer than the model's."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.gap.effects.base import EMG, Effect, Param, Setup
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "delay_ms",
        "ms",
        0.0,
        0.0,
        120.0,
        60.0,
        40.0,
        "10 to 100 ms (Cavanagh and Komi 1979, Eur J Appl Physiol 42: 159-163), with filter "
        "delays up to 120",
    ),
)


@dataclass(frozen=True)
class Emd(Effect):
    """All envelopes earlier by a delay, in seconds and not in phase."""

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Shift the envelopes, which go on along their last slope after the end."""
        if observed.emg is None:
            return observed
        time = np.linspace(0.0, observed.duration_s, len(observed.emg))
        curve = CubicSpline(time, observed.emg)
        # One slope beyond the ends, so that the derivative at no delay has two sides.
        shifted = time + values[0] / 1000.0
        inside = np.clip(shifted, 0.0, observed.duration_s)
        emg = curve(inside) + (shifted - inside)[:, None] * curve(inside, 1)
        return replace(observed, emg=emg)


def members(setup: Setup) -> tuple[Effect, ...]:
    """The one member of the family."""
    return (
        Emd(
            "measurement", "emd", None, PARAMS, EMG, ("tendon_compliance", "joint_damping"),
            "the same movement fast and slow",
        ),
    )  # fmt: skip
