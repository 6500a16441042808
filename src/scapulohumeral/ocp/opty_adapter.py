"""Everything that touches opty beyond its public interface, in one place.

opty lays out the free vector, sorts and counts the unknowns and handles bounds and instance
constraints, but its constructors also generate code from the equations of motion, one symbolic
expression of the whole model, which takes hours. Here it sees a skeleton of the equations only, and
the functions that it would generate are replaced. What its SymPy work finds depends on muscles,
mesh and bounds alone, so it is done once for each of them.

Private names of opty in use: see :data:`PRIVATE_NAMES`.

Letters: N nodes, n unknowns, m constraints.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import sympy as sm
import sympy.physics.mechanics as me

from scapulohumeral.dynamics.formulation import Formulation, get_formulation
from scapulohumeral.ocp.dense_kernels import use_fast_kernels
from scapulohumeral.ocp.layout import Layout
from scapulohumeral.ocp.transcription import Collocation

# Before cyipopt, which loads MUMPS: its names are bound as it is loaded.
use_fast_kernels()

import cyipopt  # noqa: E402
import opty  # noqa: E402
from opty.direct_collocation import ConstraintCollocator  # noqa: E402

REACTION_NAMES = ("R_x", "R_y", "R_z")
# Methods that are called or replaced, and attributes that are set or read, by class.
PRIVATE_NAMES = {
    "ConstraintCollocator": (
        "_discretize_eom",
        "_gen_multi_arg_con_func",
        "_gen_multi_arg_con_jac_func",
        "_instance_constraints_jacobian_indices",
    ),
    "Problem": ("_generate_constraint_bound_arrays",),
}
PRIVATE_ATTRIBUTES = {
    "ConstraintCollocator": ("_multi_arg_con_func", "_multi_arg_con_jac_func"),
    "Problem": (
        "_bounds",
        "_eom_bounds",
        "_obj_num_args",
        "_obj_grad_num_args",
        "_low_con_bounds",
        "_upp_con_bounds",
    ),
}
# Meshes whose set-up is kept: a coarse and a fine one of each of a few kinds of problems.
KEPT_SET_UPS = 16

Limits = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Symbols:
    """Unknowns as opty knows them, and a skeleton of the equations of motion.

    Force scalers come first, then fibre-length scalers, each in the order of the groups.
    """

    states: tuple[sm.Expr, ...]
    inputs: tuple[sm.Expr, ...]
    scalers: tuple[sm.Symbol, ...]
    skeleton: sm.Matrix


@lru_cache(maxsize=KEPT_SET_UPS)
def problem_symbols(name: str, muscles: tuple[str, ...], groups: tuple[str, ...] = ()) -> Symbols:
    """States q, u, a; inputs R, e; scalers; and one placeholder row per equation of motion."""
    t = me.dynamicsymbols._t
    activations = tuple(me.dynamicsymbols(f"a_{name}") for name in muscles)
    excitations = tuple(me.dynamicsymbols(f"e_{name}") for name in muscles)
    reactions = tuple(me.dynamicsymbols(name) for name in REACTION_NAMES)
    formulation = get_formulation(name)
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

    def with_collocation(self, collocation: Collocation) -> Collocator:
        """The same mesh and symbols with other numeric functions."""
        other = copy(self)
        other.collocation = collocation
        return other

    def _discretize_eom(self) -> None:
        """Nothing: the skeleton need not be discretised, which is a third of a set-up's time."""

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


@dataclass(frozen=True, eq=False)
class SetUp:
    """What opty finds out about a mesh and its unknowns, without any numeric function.

    Attributes
    ----------
    symbols : unknowns; collocator : without numeric functions
    layout : positions of the unknowns
    state : attributes of an ``opty.Problem``, by name
    """

    symbols: Symbols
    collocator: Collocator
    layout: Layout
    state: dict[str, object]


