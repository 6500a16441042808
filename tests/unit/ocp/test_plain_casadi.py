"""The transcription by CasADi alone is the same problem as ours."""

import casadi as ca
import numpy as np
import pytest
from cached_equations import built_equations
from small_arm import small_objective
from small_problem import small_problem

from scapulohumeral.ocp.plain_casadi import transcribe

pytestmark = pytest.mark.unit

NODES = 4


@pytest.fixture
def functions(equations, equations_folder) -> dict:
    """Equations as expressions, not compiled."""
    folder = built_equations(equations.name, equations_folder)
    names = ("residual", "features")
    return {name: ca.Function.load(str(folder / f"{name}.casadi")) for name in names}


def test_objective_and_constraints_are_ours(equations, functions):
    problem = small_problem(equations, small_objective(equations.name, NODES, stability=2.0))
    plain = transcribe(problem, functions)
    free = np.random.default_rng(5).normal(0.3, 0.2, size=problem.num_free)
    evaluate = ca.Function("evaluate", [plain.x], [plain.f, plain.g])
    value, constraints = evaluate(plain.unknowns(free))
    assert float(value) == pytest.approx(problem.obj(free), rel=1e-12)
    expected = plain.constraints(problem.con(free))
    np.testing.assert_allclose(np.array(constraints).ravel(), expected, atol=1e-10)


def test_its_second_derivatives_are_ours(equations, functions):
    problem = small_problem(equations, small_objective(equations.name, NODES, stability=2.0))
    plain = transcribe(problem, functions)
    free = np.random.default_rng(5).normal(0.3, 0.2, size=problem.num_free)
    multipliers = np.random.default_rng(6).normal(size=problem.num_constraints)
    g_multipliers = ca.MX.sym("multipliers", problem.num_constraints)
    hessian, _ = ca.hessian(plain.f + ca.dot(g_multipliers, plain.g), plain.x)
    evaluate = ca.Function("evaluate", [plain.x, g_multipliers], [hessian])
    theirs = np.array(evaluate(plain.unknowns(free), plain.constraints(multipliers)))
    ours = np.zeros_like(theirs)
    place = np.empty(problem.num_free, dtype=int)
    place[plain.unknowns(np.arange(problem.num_free)).astype(int)] = np.arange(problem.num_free)
    rows, columns = (place[index] for index in problem.hessianstructure())
    values = problem.hessian(free, multipliers, 1.0)
    np.add.at(ours, (np.maximum(rows, columns), np.minimum(rows, columns)), values)
    np.testing.assert_allclose(np.tril(theirs), ours, atol=1e-8 * np.abs(ours).max())
