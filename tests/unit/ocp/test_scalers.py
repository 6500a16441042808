"""Muscle scalers as unknowns and the EMG term: derivatives, layout, recovery of known scalers."""

from dataclasses import replace

import numpy as np
import pytest
from derivatives import assert_close, dense, differences
from scipy import sparse
from small_arm import (
    STEP,
    small_forces,
    small_motion,
    small_muscles,
    small_objective,
    small_parameters,
)
from small_problem import cold_guess, off_equalities, small_problem

from scapulohumeral.dynamics.hill import fibre_length_derivatives, force_derivatives
from scapulohumeral.emg.channels import channel_means
from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.rotations import pose_to_trial
from scapulohumeral.ocp.emg_term import EmgTerm
from scapulohumeral.ocp.objective import Trajectory, Weights
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solving import initial_guess
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve

pytestmark = pytest.mark.unit

NODES = 5
# Two elements in one group, one in another; the names make opty sort them the other way round.
GROUPS = Scalers(("upper", "lower"), np.array([[1, 1, 0], [0, 0, 1]], dtype=bool))
VALUES = np.array([[0.8, 1.3], [1.1, 0.9]])
CHANNELS = channel_means(np.array([[1, 1, 0], [0, 1, 0], [0, 0, 1]], dtype=bool))


def emg_objective(name, nodes, weights=None):
    """The small objective with EMG and parameters, silent at one node."""
    objective = small_objective(name, nodes, stability=2.0)
    activity = np.ones(nodes)
    activity[1] = 0.0
    envelopes = np.random.default_rng(6).random((nodes, len(CHANNELS)))
    weights = weights or replace(objective.weights, emg=7.0, parameters=3.0)
    return replace(objective, weights=weights, emg=EmgTerm(CHANNELS, envelopes, activity))


@pytest.fixture
def make(equations):
    """Function that builds the small problem with scalers and EMG."""

    def make(hessian="exact", scalers=GROUPS, objective=None):
        objective = objective or emg_objective(equations.name, NODES)
        return small_problem(equations, objective, hessian, scalers=scalers)

    return make


@pytest.fixture
def point(make):
    """A free vector near the motion, off every equality."""
    problem = make()
    guess = replace(cold_guess(problem, NODES), scalers=VALUES)
    return off_equalities(problem.layout.join(guess))


def full_hessian(problem, point, multipliers):
    rows, columns = problem.hessianstructure()
    assert (rows >= columns).all()
    assert len(set(zip(rows.tolist(), columns.tolist(), strict=True))) == rows.size
    lower = dense(problem.hessian(point, multipliers, 0.7), (rows, columns), (point.size,) * 2)
    return lower + np.tril(lower, -1).T


def test_gradient_matches_differences(make, point):
    problem = make()
    expected = differences(lambda x: np.array(problem.objective(x)), point)
    assert_close(problem.gradient(point), expected, 1e-7)
    scalers = problem.layout.scaler_index
    assert_close(problem.gradient(point)[scalers], expected[scalers], 1e-7)


def test_jacobian_matches_differences(make, point):
    problem = make()
    shape = (problem.num_constraints, problem.num_free)
    actual = dense(problem.jacobian(point), problem.jacobianstructure(), shape)
    expected = differences(problem.constraints, point)
    assert_close(actual, expected, 1e-7)
    for column in problem.layout.scaler_index.ravel():
        assert_close(actual[:, column], expected[:, column], 1e-7)


def test_exact_hessian_matches_differences(make, point):
    problem = make()
    multipliers = np.random.default_rng(4).normal(size=problem.num_constraints)
    shape = (problem.num_constraints, problem.num_free)
    structure = problem.jacobianstructure()

    def lagrangian_gradient(x):
        jacobian = sparse.csr_matrix((problem.jacobian(x), structure), shape=shape)
        return 0.7 * problem.gradient(x) + jacobian.T @ multipliers

    actual = full_hessian(problem, point, multipliers)
    expected = differences(lagrangian_gradient, point)
    assert_close(actual, expected, 1e-6)
    # The kinds of unknowns differ by orders of magnitude: each block against its own scale.
    lay, every = problem.layout, np.arange(NODES)
    scalers = lay.scaler_index.ravel()
    for kind in ("x", "a", "e"):
        others = lay.index(kind, np.arange(len(lay.rows[kind])), every).ravel()
        block = np.ix_(scalers, others)
        np.testing.assert_allclose(
            actual[block], expected[block], atol=1e-6 * np.abs(expected[block]).max() + 1e-9
        )
    own = np.ix_(scalers, scalers)
    assert_close(actual[own], expected[own], 1e-6)


