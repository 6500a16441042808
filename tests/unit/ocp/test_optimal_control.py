"""The optimal control problem: derivatives by differences, opty's layout, cold and warm solves."""

from dataclasses import replace

import numpy as np
import pytest
from derivatives import assert_close, dense, differences
from scipy import sparse
from small_arm import (
    small_objective,
)
from small_problem import cold_guess, off_equalities, small_problem

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import quaternion_multiply
from scapulohumeral.ocp import problem as ocp_problem
from scapulohumeral.ocp.layout import REACTION_UNIT_N
from scapulohumeral.ocp.objective import Weights
from scapulohumeral.ocp.optimality.kkt import certificate
from scapulohumeral.ocp.problem import Bounds
from scapulohumeral.ocp.solving.scaling import start_scaling
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve

pytestmark = pytest.mark.unit

NODES = 5
# Euler angles have no norm and no anchor.
IN_QUATERNIONS = pytest.mark.parametrize("equations", ["quaternion"], indirect=True)


@pytest.fixture
def make(equations):
    """Function that builds the small problem with a Hessian mode."""

    def make(hessian="exact", nodes=NODES, stability=2.0, bounds=None, power=2.0):
        objective = replace(small_objective(equations.name, nodes, stability), effort_power=power)
        return small_problem(equations, objective, hessian, bounds=bounds)

    return make


@pytest.fixture
def point(make):
    """A free vector near the motion, off every equality."""
    problem = make()
    return off_equalities(problem.layout.join(cold_guess(problem, NODES)))


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_gradient_matches_differences(make, point, power):
    problem = make(power=power)
    expected = differences(lambda x: np.array(problem.objective(x)), point)
    assert_close(problem.gradient(point), expected, 1e-7)


def test_jacobian_matches_differences(make, point):
    problem = make()
    shape = (problem.num_constraints, problem.num_free)
    actual = dense(problem.jacobian(point), problem.jacobianstructure(), shape)
    assert_close(actual, differences(problem.constraints, point), 1e-7)


@pytest.mark.parametrize("power", [2.0, 3.0])
def test_exact_hessian_matches_differences(make, point, power):
    problem = make(power=power)
    multipliers = np.random.default_rng(4).normal(size=problem.num_constraints)
    shape = (problem.num_constraints, problem.num_free)
    structure = problem.jacobianstructure()

    def lagrangian_gradient(x):
        jacobian = sparse.csr_matrix((problem.jacobian(x), structure), shape=shape)
        return 0.7 * problem.gradient(x) + jacobian.T @ multipliers

    rows, columns = problem.hessianstructure()
    assert (rows >= columns).all()
    assert len(set(zip(rows.tolist(), columns.tolist(), strict=True))) == rows.size
    lower = dense(problem.hessian(point, multipliers, 0.7), (rows, columns), (point.size,) * 2)
    full = lower + np.tril(lower, -1).T
    assert_close(full, differences(lagrangian_gradient, point), 1e-6)


