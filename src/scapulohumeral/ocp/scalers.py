"""Scalers of muscle parameters as unknowns of the optimal control problem (paper, calibration).

Each group of muscle elements has two: s_F multiplies the maximal isometric force and s_l the
optimal fibre length of all its elements; tendon slack lengths stay. Arrays of scalers have shape
(2, G), forces first.

Letters: M muscles, G groups.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.errors import ConfigError


@dataclass(frozen=True, eq=False)
class Scalers:
    """Groups of muscle elements whose parameters are unknown.

    Attributes
    ----------
    names : (G,) groups; members : (G, M) bool, their elements, each in one group at most
    force_bounds, fibre_bounds : bounds of s_F and s_l [1] (own: the paper has none)
    """

    names: tuple[str, ...]
    members: np.ndarray
    force_bounds: tuple[float, float] = (0.5, 1.5)
    fibre_bounds: tuple[float, float] = (0.7, 1.3)

    def __post_init__(self) -> None:
        """Refuse groups that cannot be told apart, and bounds without a physical meaning."""
        if len(set(self.names)) != len(self.names):
            raise ConfigError(f"groups {', '.join(self.names)}: each name may stand once")
        if self.members.ndim != 2 or len(self.members) != len(self.names):
            raise ConfigError(
                f"members of shape {self.members.shape} for {len(self.names)} groups: "
                "expected one row per group and one column per muscle"
            )
        for name, group in zip(self.names, self.members, strict=True):
            if not group.any():
                raise ConfigError(f"group {name} has no muscle elements; name one")
        twice = np.flatnonzero(self.members.sum(axis=0) > 1)
        if len(twice):
            groups = [n for n, g in zip(self.names, self.members, strict=True) if g[twice[0]]]
            raise ConfigError(
                f"muscle {twice[0]} belongs to the groups {', '.join(groups)}: choose one"
            )
        for low, high in (self.force_bounds, self.fibre_bounds):
            if not 0 < low < high:
                raise ConfigError(f"bounds {low} to {high} of a scaler: expected 0 < low < high")

    def apply(self, muscles: MuscleParameters, values: np.ndarray) -> MuscleParameters:
        """Muscle parameters with scalers (2, G) put on."""
        scaled = self.members.any(axis=0)
        force, fibre = np.where(scaled, values @ self.members, 1.0)
        return replace(
            muscles,
            max_isometric_force=muscles.max_isometric_force * force,
            optimal_fibre_length=muscles.optimal_fibre_length * fibre,
        )

    def gradient(self, muscles: MuscleParameters) -> np.ndarray:
        """d(Fmax [N], optimal fibre length [m]) / d(s_F, s_l) of each group, (2, G, M)."""
        generic = np.stack([muscles.max_isometric_force, muscles.optimal_fibre_length])
        return generic[:, None] * self.members


def no_scalers(muscles: int) -> Scalers:
    """No groups: all parameters of M muscles are known."""
    return Scalers((), np.zeros((0, muscles), dtype=bool))
