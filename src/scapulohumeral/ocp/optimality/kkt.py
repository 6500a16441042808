"""Optimality conditions of a stored point: error, second-order certificate, and the KKT matrix.

Lagrangian L = f + lambda . c - z_L . (w - l) - z_U . (u - w), as IPOPT signs it. Eliminating the
bound multipliers from the linearised conditions (Nocedal and Wright, Numerical Optimization,
section 19.3; Waechter and Biegler 2006, eq. 13) leaves

    [H + Sigma   A^T] [dw     ]
    [A           0  ] [dlambda],   Sigma = z_L / (w - l) + z_U / (u - w),

H the exact Hessian of L and A the Jacobian of c. The point is a strict local minimum if this matrix
has n positive, m negative and no zero eigenvalues: H + Sigma is then positive definite on the null
space of A, and Sigma confines the active bounds.

Letters: n unknowns, m constraints, k right-hand sides.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.ocp.optimality.mumps import SymmetricFactors
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.scaling import gradient_scaling
from scapulohumeral.ocp.solving.solver import Start

# IPOPT's defaults: bounds are relaxed by this share, so its slacks are never zero; multipliers
# above the limit on average scale the errors down.
BOUND_RELAXATION = 1e-8
SCALING_MAX_MULTIPLIER = 100.0
# A bound whose slack and multiplier both lie below this may change between active and inactive.
WEAKLY_ACTIVE = 1e-4
CERTIFIED_ERROR = 1e-6


@dataclass(frozen=True)
class OptimalityError:
    """Largest violation of each first-order condition.

    Attributes
    ----------
    stationarity : of the gradient of the Lagrangian
    feasibility : of constraints and (relaxed) bounds
    complementarity : of slack times multiplier, and of the sign of the multipliers
    """

    stationarity: float
    feasibility: float
    complementarity: float

    @property
    def largest(self) -> float:
        """KKT error."""
        return max(self.stationarity, self.feasibility, self.complementarity)


@dataclass(frozen=True)
class Certificate:
    """First- and second-order optimality of a point.

    Attributes
    ----------
    unscaled, scaled : errors as posed, and with the scaling that IPOPT applies
    inertia : positive, negative and zero eigenvalues of the KKT matrix
    expected_inertia : that of a strict local minimum, (n, m, 0)
    active_bounds : bounds whose multiplier exceeds their slack
    active_by_kind : the same by kind of unknown, of those that have any
    weakly_active_bounds : bounds with both below 1e-4; derivatives may be one-sided there
    """

    unscaled: OptimalityError
    scaled: OptimalityError
    inertia: tuple[int, int, int]
    expected_inertia: tuple[int, int, int]
    active_bounds: int
    active_by_kind: dict[str, int]
    weakly_active_bounds: int

    @property
    def kkt_error(self) -> float:
        """Largest of the unscaled and the scaled errors."""
        return max(self.unscaled.largest, self.scaled.largest)

    @property
    def reduced_hessian_positive(self) -> bool:
        """Whether the Hessian is positive definite on the null space of the active constraints."""
        return self.inertia == self.expected_inertia

    @property
    def holds(self) -> bool:
        """Whether the point is certified as a strict local minimum to 1e-6."""
        return self.kkt_error <= CERTIFIED_ERROR and self.reduced_hessian_positive


@dataclass(frozen=True, eq=False)
class KktSystem:
    """Factorised KKT matrix at a point.

    Attributes
    ----------
    factors : of the matrix of order n + m
    sigma_lower, sigma_upper : (n,) barrier curvature of both bounds
    fixed : (n,) unknowns with equal bounds, which do not move
    """

    factors: SymmetricFactors
    sigma_lower: np.ndarray
    sigma_upper: np.ndarray
    fixed: np.ndarray

    @property
    def unknowns(self) -> int:
        """Number of unknowns n; solutions hold their steps first, then those of multipliers."""
        return len(self.fixed)

    @property
    def inertia(self) -> tuple[int, int, int]:
        """Numbers of positive, negative and zero eigenvalues."""
        return self.factors.inertia

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Steps of unknowns and multipliers for right-hand sides, (n + m,) or (n + m, k).

        Raises
        ------
        SolveError
            If the matrix is singular.
        """
        right = right.copy()
        right[: self.unknowns][self.fixed] = 0.0
        return self.factors.solve(right)