def test_lumped_hessian_is_the_exact_one_for_what_is_alike_at_all_nodes(make, point):
    exact, lumped = make(), make("lumped")
    rng = np.random.default_rng(5)
    multipliers = rng.normal(size=exact.num_constraints)
    lay = exact.layout

    def curvature(problem, change):
        lower = dense(
            problem.hessian(point, multipliers, 0.7), problem.hessianstructure(), (point.size,) * 2
        )
        return change @ (lower + np.tril(lower, -1).T) @ change

    for _ in range(5):
        level = rng.normal(size=(lay.trajectory_size // lay.nodes, 1))
        alike = np.zeros(point.size)
        alike[: lay.trajectory_size] = np.broadcast_to(level, (len(level), lay.nodes)).ravel()
        assert curvature(lumped, alike) == pytest.approx(curvature(exact, alike), rel=1e-9)
        other = rng.normal(size=point.size)
        assert curvature(lumped, other) != pytest.approx(curvature(exact, other), rel=1e-3)


def test_lumped_hessian_couples_nodes_by_rates_of_the_objective_only(make):
    lumped, gauss_newton = make("lumped"), make("gauss-newton")
    lay = lumped.layout

    def across(problem):
        rows, columns = problem.hessianstructure()
        inside = (rows < lay.trajectory_size) & (columns < lay.trajectory_size)
        pairs = zip(rows[inside].tolist(), columns[inside].tolist(), strict=True)
        return {(r, c) for r, c in pairs if r % lay.nodes != c % lay.nodes}

    assert across(lumped) == across(gauss_newton)


def test_gauss_newton_hessian_is_positive_semidefinite(make, point):
    problem = make("gauss-newton")
    multipliers = np.ones(problem.num_constraints)
    lower = dense(
        problem.hessian(point, multipliers, 1.0), problem.hessianstructure(), (point.size,) * 2
    )
    full = lower + np.tril(lower, -1).T
    assert np.linalg.eigvalsh(full).min() > -1e-9 * np.abs(full).max()


def test_free_vector_is_laid_out_as_opty_does(make, point):
    problem = make()
    x = problem.trajectory(point)
    states, inputs, _ = problem.parse_free(point)
    np.testing.assert_array_equal(states, np.hstack([x.q, x.u, x.a]).T)
    names = [f.__class__.__name__ for f in problem.collocator.unknown_input_trajectories]
    reaction = x.reaction[:, 1] / REACTION_UNIT_N
    np.testing.assert_allclose(inputs[names.index("R_y")], reaction, rtol=1e-15)
    np.testing.assert_array_equal(inputs[names.index("e_biceps")], x.e[:, 1])
    np.testing.assert_allclose(problem.layout.join(x), point, rtol=1e-15)


def test_bounds_reach_the_right_unknowns(make, point):
    problem = make()
    low, high = problem.layout.split(problem.lower_bound), problem.layout.split(problem.upper_bound)
    expected = {"a": (0, 1), "e": (0, 1), "reaction": (-5e3, 5e3), "u": (-40, 40)}
    for kind, (least, most) in expected.items():
        assert (getattr(low, kind) == least).all()
        assert (getattr(high, kind) == most).all()


@IN_QUATERNIONS
def test_clavicle_is_anchored_at_both_ends_only(make, point):
    problem = make()
    objective = problem.objective_function
    x = problem.trajectory(point)

    def cost(node):
        q = x.q.copy()
        q[node, 1] += 0.1
        moved = objective.terms(replace(x, q=q))["anchor"]
        return abs(moved - objective.terms(x)["anchor"])

    assert min(cost(0), cost(-1)) > 1e-3
    assert max(cost(node) for node in range(1, len(x.q) - 1)) == 0.0


@IN_QUATERNIONS
def test_anchor_has_the_slopes_of_the_authors_program(make, point):
    """They give each component the sum of the slopes of the squared distance, sin^2 of half the
    angle, times a whole interval."""
    problem = make()
    objective = problem.objective_function
    x = problem.trajectory(point)
    rest = x.q[0, :4] / np.linalg.norm(x.q[0, :4])
    turned = quaternion_multiply(rest, [np.cos(0.02), *(np.sin(0.02) * np.array([0.6, 0.0, 0.8]))])
    reference, q = objective.reference.copy(), x.q.copy()
    reference[:, -4:], q[0, :4] = rest, turned
    anchored, free = (
        replace(objective, reference=reference, weights=replace(objective.weights, anchor=anchor))
        for anchor in (1.0, 0.0)
    )
    moved = replace(x, q=q)
    slopes = (anchored.gradient(moved).q - free.gradient(moved).q)[0, :4]
    distance_slopes = 2.0 * (turned - (turned @ rest) * rest)
    np.testing.assert_allclose(slopes, objective.step * distance_slopes.sum(), rtol=0.03)


def test_chosen_bounds_reach_the_right_unknowns(make, equations):
    coordinates = equations.number_of_coordinates
    box = np.stack([-1.0 - np.arange(coordinates), 2.0 + np.arange(coordinates)])
    bounds = Bounds(compression=(0.0, 1600.0), coordinates=box, ends_at_rest=True)
    problem = make(bounds=bounds)
    low, high = problem.layout.split(problem.lower_bound), problem.layout.split(problem.upper_bound)
    np.testing.assert_array_equal(low.q, np.tile(box[0], (NODES, 1)))
    np.testing.assert_array_equal(high.q, np.tile(box[1], (NODES, 1)))
    np.testing.assert_allclose(high.reaction[0], [1600.0, 5e3, 5e3])
    np.testing.assert_allclose(low.reaction[0], [0.0, -5e3, -5e3])
    np.testing.assert_array_equal(low.u[[0, -1]], 0.0)
    np.testing.assert_array_equal(high.u[[0, -1]], 0.0)
    assert (high.u[1:-1] == 40.0).all()


def test_terms_sum_to_the_objective(make, point):
    problem = make()
    terms = problem.objective_function.terms(problem.trajectory(point))
    assert "stability" in terms
    assert sum(terms.values()) == pytest.approx(problem.objective(point), rel=1e-14)


def solved(make, strategy, start, **options):
    return solve(
        lambda mode: make(mode, nodes=12, stability=0.0),
        start,
        SolverSettings(strategy=strategy, **options),
    )


@pytest.fixture
def cold_start(make):
    problem = make(nodes=12, stability=0.0)
    return Start(problem.layout.join(cold_guess(problem, 12)))


@pytest.mark.parametrize("unit", [10.0, 1000.0])
def test_optimum_is_one_whatever_the_unit_of_the_reaction(make, cold_start, monkeypatch, unit):
    """The optimum found in one unit is certified in another, with its multipliers turned over."""
    problem = make(nodes=12, stability=0.2)
    start = Start(problem.layout.join(make(nodes=12).trajectory(cold_start.free)))
    settings = SolverSettings(tolerance=1e-9)
    result = solve(lambda mode: make(mode, nodes=12, stability=0.2), start, settings)
    assert result.optimal, result.message
    point, ratio = result.point, unit / REACTION_UNIT_N
    x = problem.trajectory(point.free)

    monkeypatch.setattr(ocp_problem, "REACTION_UNIT_N", unit)
    other = make(nodes=12, stability=0.2)
    layout, nq = other.layout, problem.layout.coordinates
    assert layout.reaction_unit_N == unit
    rows = slice((nq + 10) * (layout.nodes - 1), (nq + 13) * (layout.nodes - 1))
    multipliers = point.multipliers.copy()
    multipliers[rows] *= ratio
    lower, upper = point.lower.copy(), point.upper.copy()
    places = layout.index("reaction", np.arange(3), np.arange(layout.nodes))
    lower[places] *= ratio
    upper[places] *= ratio
    same = Start(layout.join(x), multipliers, lower, upper)
    assert other.objective(same.free) == pytest.approx(result.objective, rel=1e-12)
    proof = certificate(other, same)
    assert proof.unscaled.stationarity < 1e-6 * max(ratio, 1.0)
    assert proof.unscaled.feasibility < 1e-7 * max(1.0 / ratio, 1.0)
    assert proof.reduced_hessian_positive
    for name in ("lower_bound", "upper_bound"):
        bounds = [p.layout.split(getattr(p, name)).reaction for p in (problem, other)]
        np.testing.assert_allclose(*bounds, rtol=1e-14)


def test_automatic_and_limited_memory_reach_the_same_optimum(make, cold_start):
    automatic = solved(make, "automatic", cold_start)
    assert automatic.optimal, automatic.message
    assert automatic.constraint_violation <= 1e-6
    other = solved(make, "limited-memory", cold_start, max_iterations=3000)
    assert other.optimal, other.message
    assert other.objective == pytest.approx(automatic.objective, rel=1e-4)


@IN_QUATERNIONS
def test_quaternions_keep_their_norm_at_all_nodes(make, cold_start):
    result = solved(make, "automatic", cold_start)
    x = make(nodes=12, stability=0.0).trajectory(result.point.free)
    norms = [np.linalg.norm(x.q[:, i : i + 4], axis=1) for i in (0, 4, 8)]
    np.testing.assert_allclose(norms, 1.0, atol=1e-10)


def test_warm_start_takes_few_iterations(make, cold_start):
    first = solved(make, "automatic", cold_start)
    again = solved(make, "automatic", first.point)
    assert again.optimal
    assert again.iterations < first.iterations / 2
    assert again.objective == pytest.approx(first.objective, rel=1e-6)


def test_a_far_start_ends_at_the_same_barrier_as_a_warm_one(equations, make, cold_start):
    """Its own scaling holds in all phases: that of where Gauss-Newton ends is another one."""
    objective = small_objective(equations.name, 12, 0.0)
    objective = replace(objective, weights=replace(objective.weights, trajectory=2e4))

    def steep(mode):
        return small_problem(equations, objective, mode)

    neighbour = solved(make, "automatic", cold_start).point
    away = replace(neighbour, free=neighbour.free - 0.05)
    same = SolverSettings(tolerance=1e-9, barrier_target=1e-3)
    warm, far = (solve(steep, away, replace(same, far=far)) for far in (False, True))
    assert warm.optimal
    assert far.optimal
    assert [step["phase"] for step in (*warm.history[:1], far.history[0], far.history[-1])] == [
        "exact",
        "gauss-newton",
        "exact",
    ]
    first, last = (start_scaling(steep("exact"), free)[0] for free in (away.free, far.point.free))
    assert abs(first / last - 1.0) > 0.2
    np.testing.assert_allclose(far.point.free, warm.point.free, atol=1e-6)


def test_iteration_limit_counts_as_failure(make, cold_start):
    result = solved(make, "exact", cold_start, max_iterations=2)
    assert not result.optimal
    assert "iteration" in result.message.lower()


def test_nonsense_settings_are_refused():
    with pytest.raises(ConfigError, match="choose one of"):
        SolverSettings(strategy="newton")
    with pytest.raises(ConfigError, match="tolerance"):
        SolverSettings(tolerance=2.0)
    with pytest.raises(ConfigError, match="negative"):
        Weights(activation=-1.0)
    with pytest.raises(ConfigError, match="reaction_rate"):
        Weights(reaction_rate=0.0)
    with pytest.raises(ConfigError, match="unknown segment"):
        Weights(tracked=("thorax",))
