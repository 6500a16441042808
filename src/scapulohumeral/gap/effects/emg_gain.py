"""EMG normalised by a maximum that was too small or too large."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import EMG, Effect, Param, Setup
from scapulohumeral.gap.effects.body import ALL
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "gain_factor",
        "1",
        1.0,
        0.3,
        3.0,
        1.6,
        0.5,
        "normalised EMG up to threefold by the choice of contraction (Burden 2010, J "
        "Electromyogr Kinesiol 20: 1023-1035)",
        "log",
    ),
)


@dataclass(frozen=True)
class EmgGain(Effect):
    """One channel, or all of them, times a factor."""

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Scale the channels; without EMG nothing changes."""
        if observed.emg is None:
            return observed
        chosen = np.array([self.member in (name, ALL) for name in observed.channels])
        return replace(observed, emg=observed.emg * np.where(chosen, values[0], 1.0))


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every channel, and all together if there are several."""
    return tuple(
        EmgGain(
            "measurement", "emg_gain", name, PARAMS, EMG,
            ("strength_loss", "co_contraction", "electrode_shift"),
            "maximal contractions again, with the same electrodes",
        )
        for name in (*setup.channels, *([ALL] if len(setup.channels) > 1 else []))
    )  # fmt: skip