class OptyProblem(opty.Problem):
    """An ``opty.Problem`` around numeric functions that are ready, made without code generation.

    Attributes
    ----------
    collocator : see :class:`Collocator`; layout : positions of the unknowns
    lower_bound, upper_bound : of the unknowns, (n,) each
    """

    lower_bound: np.ndarray
    upper_bound: np.ndarray

    def _take(self, set_up: SetUp, collocation: Collocation) -> None:
        """What opty's own constructor does after code generation."""
        self.__dict__.update(set_up.state)
        self.lower_bound, self.upper_bound = self.lower_bound.copy(), self.upper_bound.copy()
        self.layout = collocation.layout
        self.collocator = set_up.collocator.with_collocation(collocation)
        self.con_jac_rows, self.con_jac_cols = self.collocator.jacobian_indices()

    def _connect(
        self,
        value: Callable[[np.ndarray], float],
        gradient: Callable[[np.ndarray], np.ndarray],
    ) -> None:
        """Give IPOPT the objective, the constraints of the collocator and the bounds."""
        self.obj, self.obj_grad = value, gradient
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


@lru_cache(maxsize=KEPT_SET_UPS)
def set_up(
    formulation: str,
    muscles: tuple[str, ...],
    groups: tuple[str, ...],
    mesh: tuple[int, float],
    limits: tuple[tuple[str, Limits], ...],
) -> SetUp:
    """What opty makes of the unknowns of a problem, kept for the next problem of the same kind.

    Parameters
    ----------
    formulation : name; muscles, groups : names of muscles and of groups with scalers
    mesh : number of nodes and interval [s]
    limits : lower and upper bound by kind of unknown: q, elbow, u, a, e, R, s_F, s_l
    """
    chosen = get_formulation(formulation)
    symbols = problem_symbols(formulation, muscles, groups)
    collocator = Collocator(
        symbols.skeleton,
        symbols.states,
        *mesh,
        instance_constraints=tuple(unit_norms(chosen)) or None,
        integration_method="midpoint",
    )
    problem = OptyProblem.__new__(OptyProblem)
    problem.collocator = collocator
    problem._bounds, problem._eom_bounds = _bound_map(symbols, dict(limits)), None
    problem._obj_num_args = problem._obj_grad_num_args = 1
    problem.num_free = collocator.num_free
    problem.num_constraints = collocator.num_constraints
    problem.lower_bound, problem.upper_bound = _bound_arrays(collocator, problem._bounds)
    problem._generate_constraint_bound_arrays()
    return SetUp(symbols, collocator, _layout(collocator, symbols, chosen), dict(problem.__dict__))


def unit_norms(formulation: Formulation) -> list[sm.Expr]:
    """Unit norm of each quaternion at the first node, as opty instance constraints."""
    if formulation.name != "quaternion":
        return []
    start = [c.func(0) for c in formulation.q[:12]]
    return [sum(c**2 for c in start[i : i + 4]) - 1 for i in (0, 4, 8)]


def _layout(collocator: Collocator, symbols: Symbols, formulation: Formulation) -> Layout:
    # Symbols are found by their hash: a search compares expressions, one after the other.
    inputs = {s: i for i, s in enumerate(collocator.unknown_input_trajectories)}
    parameters = collocator.unknown_parameters
    return Layout(
        nodes=collocator.num_collocation_nodes,
        coordinates=len(formulation.q),
        muscles=len(symbols.inputs) - len(REACTION_NAMES),
        inputs=np.array([inputs[s] for s in symbols.inputs]),
        scalers=np.array([parameters.index(s) for s in symbols.scalers], dtype=int).reshape(2, -1),
    )


def _bound_map(symbols: Symbols, limits: dict[str, Limits]) -> dict[sm.Expr, Limits]:
    names = {s: str(s.func) for s in (*symbols.states, *symbols.inputs)}
    bounds = {s: limits["elbow" if n == "q_EL" else n[0]] for s, n in names.items()}
    return bounds | {s: limits[s.name[:3]] for s in symbols.scalers}


def _bound_arrays(
    collocator: Collocator, bounds: dict[sm.Expr, Limits]
) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper bounds (n,); opty's own arrays take a search among all symbols for each."""
    trajectories = (*collocator.state_symbols, *collocator.unknown_input_trajectories)
    table = np.array([bounds[s] for s in trajectories]).repeat(
        collocator.num_collocation_nodes, axis=0
    )
    constants = [bounds[s] for s in collocator.unknown_parameters]
    lower, upper = np.vstack([table, np.reshape(constants, (-1, 2))]).T
    return lower.copy(), upper.copy()