def test_gauss_newton_hessian_holds_the_objective_of_scalers_and_emg(make, point):
    problem = make("gauss-newton")
    hessian = full_hessian(problem, point, np.ones(problem.num_constraints))
    assert np.linalg.eigvalsh(hessian).min() > -1e-9 * np.abs(hessian).max()
    lay = problem.layout
    both = np.concatenate(
        [lay.scaler_index.ravel(), lay.index("e", np.arange(3), np.arange(1))[:, 0]]
    )
    expected = 0.7 * differences(problem.gradient, point)[np.ix_(both, both)]
    assert_close(hessian[np.ix_(both, both)], expected, 1e-7)


def test_scalers_stand_where_opty_puts_unknown_parameters(make, point):
    problem = make()
    assert problem.layout.size == problem.num_free == point.size
    names = [s.name for s in problem.collocator.unknown_parameters]
    assert names == sorted(["s_F_upper", "s_F_lower", "s_l_upper", "s_l_lower"])
    _, _, parameters = problem.parse_free(point)
    scalers = problem.trajectory(point).scalers
    assert parameters[names.index("s_F_upper")] == scalers[0, 0]
    assert parameters[names.index("s_l_lower")] == scalers[1, 1]
    # Reactions pass through newtons, which may cost the last digit.
    joined = problem.layout.join(problem.trajectory(point))
    np.testing.assert_allclose(joined, point, rtol=1e-15)
    low, high = (problem.trajectory(b).scalers for b in (problem.lower_bound, problem.upper_bound))
    np.testing.assert_array_equal(low, [[0.5, 0.5], [0.7, 0.7]])
    np.testing.assert_array_equal(high, [[1.5, 1.5], [1.3, 1.3]])


def test_constraints_are_those_of_scaled_muscles(make, point):
    problem = make()
    x = problem.trajectory(point)
    force, fibre = x.scalers[:, [0, 0, 1]]
    generic = small_muscles()
    scaled = replace(
        generic,
        max_isometric_force=generic.max_isometric_force * force,
        optimal_fibre_length=generic.optimal_fibre_length * fibre,
    )
    known = Problem(
        problem.collocation.forces,
        scaled,
        problem.collocation.parameters,
        problem.objective_function,
    )
    free = known.layout.join(replace(x, scalers=np.ones((2, 0))))
    np.testing.assert_array_equal(problem.constraints(point), known.constraints(free))


def test_muscles_outside_all_groups_keep_their_parameters():
    one = Scalers(("elbow",), np.array([[0, 0, 1]], dtype=bool))
    scaled, generic = one.apply(small_muscles(), np.array([[1.2], [0.8]])), small_muscles()
    np.testing.assert_array_equal(scaled.max_isometric_force[:2], generic.max_isometric_force[:2])
    assert scaled.max_isometric_force[2] == 1.2 * generic.max_isometric_force[2]
    assert scaled.optimal_fibre_length[2] == 0.8 * generic.optimal_fibre_length[2]
    np.testing.assert_array_equal(scaled.tendon_slack_length, generic.tendon_slack_length)


def test_fibre_length_derivatives_match_differences():
    rng = np.random.default_rng(8)
    muscles = small_muscles()
    length = muscles.tendon_slack_length + rng.uniform(0.6, 1.4, (4, 3)) * 0.11
    velocity, activation, h = rng.normal(0, 0.2, (4, 3)), rng.random((4, 3)), 1e-6

    def derivatives(shift):
        longer = replace(muscles, optimal_fibre_length=muscles.optimal_fibre_length + shift)
        d = force_derivatives(length, velocity, longer)
        values = {
            "first": d.active * activation + d.passive,
            "l": d.active_l * activation + d.passive_l,
            "v": d.active_v * activation,
            "active": d.active,
        }
        by_length = fibre_length_derivatives(d, activation, length, velocity, longer)
        return values | {"second": by_length.first}, by_length

    (after, _), (before, _), (_, actual) = (derivatives(s) for s in (h, -h, 0.0))
    for name in after:
        assert_close(getattr(actual, name), (after[name] - before[name]) / (2 * h), 1e-6)


