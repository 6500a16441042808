"""The collocated equations of motion with generalised forces of an effect.

Letters: I mesh intervals, n unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.ocp.layout import Layout
from scapulohumeral.ocp.transcription import Collocation


@dataclass(frozen=True, eq=False)
class LoadedCollocation(Collocation):
    """Equations of motion with generalised forces of an effect.

    Attributes
    ----------
    external_Nm : (I, 10) on the speeds, constant in the unknowns, so that all derivatives stay
    external_N : (I, 3) on the humeral head along scapula axes, constant likewise
    """

    external_Nm: np.ndarray
    external_N: np.ndarray

    def constraints(self, free: np.ndarray) -> np.ndarray:
        """Residuals of all equations, shape (equations * I,)."""
        residual = super().constraints(free).reshape(self.number_of_equations, -1)
        first = self.layout.coordinates
        load = np.hstack([self.external_Nm, self.external_N]) / self._row_units
        residual[first : first + load.shape[1]] += load.T
        return residual.ravel()


def load_collocation(collocation: Collocation, body: Body) -> LoadedCollocation:
    """The equations of another body."""
    return LoadedCollocation(
        forces=collocation.forces,
        muscles=body.muscles,
        parameters=pack(body.parameters),
        layout=collocation.layout,
        step=collocation.step,
        scalers=collocation.scalers,
        external_Nm=body.external_Nm,
        external_N=body.external_N,
    ).with_patterns_of(collocation)


def body_bounds(
    layout: Layout, body: Body, bounds: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bounds (n,) with those of a body's activations and excitations."""
    lower, upper = bounds[0].copy(), bounds[1].copy()
    for kind in ("a", "e"):
        index = layout.index(kind, np.arange(layout.muscles)[:, None], np.arange(layout.nodes))
        index = index.reshape(layout.muscles, -1)
        lower[index], upper[index] = body.floor[:, None], body.cap[:, None]
    return lower, upper
