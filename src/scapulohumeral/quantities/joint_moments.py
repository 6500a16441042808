"""Moments of the muscles about the joints, and the largest that they could produce.

Ten directions: the axes of clavicle, scapula and humerus at the sternoclavicular,
acromioclavicular and glenohumeral joint (each the distal segment), and the elbow axis. Springs,
ligament and contact are not muscles and not counted.

Letters: N nodes, S sampled nodes, M muscles.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from scapulohumeral.dynamics.hill import MuscleParameters, force_derivatives
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError, SolveError

DIRECTIONS = ("SC_x", "SC_y", "SC_z", "AC_x", "AC_y", "AC_z", "GH_x", "GH_y", "GH_z", "EL")
# A smaller moment has no meaningful margin [N m].
SMALLEST_MOMENT_NM = 0.1


@dataclass(frozen=True, eq=False)
class JointMoments:
    """Moments of the muscles, columns as in `DIRECTIONS`.

    Attributes
    ----------
    per_activation : (N, 10, M) moment of each fully activated muscle [N m]
    active, passive : (N, 10) moments of active and of passive muscle force [N m]
    """

    per_activation: np.ndarray
    active: np.ndarray
    passive: np.ndarray

    @property
    def net(self) -> np.ndarray:
        """Sum of active and passive moments, shape (N, 10) [N m]."""
        return self.active + self.passive


@dataclass(frozen=True, eq=False)
class TorqueCapacity:
    """Range of each moment with all others as they are, columns as in `DIRECTIONS`.

    Attributes
    ----------
    nodes : (S,) sampled nodes
    required : (S, 10) moment of the solution [N m]
    lowest, highest : (S, 10) ends of the range [N m]
    """

    nodes: np.ndarray
    required: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray

    @property
    def margin(self) -> np.ndarray:
        """Largest moment in the sense of the required one over it, shape (S, 10) [1].

        One means that the muscles are at their limit; not a number where hardly any moment is
        required.
        """
        capacity = np.where(self.required > 0, self.highest, self.lowest)
        margin = np.full(self.required.shape, np.nan)
        loaded = np.abs(self.required) >= SMALLEST_MOMENT_NM
        np.divide(capacity, self.required, out=margin, where=loaded)
        return margin


def joint_moments(
    forces: MuscleForces,
    muscles: MuscleParameters,
    q: np.ndarray,
    u: np.ndarray,
    activation: np.ndarray,
) -> JointMoments:
    """Moments of the muscles at given states.

    Parameters
    ----------
    forces : in quaternions, whose speeds are angular velocities in distal axes
    muscles : strength, fibre lengths and capacity
    q, u, activation : arrays, shapes (N, 13), (N, 10), (N, M)

    Raises
    ------
    ConfigError                      in Euler angles, whose generalised forces are no components
    """
    if forces.dynamics.name != "quaternion":
        raise ConfigError(
            f"joint moments in the formulation '{forces.dynamics.name}': expected 'quaternion', "
            "whose generalised forces are moments about orthogonal axes. Use its solution"
        )
    force = force_derivatives(*forces.lengths(q, u), muscles)
    arms = -forces.gradients(q)[:, :, : len(DIRECTIONS)]
    per_activation = (force.active[:, :, None] * arms).transpose(0, 2, 1)
    return JointMoments(
        per_activation=per_activation,
        active=np.einsum("nkm,nm->nk", per_activation, activation),
        passive=np.einsum("nm,nmk->nk", force.passive, arms),
    )


def torque_capacity(moments: JointMoments, nodes: Sequence[int]) -> TorqueCapacity:
    """Extremes of each moment that activations in [0, 1] can produce at the pose of a node.

    The other nine moments stay those of the solution, as the motion requires. One linear programme
    per node, direction and sense.

    Raises
    ------
    SolveError                       if no activations in [0, 1] give the moments of the solution
    """
    net, passive = moments.net, moments.passive
    shape = (len(nodes), len(DIRECTIONS))
    ends = {-1: np.empty(shape), 1: np.empty(shape)}
    for row, node in enumerate(nodes):
        for column in range(len(DIRECTIONS)):
            for sense, values in ends.items():
                active = _extreme(moments.per_activation[node], moments.active[node], column, sense)
                if active is None:
                    raise SolveError(
                        f"torque capacity at node {node}, {DIRECTIONS[column]}: activations in "
                        "[0, 1] do not give the moments of the solution. Check its activations"
                    )
                values[row, column] = active + passive[node, column]
    return TorqueCapacity(np.asarray(nodes), net[list(nodes)], ends[-1], ends[1])


def _extreme(
    per_activation: np.ndarray, active: np.ndarray, column: int, sense: int
) -> float | None:
    """Extreme active moment in one direction with the others given, or None if there is none."""
    others = np.arange(len(active)) != column
    result = linprog(
        -sense * per_activation[column],
        A_eq=per_activation[others],
        b_eq=active[others],
        bounds=(0.0, 1.0),
        method="highs",
    )
    if not result.success or result.fun is None:
        return None
    return -sense * float(result.fun)