def test_emg_term_by_hand():
    # Two nodes 0.04 s apart, one of them silent; channel of two elements with means 0.4 and 0.6.
    objective = emg_objective("euler", 2, Weights(emg=5.0, parameters=2.0))
    emg = EmgTerm(
        channel_means(np.array([[True, True, False]])), np.array([[0.3], [0.2]]), np.array([1, 0])
    )
    x = Trajectory(
        q=small_motion(2),
        u=np.zeros((2, 10)),
        a=np.zeros((2, 3)),
        e=np.array([[0.2, 0.6, 0.9], [0.5, 0.7, 0.1]]),
        reaction=np.zeros((2, 3)),
        scalers=np.array([[1.1], [0.8]]),
    )
    terms = replace(objective, emg=emg).terms(x)
    assert terms["emg"] == pytest.approx(5.0 * 0.5 * STEP * (0.4 - 0.3) ** 2, rel=1e-12)
    assert terms["parameters"] == pytest.approx(2.0 * (0.1**2 + 0.2**2), rel=1e-12)


def solved(equations, muscles, objective, scalers=None):
    """Optimum of the small problem on the mesh of an objective, from scalers of one."""
    parts = small_forces(equations), muscles, small_parameters()
    guess = initial_guess.from_motion(
        *parts, small_motion(len(objective.reference)), objective.step
    )
    if scalers:
        guess = replace(guess, scalers=np.ones((2, len(scalers.names))))

    def problem(mode):
        return Problem(*parts, objective, mode, scalers=scalers)

    exact = problem("exact")
    result = solve(problem, Start(exact.layout.join(guess)), SolverSettings(tolerance=1e-8))
    assert result.optimal, result.message
    return exact.trajectory(result.point.free)


def test_calibration_recovers_the_scalers_behind_a_motion(equations):
    nodes, little = 12, 1e-7
    phase = np.linspace(0, 2 * np.pi, nodes)[:, None] + np.array([0.0, 1.0, 2.0])
    weights = Weights(
        trajectory=1.0,
        activation=little,
        regularisation=little,
        reaction_rate=1e-4 * little,
        excitation_rate=little,
        emg=1e4,
    )
    plant = replace(
        small_objective(equations.name, nodes, 0.0),
        weights=weights,
        step=0.02,
        emg=EmgTerm(np.eye(3), 0.2 + 0.1 * np.sin(phase), np.ones(nodes)),
    )
    moved = solved(equations, GROUPS.apply(small_muscles(), VALUES), plant)
    angles = moved.q if equations.name == "euler" else pose_to_trial(moved.q)
    calibration = replace(
        plant,
        reference=plant.errors.reference(angles, 0.5),
        weights=replace(weights, trajectory=1e4),
        emg=replace(plant.emg, envelopes=moved.e),
    )
    found = solved(equations, small_muscles(), calibration, GROUPS)
    np.testing.assert_allclose(found.scalers, VALUES, rtol=2e-3)


def test_nonsense_is_refused(equations):
    with pytest.raises(ConfigError, match="each name may stand once"):
        Scalers(("a", "a"), np.eye(2, dtype=bool))
    with pytest.raises(ConfigError, match="muscle 1 belongs to the groups a, b"):
        Scalers(("a", "b"), np.array([[1, 1], [0, 1]], dtype=bool))
    with pytest.raises(ConfigError, match="group b has no muscle elements"):
        Scalers(("a", "b"), np.array([[1, 1], [0, 0]], dtype=bool))
    with pytest.raises(ConfigError, match="members of shape"):
        Scalers(("a",), np.eye(2, dtype=bool))
    with pytest.raises(ConfigError, match="bounds"):
        Scalers(("a",), np.ones((1, 1), dtype=bool), fibre_bounds=(0.0, 1.0))
    with pytest.raises(ConfigError, match="channel 1 has no"):
        channel_means(np.array([[True], [False]]))
    with pytest.raises(DataError, match="channel 0 at node 1"):
        EmgTerm(np.eye(1), np.array([[0.1], [np.nan]]), np.ones(2))
    with pytest.raises(DataError, match="one column per channel"):
        EmgTerm(np.eye(2), np.zeros((2, 1)), np.ones(2))
    objective = small_objective(equations.name, NODES, 0.0)
    with pytest.raises(ConfigError, match="there is no EMG"):
        replace(objective, weights=Weights(emg=1.0))
    with pytest.raises(ConfigError, match="resample"):
        replace(objective, emg=EmgTerm(np.eye(3), np.zeros((2, 3)), np.ones(2)))
    other = EmgTerm(np.eye(2), np.zeros((NODES, 2)), np.ones(NODES))
    with pytest.raises(ConfigError, match="channels name 2 muscles, the model has 3"):
        small_problem(equations, replace(objective, weights=Weights(emg=1.0), emg=other))