@dataclass(frozen=True, eq=False)
class _Conditions:
    """What the optimality conditions are made of at one point."""

    gradient: np.ndarray
    constraints: np.ndarray
    jacobian: sparse.csr_matrix
    multipliers: np.ndarray
    slacks: tuple[np.ndarray, np.ndarray]
    bound_multipliers: tuple[np.ndarray, np.ndarray]
    fixed: np.ndarray

    @property
    def lagrangian_gradient(self) -> np.ndarray:
        """(n,), 0 where the unknown is fixed."""
        lower, upper = self.bound_multipliers
        total = self.gradient + self.jacobian.T @ self.multipliers - lower + upper
        return np.where(self.fixed, 0.0, total)


def assemble_kkt(problem: Problem, point: Start) -> KktSystem:
    """Factorise the KKT matrix of a problem with exact Hessian at a solution with multipliers.

    For derivatives smoothed over changes of the active set, solve with a barrier target first
    (:class:`SolverSettings`): this matrix is then that of the smoothed problem.

    Raises
    ------
    ConfigError
        If the problem's Hessian is not exact.
    SolveError
        If the point has no multipliers or lies outside its bounds.
    """
    return _assemble(problem, point, _conditions(problem, point))


def certificate(problem: Problem, point: Start) -> Certificate:
    """First- and second-order optimality of a point; raises as :func:`assemble_kkt`.

    Complementarity of a solution with a barrier target is that target. IPOPT's scaling
    factors are taken at this point, where IPOPT itself takes them at its start.
    """
    conditions = _conditions(problem, point)
    kkt = _assemble(problem, point, conditions)
    slack = np.concatenate(conditions.slacks)
    multiplier = np.concatenate(conditions.bound_multipliers)
    loose = np.tile(~conditions.fixed, 2)
    slack, multiplier = slack[loose], multiplier[loose]
    return Certificate(
        unscaled=_unscaled(conditions),
        scaled=_scaled(conditions),
        inertia=kkt.inertia,
        expected_inertia=(len(conditions.gradient), len(conditions.constraints), 0),
        active_bounds=int((multiplier > slack).sum()),
        active_by_kind=_by_kind(problem, conditions),
        weakly_active_bounds=int((np.maximum(multiplier, slack) < WEAKLY_ACTIVE).sum()),
    )


def _by_kind(problem: Problem, conditions: _Conditions) -> dict[str, int]:
    """Active bounds of loose unknowns by kind: x (coordinates, speeds), a, e, reaction, scaler."""
    pairs = zip(conditions.bound_multipliers, conditions.slacks, strict=True)
    active = np.sum([multiplier > slack for multiplier, slack in pairs], axis=0)
    active[conditions.fixed] = 0
    layout = problem.layout
    table = active[: layout.trajectory_size].reshape(-1, layout.nodes)
    counts = {kind: int(table[rows].sum()) for kind, rows in layout.rows.items()}
    counts["scaler"] = int(active[layout.scaler_index].sum())
    return {kind: count for kind, count in counts.items() if count}


