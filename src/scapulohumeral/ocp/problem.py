"""The optimal control problem on opty, with our exact derivatives.

opty lays out the free vector, handles bounds and instance constraints and talks to IPOPT
(:mod:`opty_adapter`); all numbers come from :class:`Collocation` and :class:`Objective`.

Letters: N nodes, M muscles, Nq coordinates.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError
from scapulohumeral.ocp.lagrangian import CURVED, LagrangianHessian
from scapulohumeral.ocp.layout import REACTION_UNIT_N
from scapulohumeral.ocp.objective import Objective, Trajectory
from scapulohumeral.ocp.opty_adapter import Limits, OptyProblem, set_up
from scapulohumeral.ocp.scalers import Scalers, no_scalers
from scapulohumeral.ocp.transcription import Collocation

# Room beyond a motion that leaves the usual bounds, where joint angles follow it [rad].
ROOM_RAD = 0.2
HESSIANS = (*CURVED, "gauss-newton", "limited-memory")


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of the unknowns: wide enough that a solution reaches only those that it is meant to.

    Activations end where muscles do, compression and coordinates where a variant says. The others
    are beyond what an arm does in these tasks: they keep a failing solve where there are numbers.

    Attributes
    ----------
    quaternion : each component; angle : Euler angles and elbow [rad]
    speed : each speed [rad/s]; reaction : each component [N]
    activation : activations and excitations
    compression : of the glenoid on the humeral head along the lateral axis of the scapula [N],
        narrower than `reaction`; None for the same
    coordinates : least and largest generalised coordinates (2, Nq), in place of the ends above
    ends_at_rest : whether all speeds are zero at the first and the last node
    """

    quaternion: tuple[float, float] = (-1.1, 1.1)
    angle: tuple[float, float] = (-3.5, 3.5)
    elbow: tuple[float, float] = (-0.2, 2.8)
    speed: tuple[float, float] = (-40.0, 40.0)
    reaction: tuple[float, float] = (-5e3, 5e3)
    activation: tuple[float, float] = (0.0, 1.0)
    compression: tuple[float, float] | None = None
    coordinates: np.ndarray | None = None
    ends_at_rest: bool = False

    def around(self, angles_rad: np.ndarray) -> Bounds:
        """Bounds of angles that hold a motion, (N, 10) joint angles [rad], wherever it leaves them.

        Some elbows extend further than most, and Euler angles may count turns.
        """
        angle, elbow = angles_rad[:, :-1], angles_rad[:, -1]
        return replace(self, angle=_around(self.angle, angle), elbow=_around(self.elbow, elbow))


def _around(ends: tuple[float, float], values: np.ndarray) -> tuple[float, float]:
    low, high, least, largest = *ends, float(values.min()), float(values.max())
    return (
        low if low <= least else least - ROOM_RAD,
        high if high >= largest else largest + ROOM_RAD,
    )


