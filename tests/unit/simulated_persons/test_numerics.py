"""Numerics of the plants against independent answers."""

from dataclasses import replace

import numpy as np
import pytest
from arm import arm_from_angles, parameters
from scipy.integrate import solve_ivp
from scipy.optimize import minimize
from small_arm import small_geometry, small_motion, small_muscles

from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.model.rotations import quaternion_to_matrix, trial_to_pose
from simulated_persons.allocation import QUADRATIC_SHARE, Allocation, allocate
from simulated_persons.body import (
    Body,
    ExtraTorques,
    arm_force,
    extra_torques,
    linearise,
    no_extra_torques,
    rotate,
)
from simulated_persons.muscles import (
    Muscles,
    active_force,
    fibre_step,
    passive_force,
    resting_fibres,
)
from simulated_persons.simulation import (
    CONTROL_STEPS,
    STEP_S,
    TICK_S,
    Control,
    glenoid_axes,
    keep,
    simulate,
)
from simulated_persons.wish import make_wish

pytestmark = pytest.mark.unit


def muscles(count: int, strain: float = 0.05) -> Muscles:
    """The small arm's muscles in a number of simulations."""
    own = small_muscles()

    def rows(values: np.ndarray) -> np.ndarray:
        return np.tile(values, (count, 1))

    return Muscles(
        max_force=rows(own.max_isometric_force),
        optimal_length=rows(own.optimal_fibre_length),
        slack_length=rows(own.tendon_slack_length),
        tendon_strain=np.full((count, 3), strain),
        rise_s=rows(own.activation_time),
        fall_s=rows(own.deactivation_time),
        arm_scale=np.ones((count, 3)),
        end_force=np.ones((count, 3)),
    )


def arm_body(equations, count: int, extra: ExtraTorques | None = None) -> Body:
    weightless = pack(parameters(gravity=[0.0, -0.05, 0.0], mass_load=0.0, contact_stiffness=0.0))
    return Body(
        MuscleForces(equations, small_geometry()),
        np.tile(weightless, (count, 1)),
        muscles(count),
        extra or no_extra_torques(count),
    )


def test_allocation_is_the_minimum_that_a_general_solver_finds() -> None:
    rng = np.random.default_rng(1)
    matrix, target = rng.normal(size=(1, 2, 5)) * 10.0, np.array([[6.0, -4.0]])
    weight, cost = np.array([[1.0, 0.01]]), np.exp(rng.normal(size=(1, 5)))
    low, high = np.full((1, 5), 0.02), np.full((1, 5), 0.6)
    problem = Allocation(matrix, target, weight, cost, low, high)

    def objective(a: np.ndarray) -> float:
        effort = cost[0] * (a**3 / 3 + QUADRATIC_SHARE * a**2 / 2)
        return float(effort.sum() + 0.5 * weight[0] @ (matrix[0] @ a - target[0]) ** 2)

    best = minimize(objective, np.full(5, 0.3), bounds=[(0.02, 0.6)] * 5, tol=1e-12)
    found, _ = allocate(problem, np.zeros((1, 2)))
    assert objective(found[0]) <= best.fun + 1e-8
    assert np.all((found >= low) & (found <= high))


def test_fibres_end_in_equilibrium_with_their_tendons() -> None:
    own, activation = muscles(1), np.array([[0.2, 0.5, 0.0]])
    length = own.slack_length + 1.05 * own.optimal_length
    fibre = resting_fibres(own, length)
    for _ in range(400):
        fibre, force, _ = fibre_step(own, length, fibre, activation, 0.002)
    still = np.zeros_like(fibre)
    expected = activation * active_force(own, fibre, still) + passive_force(own, fibre)
    np.testing.assert_allclose(force, expected, rtol=1e-3, atol=0.05)
    stretch = length - fibre - own.slack_length
    assert np.all(stretch[0, :2] > 0.001)
    assert np.all(stretch < own.tendon_strain * own.slack_length)


def test_slope_of_the_force_is_its_derivative_by_length() -> None:
    own, activation = muscles(1), np.array([[0.3, 0.3, 0.3]])
    length = own.slack_length + 0.95 * own.optimal_length
    fibre = resting_fibres(own, length) - 0.001
    _, force, slope = fibre_step(own, length, fibre, activation, 0.002)
    _, moved, _ = fibre_step(own, length + 1e-6, fibre, activation, 0.002)
    # The falling limb of the force-length curve is left out of the slope on purpose.
    np.testing.assert_allclose((moved - force) / 1e-6, slope, rtol=0.1)


