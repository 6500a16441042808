"""Optimality certificates and derivatives of solutions, against dense algebra and re-solving."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from small_arm import (
    small_forces,
    small_motion,
    small_muscles,
    small_objective,
    small_parameters,
)
from small_problem import cold_guess

from scapulohumeral.dynamics.parameters import scalar_names
from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.ocp.optimality.kkt import assemble_kkt, certificate
from scapulohumeral.ocp.optimality.mumps import SymmetricFactors
from scapulohumeral.ocp.optimality.sensitivity import (
    condition_derivatives,
    parts_of,
    sensitivity,
)
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve

pytestmark = pytest.mark.unit

NODES = 8
PRECISE = SolverSettings(strategy="exact", tolerance=1e-10)
# Gravity forward and upward, strength of one muscle, weight of the effort, reference of an angle.
NOMINAL = np.array([0.01, -0.1, 500.0, 1.0, 0.0])
SHIFTS = np.array([0.005, 0.005, 5.0, 0.01, 1e-4])


def parts(equations, theta):
    """Muscles, dynamics parameters and objective for parameters."""
    parameters = small_parameters()
    names = scalar_names()
    parameters[[names.index("gravity_0"), names.index("gravity_1")]] = theta[:2]
    force = np.array([200.0, theta[2], 400.0])
    objective = small_objective(equations.name, NODES, 0.0)
    weights = replace(objective.weights, activation=theta[3])
    reference = objective.errors.reference(small_motion(NODES) + 0.05 + theta[4], 0.5)
    objective = replace(objective, weights=weights, reference=reference)
    return replace(small_muscles(), max_isometric_force=force), parameters, objective


@pytest.fixture(scope="module")
def equations(quaternion_equations):
    return quaternion_equations


@pytest.fixture(scope="module")
def make(equations):
    """Problem for parameters, in any Hessian mode."""

    def make(theta=NOMINAL, hessian="exact"):
        return Problem(small_forces(equations), *parts(equations, theta), hessian)

    return make


@pytest.fixture(scope="module")
def parts_for(equations, make):
    """The same without setting up opty."""
    nominal = parts_of(make())

    def parts_for(theta):
        muscles, parameters, objective = parts(equations, theta)
        collocation = replace(nominal.collocation, muscles=muscles, parameters=parameters)
        return replace(nominal, collocation=collocation, objective=objective)

    return parts_for


@pytest.fixture(scope="module")
def cold(make):
    problem = make()
    return Start(problem.layout.join(cold_guess(problem, NODES)))


def solved(make, start, theta=NOMINAL, settings=PRECISE):
    result = solve(lambda mode: make(theta, mode), start, settings)
    assert result.optimal, result.message
    return result


@pytest.fixture(scope="module")
def optimum(make, cold):
    """The solution for the nominal parameters."""
    return solved(make, cold, settings=replace(PRECISE, strategy="automatic")).point


@pytest.fixture(scope="module")
def kkt(make, optimum):
    return assemble_kkt(make(), optimum)


def lower_triangle(matrix):
    return sparse.csc_matrix(np.tril(matrix))


def saddle_matrix(curvatures):
    """KKT matrix of a quadratic with given curvatures in the plane x_1 + x_2 + x_3 = 0."""
    basis = np.linalg.qr(np.array([[1.0, 1, 1], [1, -1, 0], [1, 1, -2]]).T)[0]
    hessian = basis @ np.diag([-5.0, *curvatures]) @ basis.T
    return np.block([[hessian, np.ones((3, 1))], [np.ones((1, 3)), np.zeros((1, 1))]])


@pytest.mark.parametrize(
    ("curvatures", "inertia"), [((1, 2), (3, 1, 0)), ((1, -2), (2, 2, 0)), ((1, 0), (2, 1, 1))]
)
def test_inertia_tells_minimum_from_saddle(curvatures, inertia):
    assert SymmetricFactors(lower_triangle(saddle_matrix(curvatures))).inertia == inertia


def test_factors_solve_many_right_hand_sides_as_dense_algebra_does():
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(40, 40))
    matrix += matrix.T
    matrix[30:, 30:] = 0.0
    factors = SymmetricFactors(lower_triangle(matrix))
    values = np.linalg.eigvalsh(matrix)
    assert factors.inertia == ((values > 0).sum(), (values < 0).sum(), 0)
    right = rng.normal(size=(40, 130))
    np.testing.assert_allclose(factors.solve(right), np.linalg.solve(matrix, right), rtol=1e-8)
    np.testing.assert_array_equal(factors.solve(right[:, 0]).shape, (40,))


def test_singular_matrix_is_not_solved():
    with pytest.raises(SolveError, match="null pivot"):
        SymmetricFactors(lower_triangle(saddle_matrix((1, 0)))).solve(np.ones(4))


def test_optimum_is_certified(make, optimum):
    found = certificate(make(), optimum)
    assert found.kkt_error <= 1e-8
    assert found.reduced_hessian_positive
    assert found.holds


def test_inertia_is_that_of_the_reduced_hessian(make, optimum, kkt):
    problem = make()
    size = (problem.num_free, problem.num_free)
    lower = sparse.csr_matrix(
        (problem.hessian(optimum.free, optimum.multipliers, 1.0), problem.hessianstructure()), size
    ).toarray()
    hessian = lower + np.tril(lower, -1).T + np.diag(kkt.sigma_lower + kkt.sigma_upper)
    jacobian = sparse.csr_matrix(
        (problem.jacobian(optimum.free), problem.jacobianstructure()),
        (problem.num_constraints, problem.num_free),
    ).toarray()
    null_space = np.linalg.svd(jacobian)[2][problem.num_constraints :].T
    assert np.linalg.eigvalsh(null_space.T @ hessian @ null_space).min() > 0
    assert kkt.inertia == (problem.num_free, problem.num_constraints, 0)


def test_negative_barrier_target_is_refused():
    with pytest.raises(ConfigError, match="barrier target"):
        SolverSettings(barrier_target=-1e-5)


def test_unconverged_point_is_not_certified(make, cold):
    problem = make()
    stopped = solve(
        lambda mode: make(NOMINAL, mode), cold, SolverSettings("gauss-newton", max_iterations=2)
    )
    found = certificate(problem, stopped.point)
    assert found.kkt_error > 1e-3
    assert not found.holds


def test_wrong_multiplier_shows_in_the_stationarity(make, optimum):
    wrong = optimum.multipliers.copy()
    wrong[3] += 1e-3
    found = certificate(make(), replace(optimum, multipliers=wrong))
    assert found.unscaled.stationarity > 1e-4
    assert not found.holds


def test_points_and_problems_that_have_no_kkt_matrix_are_refused(make, cold, optimum):
    with pytest.raises(SolveError, match="no multipliers"):
        certificate(make(), cold)
    with pytest.raises(ConfigError, match="gauss-newton"):
        assemble_kkt(make(hessian="gauss-newton"), optimum)
    beyond = optimum.free.copy()
    beyond[make().layout.index("a", np.array([0]), 2)] = -0.01
    with pytest.raises(SolveError, match="beyond its lower bound"):
        certificate(make(), replace(optimum, free=beyond))


def test_derivatives_agree_with_solving_again(make, optimum, kkt, parts_for):
    found = sensitivity(kkt, condition_derivatives(kkt, optimum, parts_for, NOMINAL))
    for k, shift in enumerate(SHIFTS):
        ends = [
            solved(make, optimum, NOMINAL + s * np.eye(len(SHIFTS))[k]).point
            for s in (shift, -shift)
        ]
        for kind in ("free", "multipliers"):
            again = (getattr(ends[0], kind) - getattr(ends[1], kind)) / (2 * shift)
            error = np.linalg.norm(getattr(found, kind)[:, k] - again)
            assert error < 0.01 * np.linalg.norm(again), (k, kind)


def test_smoothed_derivatives_agree_with_solving_again(make, optimum, parts_for):
    smooth = replace(PRECISE, barrier_target=1e-4)
    point = solved(make, optimum, settings=smooth).point
    found = certificate(make(), point)
    assert found.unscaled.complementarity == pytest.approx(1e-4, rel=1e-3)
    assert found.weakly_active_bounds == 0
    kkt = assemble_kkt(make(), point)
    first = condition_derivatives(kkt, point, parts_for, NOMINAL)[:, 1:2]
    shift = np.array([0.0, 0.02, 0.0, 0.0, 0.0])
    ends = [solved(make, point, NOMINAL + s, smooth).point.free for s in (shift, -shift)]
    again = (ends[0] - ends[1]) / 0.04
    error = np.linalg.norm(sensitivity(kkt, first).free[:, 0] - again)
    assert error < 0.01 * np.linalg.norm(again)


class Pinned(Problem):
    """A problem that holds some unknowns at values, by equal bounds."""

    def __init__(self, indices, values, *arguments):
        self.pins = indices, values
        super().__init__(*arguments)

    def _take(self, set_up, collocation):
        super()._take(set_up, collocation)
        indices, values = self.pins
        self.lower_bound[indices] = self.upper_bound[indices] = values


@pytest.fixture
def elbow(make):
    """Positions of the elbow angle at two nodes."""
    return make().layout.index("x", np.array([12]), np.array([[3, 6]])).ravel()


@pytest.fixture
def pin(equations, optimum, elbow):
    """Function that solves with the elbow off its optimum at both nodes."""

    def pin(*shift):
        def make(mode):
            values = optimum.free[elbow] + shift
            return Pinned(elbow, values, small_forces(equations), *parts(equations, NOMINAL), mode)

        free = optimum.free.copy()
        free[elbow] += shift
        result = solve(make, replace(optimum, free=free), PRECISE)
        assert result.optimal, result.message
        return make("exact"), result

    return pin


def test_fixed_unknowns_do_not_move(pin, elbow, parts_for):
    problem, result = pin(0.02, -0.02)
    found = certificate(problem, result.point)
    assert found.holds
    kkt = assemble_kkt(problem, result.point)
    derivatives = condition_derivatives(kkt, result.point, parts_for, NOMINAL)
    assert not sensitivity(kkt, derivatives).free[elbow].any()


def test_a_bound_that_moves_takes_active_unknowns_along(make, optimum, kkt):
    nominal = parts_of(make())
    active = np.flatnonzero(optimum.lower > 1e-3)
    assert active.size > 3

    def raised(theta):
        return replace(nominal, lower=nominal.lower + theta[0])

    derivatives = condition_derivatives(kkt, optimum, raised, np.zeros(1))
    moved = sensitivity(kkt, derivatives).free[active, 0]
    np.testing.assert_allclose(moved, 1.0, rtol=1e-3)