def _conditions(problem: Problem, point: Start) -> _Conditions:
    if problem.hessian_mode != "exact":
        raise ConfigError(
            f"KKT matrix of a problem with hessian {problem.hessian_mode!r}: build the problem "
            "with 'exact'"
        )
    if point.multipliers is None or point.lower is None or point.upper is None:
        raise SolveError("the point has no multipliers: solve the problem first")
    free, low, high = point.free, problem.lower_bound, problem.upper_bound
    shape = (problem.num_constraints, problem.num_free)
    jacobian = sparse.csr_matrix((problem.jacobian(free), problem.jacobianstructure()), shape=shape)
    slacks = (free - low + _relaxation(low), high + _relaxation(high) - free)
    fixed = low == high
    for slack, side in zip(slacks, ("lower", "upper"), strict=True):
        worst = int(np.argmin(slack))
        if slack[worst] <= 0:
            raise SolveError(
                f"unknown {worst} is {free[worst]:.6g}, beyond its {side} bound by "
                f"{-slack[worst]:.1e}: the KKT matrix is defined inside the bounds only; solve "
                "again with these bounds"
            )
    return _Conditions(
        gradient=problem.gradient(free),
        constraints=problem.constraints(free),
        jacobian=jacobian,
        multipliers=point.multipliers,
        slacks=slacks,
        bound_multipliers=(point.lower, point.upper),
        fixed=fixed,
    )


def _relaxation(bound: np.ndarray) -> np.ndarray:
    return BOUND_RELAXATION * np.maximum(1.0, np.abs(bound))


def _assemble(problem: Problem, point: Start, conditions: _Conditions) -> KktSystem:
    n, m, fixed = problem.num_free, problem.num_constraints, conditions.fixed
    sigmas = [
        np.where(fixed, 0.0, z / slack)
        for z, slack in zip(conditions.bound_multipliers, conditions.slacks, strict=True)
    ]
    h_rows, h_columns = problem.hessianstructure()
    jacobian = conditions.jacobian.tocoo()
    hessian = problem.hessian(point.free, conditions.multipliers, 1.0)
    hessian = np.where(fixed[h_rows] | fixed[h_columns], 0.0, hessian)
    derivatives = np.where(fixed[jacobian.col], 0.0, jacobian.data)
    # A row of the identity keeps a fixed unknown where it is.
    diagonal = sigmas[0] + sigmas[1] + fixed
    every = np.arange(n)
    matrix = sparse.csc_matrix(
        (
            np.concatenate([hessian, diagonal, derivatives]),
            (
                np.concatenate([h_rows, every, n + jacobian.row]),
                np.concatenate([h_columns, every, jacobian.col]),
            ),
        ),
        shape=(n + m, n + m),
    )
    return KktSystem(SymmetricFactors(matrix), sigmas[0], sigmas[1], fixed)


def _unscaled(conditions: _Conditions) -> OptimalityError:
    products = [
        np.maximum(np.abs(z * slack), -z)[~conditions.fixed]
        for z, slack in zip(conditions.bound_multipliers, conditions.slacks, strict=True)
    ]
    return OptimalityError(
        stationarity=_largest(conditions.lagrangian_gradient),
        feasibility=_largest(conditions.constraints),
        complementarity=_largest(np.concatenate(products)),
    )


def _scaled(conditions: _Conditions) -> OptimalityError:
    """Error E_0 of IPOPT's convergence test (Waechter and Biegler 2006, eq. 5)."""
    objective = float(gradient_scaling(_largest(conditions.gradient)))
    rows = gradient_scaling(abs(conditions.jacobian).max(axis=1).toarray().ravel())
    multipliers = np.abs(objective * conditions.multipliers / rows)
    bounds = np.abs(objective * np.concatenate(conditions.bound_multipliers))
    count = multipliers.size + bounds.size
    dual = _average_excess((multipliers.sum() + bounds.sum()) / count)
    unscaled = _unscaled(conditions)
    return OptimalityError(
        stationarity=objective * unscaled.stationarity / dual,
        feasibility=_largest(rows * conditions.constraints),
        complementarity=objective * unscaled.complementarity / _average_excess(bounds.mean()),
    )


def _average_excess(average: float) -> float:
    return max(SCALING_MAX_MULTIPLIER, float(average)) / SCALING_MAX_MULTIPLIER


def _largest(values: np.ndarray) -> float:
    return float(np.abs(values).max(initial=0.0))
