"""Positions of all unknowns in opty's free vector.

The free vector holds state trajectories, then input trajectories, one variable after the other,
then unknown parameters; here these are the scalers.

Letters: N nodes, M muscles, Nq coordinates, X = Nq + 10, G groups of scaled muscles.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scapulohumeral.ocp.objective import Trajectory

# Newtons per unit of a joint reaction in the free vector and of the equations that yield it. It
# scales numbers for the solver and changes no result: weights and bounds are in newtons.
REACTION_UNIT_N = 100.0


@dataclass(frozen=True, eq=False)
class Layout:
    """Positions of all trajectories in opty's free vector.

    Attributes
    ----------
    nodes : N; coordinates : Nq; muscles : M
    inputs : row of each input trajectory, reactions x y z first, then excitations in muscle order
    scalers : position of each scaler (2, G) among opty's unknown parameters
    reaction_unit_N : newtons per unit of a reaction in the free vector
    """

    nodes: int
    coordinates: int
    muscles: int
    inputs: np.ndarray
    scalers: np.ndarray
    reaction_unit_N: float = REACTION_UNIT_N

    @property
    def trajectory_size(self) -> int:
        """Length of the free vector without the scalers."""
        return self.nodes * (self.coordinates + 10 + 2 * self.muscles + 3)

    @property
    def size(self) -> int:
        """Length of the free vector."""
        return self.trajectory_size + self.scalers.size

    @cached_property
    def rows(self) -> dict[str, np.ndarray]:
        """Trajectory row of every variable by kind: x = (q, u), a, e, reaction."""
        x = self.coordinates + 10
        states = x + self.muscles
        return {
            "x": np.arange(x),
            "a": x + np.arange(self.muscles),
            "reaction": states + self.inputs[:3],
            "e": states + self.inputs[3:],
        }

    def index(self, kind: str, variable: np.ndarray, node: np.ndarray) -> np.ndarray:
        """Indices (V, N) in the free vector of variables (V,) at nodes (N,)."""
        return self.rows[kind][variable][..., None] * self.nodes + node

    @property
    def scaler_index(self) -> np.ndarray:
        """Indices of the scalers in the free vector, (2, G)."""
        return self.trajectory_size + self.scalers

    def split(self, free: np.ndarray) -> Trajectory:
        """Trajectories of a free vector (n,), in the units of :class:`Trajectory`."""
        table = free[: self.trajectory_size].reshape(-1, self.nodes)
        nq = self.coordinates
        x = table[self.rows["x"]].T
        return Trajectory(
            q=x[:, :nq],
            u=x[:, nq:],
            a=table[self.rows["a"]].T,
            e=table[self.rows["e"]].T,
            reaction=self.reaction_unit_N * table[self.rows["reaction"]].T,
            scalers=free[self.scaler_index],
        )

    def join(self, x: Trajectory) -> np.ndarray:
        """Free vector (n,) of trajectories: the inverse of :meth:`split`."""
        free = np.empty(self.size)
        table = free[: self.trajectory_size].reshape(-1, self.nodes)
        table[self.rows["x"]] = np.hstack([x.q, x.u]).T
        table[self.rows["a"]] = x.a.T
        table[self.rows["e"]] = x.e.T
        table[self.rows["reaction"]] = x.reaction.T / self.reaction_unit_N
        free[self.scaler_index] = x.scalers
        return free

    def join_gradient(self, slope: Trajectory) -> np.ndarray:
        """Derivatives (n,) by the free vector, of those by each kind of unknown (reaction: 1/N)."""
        unit = self.reaction_unit_N
        return self.join(replace(slope, reaction=unit**2 * slope.reaction))
