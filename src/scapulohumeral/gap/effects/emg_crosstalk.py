"""Electrodes that also hear the muscle beside them."""

from __future__ import annotations

from dataclasses import dataclass, replace

from scapulohumeral.gap.effects.base import EMG, Effect, Param, Setup
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array

PARAMS = (
    Param(
        "fraction",
        "1",
        0.0,
        0.0,
        0.5,
        0.25,
        0.2,
        "5 % in lean people (Solomonow et al. 1994, J Electromyogr Kinesiol 4: 131-142), more "
        "through fat (Kuiken et al. 2003, Prosthet Orthot Int 27: 48-54)",
    ),
)


@dataclass(frozen=True)
class EmgCrosstalk(Effect):
    """A share of the donor's envelope in the receiver; member ``DONOR>RECEIVER``."""

    def observe(self, observed: Observation, values: Array) -> Observation:
        """Add the donor; without EMG nothing changes."""
        if observed.emg is None:
            return observed
        donor, receiver = (observed.channels.index(name) for name in str(self.member).split(">"))
        emg = observed.emg.copy()
        emg[:, receiver] += values[0] * observed.emg[:, donor]
        return replace(observed, emg=emg)


def members(setup: Setup) -> tuple[Effect, ...]:
    """Both directions of every declared pair of recorded channels."""
    pairs = [pair for pair in setup.neighbours if set(pair) <= set(setup.channels)]
    return tuple(
        EmgCrosstalk(
            "measurement", "emg_crosstalk", f"{donor}>{receiver}", PARAMS, EMG, ("emg_gain",),
            "a trial in which only the donor is active",
        )
        for pair in pairs
        for donor, receiver in (pair, pair[::-1])
    )  # fmt: skip
