"""The same problem the way CasADi's manual shows: symbols in, all derivatives by CasADi.

An oracle for objective and constraints, and a peer of the benchmark. Not used by any solve.

Letters: N nodes, V variables of a node in the order of the rows of opty's free vector.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.ocp.cost_terms import stability_errors
from scapulohumeral.ocp.problem import Problem


@dataclass(frozen=True, eq=False)
class PlainProblem:
    """A nonlinear program as CasADi's `nlpsol` takes it.

    Attributes
    ----------
    x : (V N,) unknowns node by node; f : objective
    g : equations interval by interval, then unit norms at the first node
    nodes : N; instances : number of unit norms
    """

    x: ca.MX
    f: ca.MX
    g: ca.MX
    nodes: int
    instances: int

    def unknowns(self, free: np.ndarray) -> np.ndarray:
        """A free vector of opty in the order of x."""
        return free.reshape(-1, self.nodes).ravel(order="F")

    def constraints(self, values: np.ndarray) -> np.ndarray:
        """Constraints of opty in the order of g."""
        split = len(values) - self.instances
        rows = values[:split].reshape(-1, self.nodes - 1)
        return np.concatenate([rows.ravel(order="F"), values[split:]])


def transcribe(problem: Problem, functions: Mapping[str, ca.Function]) -> PlainProblem:
    """A problem without unknown parameters and EMG as one expression of its unknowns.

    Parameters
    ----------
    problem : the same problem
    functions : `residual` and `features` of the formulation, as expressions rather than compiled
    """
    layout = problem.layout
    nodes, size = layout.nodes, layout.trajectory_size // layout.nodes
    table = ca.MX.sym("x", size, nodes)
    equations = _interval(problem, functions).map(nodes - 1)
    cost = _node_cost(problem).map(nodes)
    rates = _rate_cost(problem).map(nodes - 1)
    objective, weights = problem.objective_function, problem.objective_function._error_weights
    quadrature = objective._quadrature[None]
    f = ca.sum2(cost(table, objective.reference.T, weights.T, quadrature))
    f += ca.sum2(rates(table[:, :-1], table[:, 1:]))
    g = ca.vec(equations(table[:, :-1], table[:, 1:]))
    norms = [
        ca.sumsqr(table[coordinates.tolist(), 0]) - 1
        for coordinates in problem.lagrangian.instance_norm
    ]
    return PlainProblem(ca.vec(table), f, ca.vertcat(g, *norms), nodes, len(norms))


def _split(problem: Problem, node: ca.SX) -> tuple[ca.SX, ...]:
    """q, u, a, e and reaction [N] of a node."""
    layout = problem.layout
    x = node[layout.rows["x"].tolist()]
    a, e, reaction = (node[layout.rows[kind].tolist()] for kind in ("a", "e", "reaction"))
    nq = layout.coordinates
    return x[:nq], x[nq:], a, e, layout.reaction_unit_N * reaction


def _interval(problem: Problem, functions: Mapping[str, ca.Function]) -> ca.Function:
    """Equations of motion of an interval by the midpoint rule."""
    c = problem.collocation
    size = problem.layout.trajectory_size // problem.layout.nodes
    left, right = ca.SX.sym("left", size), ca.SX.sym("right", size)
    q, u, a, e, reaction = _split(problem, (left + right) / 2)
    dq, du, da, _, _ = _split(problem, (right - left) / c.step)
    rate_map = _rate_map(problem, q)
    motion = functions["residual"](ca.vertcat(q, u, du, reaction), c.parameters)
    motion += _muscle_forces(problem, functions)(q, u, a)
    rise, fall = 1.0 / c.muscles.activation_time, 1.0 / c.muscles.deactivation_time
    activation = da - (ca.DM(fall) + ca.DM(rise - fall) * e) * (e - a)
    rows = ca.vertcat(dq - rate_map @ u, motion / ca.DM(c._row_units), activation)
    return ca.Function("interval", [left, right], [rows], {"cse": True})


def _rate_map(problem: Problem, q: ca.SX) -> ca.SX:
    dynamics = problem.collocation.forces.dynamics
    linear = sum(
        (ca.DM(dynamics.kinematics_linear[:, :, k]) * q[k] for k in range(q.numel())),
        ca.SX.zeros(1, 1),
    )
    return ca.sparsify(ca.DM(dynamics.kinematics_constant)) + linear


def _muscle_forces(problem: Problem, functions: Mapping[str, ca.Function]) -> ca.Function:
    """Generalised muscle forces (13,): by the speeds [N m], then on the humeral head [N]."""
    c = problem.collocation
    geometry = c.forces.geometry
    q, u = ca.SX.sym("q", c.layout.coordinates), ca.SX.sym("u", 10)
    a = ca.SX.sym("a", c.layout.muscles)
    rate_map = _rate_map(problem, q)
    variables = ca.vertcat(*(q[k] for k in c.forces.dynamics.polynomial_variables))
    monomials = [_monomial(variables, row) for row in geometry.exponents.tolist()]
    rotations, _ = functions["features"](q)
    feature = ca.vertcat(*monomials, rotations)
    squared = ca.DM(geometry.squared.astype(float))
    y = ca.sparsify(ca.DM(geometry.length)) @ feature
    length = ca.if_else(squared, ca.sqrt(y), y)
    velocity = ca.jtimes(length, q, rate_map @ u)
    tension = _tension(c.muscles, length, velocity, a)
    moments = rate_map.T @ ca.jtimes(length, q, tension, True)
    pull = ca.if_else(squared, tension / length, tension)
    heads = [pull.T @ (ca.sparsify(ca.DM(d)) @ feature) for d in geometry.translation]
    return ca.Function("muscles", [q, u, a], [-ca.vertcat(moments, *heads)], {"cse": True})


def _monomial(variables: ca.SX, exponents: list[int]) -> ca.SX:
    """Product of powers of the variables."""
    result = ca.SX(1)
    for k, exponent in enumerate(exponents):
        for _ in range(exponent):
            result *= variables[k]
    return result


def _tension(muscles: MuscleParameters, length: ca.SX, velocity: ca.SX, activation: ca.SX) -> ca.SX:
    c, lopt = muscles.constants, ca.DM(muscles.optimal_fibre_length)
    x = (length - ca.DM(muscles.tendon_slack_length)) / lopt - 1
    s = c.d2 * velocity / (c.max_velocity * lopt) + c.d3
    active = ca.exp(-(x**2) / c.gaussian_width)
    active *= c.d1 * ca.log(s + ca.sqrt(s**2 + 1)) + c.d4
    passive = ca.exp(c.passive_stiffness / c.passive_strain * x) - 1
    share = ca.DM(muscles.capacity) * active * activation + passive / np.expm1(c.passive_stiffness)
    return ca.DM(muscles.max_isometric_force) * share


def _node_cost(problem: Problem) -> ca.Function:
    """Tracking, effort and stability at a node."""
    objective = problem.objective_function
    size = problem.layout.trajectory_size // problem.layout.nodes
    node = ca.SX.sym("node", size)
    reference = ca.SX.sym("reference", objective.reference.shape[1])
    weights, quadrature = ca.SX.sym("weights", len(objective.errors.groups)), ca.SX.sym("h")
    q, _, a, _, reaction = _split(problem, node)
    errors, _, _ = objective.errors.function.function(q, reference, 0)
    effort = ca.dot(ca.DM(np.broadcast_to(objective.effort, a.numel())), a**2)
    cost = ca.dot(weights, errors**2) + quadrature * objective.weights.activation * effort
    if objective.weights.stability > 0:
        ratio, _, _ = stability_errors().function(reaction, ca.DM(objective.glenoid), 0)
        shares = objective.weights.stability * np.array([objective.superior_inferior_share, 1.0])
        cost += quadrature * ca.dot(ca.DM(shares), ratio**2)
    return ca.Function("node_cost", [node, reference, weights, quadrature], [cost])


def _rate_cost(problem: Problem) -> ca.Function:
    """Squared rates of speeds, excitations and reactions over an interval."""
    size = problem.layout.trajectory_size // problem.layout.nodes
    left, right = ca.SX.sym("left", size), ca.SX.sym("right", size)
    _, u, _, e, reaction = _split(problem, right - left)
    w = problem.objective_function.weights
    cost = w.regularisation * ca.sumsqr(u) + w.excitation_rate * ca.sumsqr(e)
    cost += w.reaction_rate * ca.sumsqr(reaction)
    return ca.Function("rate_cost", [left, right], [cost / problem.objective_function.step])