def test_shortening_muscles_pull_less_and_lengthening_ones_more() -> None:
    own = muscles(1)
    forces = [
        active_force(own, own.optimal_length, v * own.optimal_length) for v in (-5.0, 0.0, 5.0)
    ]
    assert np.all(forces[0] < forces[1])
    assert np.all(forces[1] < forces[2])
    np.testing.assert_allclose(forces[1], own.max_force)


def test_linearisation_is_that_of_the_equations(quaternion_equations) -> None:
    body = arm_body(quaternion_equations, 2)
    q = trial_to_pose(small_motion(12))[[3, 8]]
    u = 0.3 * np.random.default_rng(2).normal(size=(2, 10))
    acceleration = np.random.default_rng(3).normal(size=(2, 10))
    line = linearise(body, q, u)
    z = np.hstack([q, u, acceleration, np.zeros((2, 3))])
    expected = quaternion_equations.residual(z, body.parameters[0])[:, :10]
    found = line.load[:, :10] - np.einsum("nkl,nl->nk", line.mass, acceleration)
    np.testing.assert_allclose(found, expected, atol=1e-9)
    turn = 1e-6 * np.random.default_rng(4).normal(size=(2, 10))
    moved = linearise(body, rotate(q, turn), u).load[:, :10] - line.load[:, :10]
    expected = np.einsum("nkl,nl->nk", line.stiffness, turn)
    np.testing.assert_allclose(moved, expected, rtol=1e-3, atol=1e-8)


def test_rotation_keeps_norms_and_turns_about_child_axes() -> None:
    q = trial_to_pose(small_motion(12))[:1]
    turn = np.zeros((1, 10))
    turn[0, 6] = 0.4
    moved = rotate(q, turn)
    relative = quaternion_to_matrix(q[0, 8:12]).T @ quaternion_to_matrix(moved[0, 8:12])
    c, s = np.cos(0.4), np.sin(0.4)
    np.testing.assert_allclose(relative, [[1, 0, 0], [0, c, -s], [0, s, c]], atol=1e-12)


@pytest.mark.parametrize(("field", "size"), [("friction_Nm", 2.0), ("elbow_spring_Nm_rad", 5.0)])
def test_extra_torques_resist(quaternion_equations, field: str, size: float) -> None:
    extra = ExtraTorques(**{**vars(no_extra_torques(1)), field: np.array([size])})
    body = arm_body(quaternion_equations, 1, extra)
    q = trial_to_pose(small_motion(12))[-1:]
    u = np.ones((1, 10))
    torque = extra_torques(body, q, u)
    row = 6 if field == "friction_Nm" else 9
    assert torque[0, row] < -1.0
    assert not torque[0, :6].any()


def test_capsule_pushes_a_lifted_humerus_back(quaternion_equations) -> None:
    extra = ExtraTorques(
        **{
            **vars(no_extra_torques(1)),
            "capsule_Nm": np.array([2.0]),
            "capsule_onset_rad": np.array([0.3]),
        }
    )
    body = arm_body(quaternion_equations, 1, extra)
    q = trial_to_pose(small_motion(12))[-1:]
    torque = extra_torques(body, q, np.zeros((1, 10)))
    lifted = np.arccos(quaternion_to_matrix(q[0, 8:12])[1, 1])
    lower = rotate(q, 1e-3 * torque / np.linalg.norm(torque))
    assert np.arccos(quaternion_to_matrix(lower[0, 8:12])[1, 1]) < lifted
    expected = 2.0 * np.expm1(6.0 * (lifted - 0.3))
    np.testing.assert_allclose(np.linalg.norm(torque), expected, rtol=1e-9)


def test_glenoid_axes_are_a_rotation() -> None:
    axes = glenoid_axes(np.deg2rad([[6.5, 13.0], [0.0, 0.0]]))
    np.testing.assert_allclose(np.linalg.det(axes), 1.0)
    np.testing.assert_allclose(axes[1], np.eye(3), atol=1e-15)
    # Inferior inclination turns the normal down, anterior version forward (z is back).
    assert axes[0, 1, 0] < 0
    assert axes[0, 2, 0] < 0


