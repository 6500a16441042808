"""Skin that slides over the muscle with its electrode when the arm is lifted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.effects.base import EMG, Effect, Param, Setup
from scapulohumeral.gap.effects.frames import elevation
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array

# Elevation at which the amplitude of the slope holds.
FULL_RAD = np.deg2rad(120.0)
SOURCE = (
    "amplitudes differ between places on one muscle (Jensen and Westgaard 1997, Eur J Appl "
    "Physiol 76: 335-339); ASSUME: by a factor of two, of four at worst"
)
PARAMS = (
    Param("slope_factor", "1", 1.0, 0.25, 4.0, 1.7, 0.4, SOURCE, "log"),
    Param("gain_factor", "1", 1.0, 0.3, 3.0, 1.3, 0.3, SOURCE, "log"),
)


@dataclass(frozen=True)
class ElectrodeShift(Effect):
    """A gain of one channel with the arm hanging, and another one that grows with elevation.

    `slope_factor` is the gain at 120 deg of elevation over that with the arm hanging.
    """

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Scale the channel; without EMG nothing changes."""
        if observed.emg is None:
            return observed
        slope, gain = values
        emg = observed.emg.copy()
        channel = observed.channels.index(str(self.member))
        emg[:, channel] *= gain * slope ** (elevation(observed.pose) / FULL_RAD)
        return replace(observed, emg=emg)


def members(setup: Setup) -> tuple[Effect, ...]:
    """Every channel."""
    return tuple(
        ElectrodeShift(
            "measurement", "electrode_shift", name, PARAMS, EMG,
            ("emg_gain", "strength_loss", "fatigue"),
            "holds of one effort with the arm low and high",
        )
        for name in setup.channels
    )  # fmt: skip
