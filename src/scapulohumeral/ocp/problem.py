"""The optimal control problem on opty: its collocator and problem, with our exact derivatives.

opty lays out the free vector, sorts and counts the unknowns, handles bounds and instance
constraints and talks to IPOPT; the functions that it would generate from the equations of motion
are replaced by :class:`Collocation`, because one symbolic expression of the whole model takes
hours to generate. opty sees the structure of the equations only.

Letters: N nodes, M muscles, Nq coordinates.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass, replace

import cyipopt
import numpy as np
import opty
import sympy as sm
import sympy.physics.mechanics as me
from opty.direct_collocation import ConstraintCollocator

from scapulohumeral.dynamics.formulation import Formulation, get_formulation
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError
from scapulohumeral.ocp.lagrangian import LagrangianHessian
from scapulohumeral.ocp.layout import REACTION_UNIT_N, Layout
from scapulohumeral.ocp.objective import Objective, Trajectory
from scapulohumeral.ocp.scalers import Scalers, no_scalers
from scapulohumeral.ocp.transcription import Collocation

HESSIANS = ("exact", "gauss-newton", "limited-memory")
REACTION_NAMES = ("R_x", "R_y", "R_z")


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of the unknowns.

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
    reaction: tuple[float, float] = (-2e4, 2e4)
    activation: tuple[float, float] = (0.0, 1.0)
    compression: tuple[float, float] | None = None
    coordinates: np.ndarray | None = None
    ends_at_rest: bool = False


@dataclass(frozen=True)
class Symbols:
    """Unknowns as opty knows them, and a skeleton of the equations of motion.

    Force scalers come first, then fibre-length scalers, each in the order of the groups.
    """

    states: tuple[sm.Expr, ...]
    inputs: tuple[sm.Expr, ...]
    scalers: tuple[sm.Symbol, ...]
    skeleton: sm.Matrix


def problem_symbols(
    formulation: Formulation, muscles: tuple[str, ...], groups: tuple[str, ...] = ()
) -> Symbols:
    """States q, u, a; inputs R, e; scalers; and one placeholder row per equation of motion."""
    t = me.dynamicsymbols._t
    activations = tuple(me.dynamicsymbols(f"a_{name}") for name in muscles)
    excitations = tuple(me.dynamicsymbols(f"e_{name}") for name in muscles)
    reactions = tuple(me.dynamicsymbols(name) for name in REACTION_NAMES)
    q, u = formulation.q, formulation.u
    rows = [c.diff(t) for c in q] + [c.diff(t) for c in u] + list(reactions)
    rows += [a.diff(t) - e for a, e in zip(activations, excitations, strict=True)]
    scalers = tuple(sm.Symbol(f"{kind}_{group}") for kind in ("s_F", "s_l") for group in groups)
    # opty finds unknown parameters in the equations only.
    rows[-1] += sum(scalers)
    return Symbols((*q, *u, *activations), (*reactions, *excitations), scalers, sm.Matrix(rows))


class Collocator(ConstraintCollocator):
    """opty's collocator with hand-made numeric functions in place of the generated ones."""

    collocation: Collocation

    def _gen_multi_arg_con_func(self) -> None:
        self._multi_arg_con_func = self._evaluate(lambda free: self.collocation.constraints(free))

    def _gen_multi_arg_con_jac_func(self) -> None:
        self._multi_arg_con_jac_func = self._evaluate(lambda free: self.collocation.jacobian(free))

    @staticmethod
    def _evaluate(function: Callable[[np.ndarray], np.ndarray]):
        def evaluate(states, specified, constants, interval):
            return function(np.concatenate([states.ravel(), specified.ravel(), constants]))

        # opty's wrapper reads these sections.
        evaluate.__doc__ = "Evaluate.\n\nParameters\n----------\nReturns\n-------\n"
        return evaluate

    def jacobian_indices(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and column indices of the constraint Jacobian, instance constraints last."""
        rows, columns = self.collocation.jacobian_structure
        if self.instance_constraints is None:
            return rows, columns
        extra_rows, extra_columns = self._instance_constraints_jacobian_indices()
        return np.hstack([rows, extra_rows]), np.hstack([columns, extra_columns])


class Problem(opty.Problem):
    """One optimal control problem, ready to be solved by IPOPT.

    Parameters
    ----------
    forces : equations and muscle geometry of the participant
    muscles : muscle parameters; parameters : dynamics parameters (P,)
    objective : objective, which also fixes the mesh
    hessian : "exact", "gauss-newton" or "limited-memory"
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
        formulation = get_formulation(forces.dynamics.name)
        symbols = problem_symbols(formulation, muscles.names, scalers.names)
        norms = _unit_norms(formulation)
        self.collocator = Collocator(
            symbols.skeleton,
            symbols.states,
            len(objective.reference),
            objective.step,
            instance_constraints=tuple(norms) or None,
            integration_method="midpoint",
        )
        self.layout = _layout(self.collocator, symbols, formulation)
        self.objective_function = objective
        parameters = np.asarray(parameters, dtype=float)
        self.collocation = Collocation(
            forces, muscles, parameters, self.layout, objective.step, scalers
        )
        self.collocator.collocation = self.collocation
        self.hessian_mode = hessian
        quaternions = np.arange(4 * len(norms)).reshape(-1, 4)
        coupling = objective.excitation_coupling(len(muscles.names))
        self.lagrangian = LagrangianHessian(
            self.collocation, hessian == "exact", quaternions, coupling
        )
        bounds = bounds or Bounds()
        self._prepare(_bound_map(symbols, bounds, scalers, self.layout.reaction_unit_N))
        if bounds.ends_at_rest:
            speeds = self.layout.coordinates + np.arange(10)
            ends = self.layout.index("x", speeds, np.array([0, self.layout.nodes - 1]))
            self.lower_bound[ends] = self.upper_bound[ends] = 0.0
            self._connect()

    def _prepare(self, bounds: dict[sm.Expr, tuple[float, float]]) -> None:
        """What opty's own constructor does after code generation."""
        self._bounds = bounds
        self._eom_bounds = None
        self._obj_num_args = self._obj_grad_num_args = 1
        self.con_jac_rows, self.con_jac_cols = self.collocator.jacobian_indices()
        self.num_free = self.collocator.num_free
        self.num_constraints = self.collocator.num_constraints
        self._generate_bound_arrays()
        self._generate_constraint_bound_arrays()
        self._extraction_indices = self._generate_extraction_indices()
        self.progress: Callable[[dict], bool] | None = None
        self._connect()

    def _connect(self) -> None:
        """Give IPOPT the functions and bounds of this problem."""
        self.obj, self.obj_grad = self._value, self._gradient
        self.con = self.collocator.generate_constraint_function()
        self.con_jac = self.collocator.generate_jacobian_function()
        self.obj_value: list[float] = []
        cyipopt.Problem.__init__(
            self,
            n=self.num_free,
            m=self.num_constraints,
            lb=self.lower_bound,
            ub=self.upper_bound,
            cl=self._low_con_bounds,
            cu=self._upp_con_bounds,
        )

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
            exact=hessian == "exact",
            coupling=objective.excitation_coupling(len(collocation.muscles.names)),
        )
        other.collocator = copy(self.collocator)
        other.collocator.collocation = collocation
        other.lower_bound, other.upper_bound = bounds
        other._connect()
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
            self.layout.split(free), exact=self.hessian_mode == "exact"
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
        """Trajectories of a free vector."""
        return self.layout.split(free)