def test_falling_arm_agrees_with_a_general_integrator(quaternion_equations) -> None:
    """Without muscle force, an arm let go falls as an adaptive Runge-Kutta method says."""
    body = arm_body(quaternion_equations, 1)
    force = replace(body.muscles, max_force=np.full((1, 3), 1e-9))
    body = replace(body, muscles=force)
    ones, ticks = np.ones((1, 3)), 30
    control = Control(ones, 0 * ones, ones, np.full(1, 0.01), np.full(1, 1e-9), np.zeros((1, 2)))
    start = trial_to_pose(small_motion(12))[6]
    tick = STEP_S * CONTROL_STEPS
    still = np.tile(start, (ticks + 1, 1, 1))
    wish = make_wish(still, tick, np.zeros((ticks + 1, 1)), ones)
    trace = simulate(body, control, wish)

    def rate(_: float, state: np.ndarray) -> np.ndarray:
        q, u = state[None, :13], state[None, 13:]
        line = linearise(body, q, u)
        gain = np.linalg.solve(line.mass[0], line.load[0, :10])
        return np.concatenate([quaternion_equations.rate_map(q)[0] @ u[0], gain])

    begin = np.concatenate([start, np.zeros(10)])
    exact = solve_ivp(rate, (0, ticks * tick), begin, method="LSODA", rtol=1e-8, atol=1e-10)
    moved = np.abs(exact.y[:13, -1] - start).max()
    assert moved > 0.02
    np.testing.assert_allclose(trace.q[-1, 0], exact.y[:13, -1], atol=0.05 * moved)
    norms = np.linalg.norm(trace.q[:, 0, :12].reshape(-1, 3, 4), axis=2)
    np.testing.assert_allclose(norms, 1.0, atol=1e-12)
    assert np.all((trace.excitation >= 0) & (trace.excitation <= 1))


def test_a_force_on_the_forearm_works_as_it_moves(quaternion_equations) -> None:
    """Its generalised forces are its power per unit speed, by mechanics of their own."""
    force, share = np.array([3.0, 20.0, -2.0]), 0.55
    extra = replace(
        no_extra_torques(2),
        arm_force_N=np.tile(force, (2, 1)),
        arm_force_share=np.array([share, 1.0]),
    )
    angles = small_motion(12)[[2, 9]]
    found = arm_force(arm_body(quaternion_equations, 2, extra), trial_to_pose(angles))
    for row, part in enumerate((share, 1.0)):
        own = parameters(mass_load=0.0)
        own["place"] = part * np.asarray(own["com_load"])
        for dof, speed in enumerate(np.eye(10)):
            _, velocity = arm_from_angles(own, angles[row], speed).at("forearm", "place")
            assert found[row, dof] == pytest.approx(velocity @ force, abs=1e-9)
        scapula = arm_from_angles(own, angles[row], np.zeros(10)).rotations[1]
        np.testing.assert_allclose(found[row, 10:], scapula.T @ force, atol=1e-9)


def kept_lift(equations, **changes):
    """A bent elbow that the small arm bends slowly on, against its springs, and the trace."""
    body = arm_body(equations, 1)
    body = replace(body, muscles=replace(body.muscles, **changes))
    ones, ticks = np.ones((1, 3)), 60
    control = Control(ones, 0 * ones, ones, np.full(1, 0.01), np.full(1, 1e-9), np.zeros((1, 2)))
    pose = np.tile(trial_to_pose(small_motion(12))[6], (ticks, 1))
    pose[:, 12] = 1.2 + np.linspace(0.0, 0.1, ticks)
    tired = np.linspace(0.0, 1.0, ticks)[:, None]
    wish = make_wish(pose[:, None], TICK_S, tired, body.muscles.end_force)
    return pose, keep(body, control, wish)


def test_a_movement_that_is_kept_is_done_exactly(quaternion_equations) -> None:
    pose, trace = kept_lift(quaternion_equations)
    np.testing.assert_array_equal(trace.q[:, 0], pose)
    # The elbow, which its muscles can move, gets what it needs; the girdle has no muscle here.
    assert np.abs(trace.missing_Nm[:, 0, 9]).max() < 0.02
    assert np.abs(trace.missing_Nm[:, 0, :6]).max() > 0.1


def test_tired_muscles_are_driven_harder_for_the_same_movement(quaternion_equations) -> None:
    _, fresh = kept_lift(quaternion_equations)
    _, tired = kept_lift(quaternion_equations, end_force=np.full((1, 3), 0.5))
    flexor = int(np.argmax(fresh.excitation[30:, 0].mean(axis=0)))
    ratio = tired.excitation[:, 0, flexor] / fresh.excitation[:, 0, flexor]
    assert ratio[3] == pytest.approx(1.0, abs=0.05)
    assert ratio[-3] > 1.6
    assert np.abs(tired.missing_Nm[:, 0, 9]).max() < 0.02