class Problem(OptyProblem):
    """One optimal control problem, ready to be solved by IPOPT.

    Parameters
    ----------
    forces : equations and muscle geometry of the participant
    muscles : muscle parameters; parameters : dynamics parameters (P,)
    objective : objective, which also fixes the mesh
    hessian : "exact", "lumped" (see :mod:`lagrangian`), "gauss-newton" or "limited-memory"
    bounds : bounds of the unknowns
    scalers : groups whose muscle parameters are unknown too
    """

    def __init__(
        self,
        forces: MuscleForces,
        muscles: MuscleParameters,
        parameters: np.ndarray,
        objective: Objective,
        hessian: str = "exact",
        bounds: Bounds | None = None,
        scalers: Scalers | None = None,
    ) -> None:
        if hessian not in HESSIANS:
            raise ConfigError(f"hessian {hessian!r}: choose one of {', '.join(HESSIANS)}")
        scalers = scalers or no_scalers(len(muscles.names))
        name = forces.dynamics.name
        bounds = bounds or Bounds()
        posed = set_up(
            name,
            muscles.names,
            scalers.names,
            (len(objective.reference), objective.step),
            _limits(name, bounds, scalers),
        )
        self.objective_function = objective
        parameters = np.asarray(parameters, dtype=float)
        layout = replace(posed.layout, reaction_unit_N=REACTION_UNIT_N)
        self.collocation = Collocation(forces, muscles, parameters, layout, objective.step, scalers)
        self._take(posed, self.collocation)
        self._narrow(bounds)
        self.hessian_mode = hessian
        quaternions = np.arange(12 if name == "quaternion" else 0).reshape(-1, 4)
        coupling = objective.excitation_coupling(len(muscles.names))
        self.lagrangian = LagrangianHessian(self.collocation, hessian, quaternions, coupling)
        self.progress: Callable[[dict], bool] | None = None
        self._connect(self._value, self._gradient)

    def _narrow(self, bounds: Bounds) -> None:
        """Bounds of single unknowns, which do not need another set-up."""
        layout, nodes = self.layout, np.arange(self.layout.nodes)
        if bounds.coordinates is not None:
            index = layout.index("x", np.arange(layout.coordinates), nodes)
            self.lower_bound[index], self.upper_bound[index] = bounds.coordinates[..., None]
        if bounds.compression is not None:
            index = layout.index("reaction", np.array(0), nodes)
            low, high = bounds.compression
            self.lower_bound[index] = low / layout.reaction_unit_N
            self.upper_bound[index] = high / layout.reaction_unit_N
        if bounds.ends_at_rest:
            speeds = layout.coordinates + np.arange(10)
            ends = layout.index("x", speeds, np.array([0, layout.nodes - 1]))
            self.lower_bound[ends] = self.upper_bound[ends] = 0.0

    def varied(
        self,
        collocation: Collocation,
        objective: Objective,
        hessian: str,
        bounds: tuple[np.ndarray, np.ndarray],
    ) -> Problem:
        """The same unknowns and mesh with other numbers.

        Opty's set-up, which takes longer than some solves, depends on mesh and equations only.

        Parameters
        ----------
        collocation, objective : of the same layout; hessian : as for the constructor
        bounds : lower and upper bounds of the unknowns, (n,) each
        """
        other = Problem.__new__(Problem)
        other.__dict__.update(self.__dict__)
        other.objective_function, other.hessian_mode = objective, hessian
        other.collocation = collocation
        other.lagrangian = replace(
            self.lagrangian,
            collocation=collocation,
            mode=hessian,
            coupling=objective.excitation_coupling(len(collocation.muscles.names)),
        )
        other.collocator = self.collocator.with_collocation(collocation)
        other.lower_bound, other.upper_bound = bounds
        other._connect(other._value, other._gradient)
        return other

    def _value(self, free: np.ndarray) -> float:
        return self.objective_function.value(self.layout.split(free))

    def _gradient(self, free: np.ndarray) -> np.ndarray:
        return self.layout.join_gradient(self.objective_function.gradient(self.layout.split(free)))

    def hessianstructure(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and column indices of the lower triangle of the Lagrangian's Hessian."""
        return self.lagrangian.structure

    def hessian(self, free: np.ndarray, lagrange: np.ndarray, obj_factor: float) -> np.ndarray:
        """Values of the lower triangle of the Lagrangian's Hessian."""
        blocks = self.objective_function.hessian(
            self.layout.split(free), exact=self.lagrangian.curved
        )
        squared = self.layout.reaction_unit_N**2
        blocks = replace(
            blocks,
            reaction=squared * blocks.reaction,
            rate_reaction=squared * blocks.rate_reaction,
        )
        return self.lagrangian.values(free, blocks, obj_factor, lagrange)

    def intermediate(self, *args) -> bool:
        """Record progress; False asks IPOPT to stop."""
        names = (
            "mode",
            "iteration",
            "objective",
            "primal_infeasibility",
            "dual_infeasibility",
            "barrier",
            "step",
            "regularisation",
            "dual_step",
            "primal_step",
            "trials",
        )
        self.obj_value.append(args[2])
        if self.progress is None:
            return True
        return self.progress(dict(zip(names, args, strict=True)))

    def trajectory(self, free: np.ndarray) -> Trajectory:
        """Trajectories of a free vector (n,)."""
        return self.layout.split(free)


def _limits(formulation: str, bounds: Bounds, scalers: Scalers) -> tuple[tuple[str, Limits], ...]:
    """Bounds by kind of unknown, as :func:`set_up` takes them."""
    return (
        ("q", bounds.quaternion if formulation == "quaternion" else bounds.angle),
        ("elbow", bounds.elbow),
        ("u", bounds.speed),
        ("a", bounds.activation),
        ("e", bounds.activation),
        ("R", (bounds.reaction[0] / REACTION_UNIT_N, bounds.reaction[1] / REACTION_UNIT_N)),
        ("s_F", scalers.force_bounds),
        ("s_l", scalers.fibre_bounds),
    )