def _unit_norms(formulation: Formulation) -> list[sm.Expr]:
    """Unit norm of each quaternion at the first node, as opty instance constraints."""
    if formulation.name != "quaternion":
        return []
    start = [c.func(0) for c in formulation.q[:12]]
    return [sum(c**2 for c in start[i : i + 4]) - 1 for i in (0, 4, 8)]


def _layout(collocator: Collocator, symbols: Symbols, formulation: Formulation) -> Layout:
    inputs, parameters = collocator.unknown_input_trajectories, collocator.unknown_parameters
    return Layout(
        nodes=collocator.num_collocation_nodes,
        coordinates=len(formulation.q),
        muscles=len(symbols.inputs) - len(REACTION_NAMES),
        inputs=np.array([inputs.index(s) for s in symbols.inputs]),
        scalers=np.array([parameters.index(s) for s in symbols.scalers], dtype=int).reshape(2, -1),
        reaction_unit_N=REACTION_UNIT_N,
    )


def _bound_map(
    symbols: Symbols, bounds: Bounds, scalers: Scalers, reaction_unit_N: float
) -> dict[sm.Expr, tuple[float, float]]:
    quaternion = any(str(s.func) == "q_SC_0" for s in symbols.states)
    limits = {
        "u": bounds.speed,
        "a": bounds.activation,
        "e": bounds.activation,
        "R": (bounds.reaction[0] / reaction_unit_N, bounds.reaction[1] / reaction_unit_N),
        "q": bounds.quaternion if quaternion else bounds.angle,
    }
    groups = len(scalers.names)
    scaler_limits = [scalers.force_bounds] * groups + [scalers.fibre_bounds] * groups
    found = {
        s: bounds.elbow if str(s.func) == "q_EL" else limits[str(s.func)[0]]
        for s in (*symbols.states, *symbols.inputs)
    } | dict(zip(symbols.scalers, scaler_limits, strict=True))
    if bounds.coordinates is not None:
        boxes = bounds.coordinates.T.tolist()
        found |= {s: (low, high) for s, (low, high) in zip(symbols.states, boxes, strict=False)}
    if bounds.compression is not None:
        low, high = bounds.compression
        found[symbols.inputs[0]] = (low / reaction_unit_N, high / reaction_unit_N)
    return found
