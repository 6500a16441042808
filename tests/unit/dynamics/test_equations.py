"""The equations of motion against energies, forces by hand, and each other."""

import pickle

import numpy as np
import pytest
from arm import (
    RIGID,
    SEQUENCES,
    arm,
    arm_from_angles,
    conoid_energy,
    contact_energy,
    energy,
    exponential_spring_energy,
    gravity_energy,
    kinetic_energy,
    parameters,
    spring_energy,
    stop_energy,
)
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.model.rotations import euler_rate_jacobian, quaternion_to_matrix, trial_to_pose

pytestmark = pytest.mark.unit

COLUMNS = [slice(3 * k, 3 * k + 3) for k in range(3)]


def random_angles(count, seed=1):
    """Joint angles (count, 10) [rad] in the middle of the range, away from gimbal lock."""
    rng = np.random.default_rng(seed)
    middle = np.array([-0.5, 0.2, 0.3, 0.8, 0.1, 0.1, 0.4, 0.8, 0.2, 0.9])
    return middle + rng.uniform(-0.3, 0.3, (count, 10))


def coordinates(equations, angles):
    """Generalised coordinates of joint angles."""
    return trial_to_pose(angles) if equations.name == "quaternion" else angles


def to_speeds(equations, angles, w):
    """Generalised speeds (N, 10) of relative angular velocities w (N, 10) in child axes."""
    if equations.name == "quaternion":
        return w
    speeds = w.copy()
    for columns, sequence in zip(COLUMNS, SEQUENCES, strict=True):
        jacobian = euler_rate_jacobian(angles[:, columns], sequence)
        speeds[:, columns] = np.linalg.solve(jacobian, w[:, columns, None])[..., 0]
    return speeds


def to_child_axes(equations, angles, torque):
    """Torques (N, 10) about child axes, from those conjugate to the generalised speeds."""
    if equations.name == "quaternion":
        return torque
    result = torque.copy()
    for columns, sequence in zip(COLUMNS, SEQUENCES, strict=True):
        jacobian = euler_rate_jacobian(angles[:, columns], sequence).transpose(0, 2, 1)
        result[:, columns] = np.linalg.solve(jacobian, torque[:, columns, None])[..., 0]
    return result


def accelerations(equations, q, u, p):
    """Rates of the speeds and joint reaction, (N, 13): the equations are linear in them."""
    z = np.hstack([q, u, np.zeros((len(q), 13))])
    matrix = equations.jacobian(z, p)[:, :, -13:]
    return -np.linalg.solve(matrix, equations.residual(z, p)[..., None])[..., 0]


def static_torque(equations, angles, **changes):
    """Residual without motion and reaction, (N, 13), torques about child axes."""
    q = coordinates(equations, angles)
    z = np.hstack([q, np.zeros((len(q), 23))])
    residual = equations.residual(z, pack(parameters(**changes)))
    return np.hstack([to_child_axes(equations, angles, residual[:, :10]), residual[:, 10:]])


def energy_slope(angles, potential, p):
    """Derivatives (N, 10) of a potential for small turns about child axes, elbow last."""
    h, slopes = 1e-6, np.zeros((len(angles), 10))
    for row, pose in zip(slopes, angles, strict=True):
        base = [
            Rotation.from_euler(sequence, pose[columns])
            for columns, sequence in zip(COLUMNS, SEQUENCES, strict=True)
        ]
        for k in range(10):
            values = []
            for sign in (1.0, -1.0):
                turned, elbow = list(base), pose[9]
                if k == 9:
                    elbow += sign * h
                else:
                    turned[k // 3] = base[k // 3] * Rotation.from_rotvec(
                        sign * h * np.eye(3)[k % 3]
                    )
                rotations = [turn.as_matrix() for turn in turned]
                values.append(potential(arm(p, rotations, elbow, np.zeros(10))))
            row[k] = (values[0] - values[1]) / (2 * h)
    return slopes


def test_equations_that_were_evaluated_go_to_another_process(equations):
    """Diagnoses solve tasks side by side, with a model that has been asked before."""
    q = coordinates(equations, random_angles(3))
    expected = equations.features(q)
    again = pickle.loads(pickle.dumps(equations)).features(q)
    for ours, theirs in zip(again, expected, strict=True):
        np.testing.assert_array_equal(ours, theirs)


@pytest.mark.parametrize(
    ("potential", "present"),
    [
        (gravity_energy, ()),
        (spring_energy, ("joint_stiffness",)),
        (exponential_spring_energy, ("spring_torque",)),
        (stop_energy, ("stop_stiffness",)),
        (conoid_energy, ("conoid_stiffness",)),
        (contact_energy, ("contact_stiffness",)),
    ],
)
def test_forces_are_slopes_of_their_energy(equations, potential, present):
    angles, p = random_angles(8), parameters()
    changes = {name: value for name, value in RIGID.items() if name not in present}
    if present:
        changes["gravity"] = [0.0, 0.0, 0.0]
    torque = static_torque(equations, angles, **changes)[:, :10]
    expected = -energy_slope(angles, potential, p)
    assert np.abs(expected).max() > 0.1
    np.testing.assert_allclose(torque, expected, atol=1e-6 * np.abs(expected).max())


def test_conoid_by_hand(equations):
    """All joints straight: the ligament runs along x from (1, 0, 0) dm to (3, 0, 0) dm."""
    torque = static_torque(
        equations,
        np.array([[0, 0, 0, 0, 0, 0, 0, 0.2, 0, 0.3]]),
        **{**RIGID, "conoid_stiffness": 1000.0},
        gravity=[0, 0, 0],
        offset_AC=[0.2, 0.0, 0.0],
        conoid_origin=[0.1, 0.05, 0.0],
        conoid_insertion=[0.1, 0.05, 0.0],
        conoid_length=0.15,
        conoid_eps=1e-9,
    )[0]
    # Stretch 0.05 m, tension 50 N on a lever of 0.05 m; on the clavicle it cancels.
    np.testing.assert_allclose(torque[:3], 0.0, atol=1e-9)
    np.testing.assert_allclose(torque[3:6], [0.0, 0.0, 50.0 * 0.05], atol=1e-6)


def test_contact_by_hand(equations):
    """A point half a radius deep on the x axis of a sphere of 0.2 m."""
    torque = static_torque(
        equations,
        np.array([[0, 0, 0, 0, 0, 0, 0, 0.2, 0, 0.3]]),
        **{**RIGID, "contact_stiffness": 2e4},
        gravity=[0, 0, 0],
        offset_SC=[0.0, 0.0, 0.0],
        offset_AC=[0.1, 0.0, 0.0],
        contact_TS=[0.0, 0.3, 0.0],
        contact_AI=[5.0, 0.0, 0.0],
        thorax_centre=[0.0, 0.3, 0.0],
        thorax_radii=[0.2, 0.2, 0.2],
        contact_eps=1e-9,
    )[0]
    # Level -3/4; force k |A|^2 (x / A^2) 3/4 with |A|^2 = 0.12 m^2, x / A^2 = 2.5 / m: 4500 N in x.
    np.testing.assert_allclose(torque[3:6], [0.0, 0.0, -4500.0 * 0.3], atol=1e-5)
    np.testing.assert_allclose(torque[:3], [0.0, 0.0, -4500.0 * 0.3], atol=1e-5)


def test_damping_resists_the_relative_velocity(equations):
    angles = random_angles(4)
    w = np.random.default_rng(2).normal(size=(4, 10))
    q, u = coordinates(equations, angles), to_speeds(equations, angles, w)
    z = np.hstack([q, u, np.zeros((4, 13))])
    damping = [0.5, 0.6, 0.7, 0.8]
    with_it = equations.residual(z, pack(parameters(joint_damping=damping)))
    without = equations.residual(z, pack(parameters(joint_damping=[0.0] * 4)))
    torque = to_child_axes(equations, angles, (with_it - without)[:, :10])
    expected = -w * np.repeat(damping, [3, 3, 3, 1])
    np.testing.assert_allclose(torque, expected, rtol=1e-9, atol=1e-12)


def test_reaction_carries_the_weight_of_the_arm(equations):
    angles, p = random_angles(5), parameters(**RIGID)
    residual = static_torque(equations, angles, **RIGID)
    mass = p["mass_humerus"] + p["mass_forearm"] + p["mass_load"]
    for row, pose in zip(residual, angles, strict=True):
        scapula = arm_from_angles(p, pose, np.zeros(10)).rotations[1]
        # The auxiliary rows are weight plus reaction; the latter was zero.
        np.testing.assert_allclose(row[10:], scapula.T @ (mass * np.array(p["gravity"])))
    z = np.hstack([coordinates(equations, angles), np.zeros((5, 23))])
    columns = equations.jacobian(z, pack(p))[:, :, -3:]
    np.testing.assert_allclose(columns[:, 10:], np.tile(np.eye(3), (5, 1, 1)), atol=1e-14)
    np.testing.assert_allclose(columns[:, :10], 0.0, atol=1e-14)


def test_formulations_accelerate_alike(quaternion_equations, euler_equations):
    angles, h = random_angles(10), 1e-6
    w = np.random.default_rng(3).normal(size=(10, 10))
    p = pack(parameters())
    alpha = accelerations(quaternion_equations, coordinates(quaternion_equations, angles), w, p)
    speeds = to_speeds(euler_equations, angles, w)
    rates = accelerations(euler_equations, angles, speeds, p)
    # The Euler accelerations as angular ones: difference of the angular velocities in time.
    later, earlier = (
        (angles + s * h * speeds, speeds + s * h * rates[:, :10]) for s in (1.0, -1.0)
    )
    expected = rates.copy()
    for columns, sequence in zip(COLUMNS, SEQUENCES, strict=True):
        up, down = (
            np.einsum("nij,nj->ni", euler_rate_jacobian(a[:, columns], sequence), s[:, columns])
            for a, s in (later, earlier)
        )
        expected[:, columns] = (up - down) / (2 * h)
    scale = np.abs(expected).max(axis=0)
    np.testing.assert_allclose(alpha / scale, expected / scale, atol=1e-7)


def test_free_swing_keeps_its_energy(equations):
    """Without damping, over 0.3 s with ligament, contact and springs at work."""
    values = parameters(joint_damping=[0.0] * 4)
    p, nq = pack(values), equations.number_of_coordinates
    angles = random_angles(1, seed=4)
    w = np.random.default_rng(4).normal(size=(1, 10))
    q, u = coordinates(equations, angles), to_speeds(equations, angles, w)

    def rate(_, x):
        q, u = x[None, :nq], x[None, nq:]
        q_rate = np.einsum("nij,nj->ni", equations.rate_map(q), u)
        return np.concatenate([q_rate[0], accelerations(equations, q, u, p)[0, :10]])

    def state(x):
        if equations.name == "euler":
            w = x[nq:].copy()
            for columns, sequence in zip(COLUMNS, SEQUENCES, strict=True):
                w[columns] = euler_rate_jacobian(x[columns], sequence) @ w[columns]
            return arm_from_angles(values, x[:10], w)
        rotations = [quaternion_to_matrix(x[4 * k : 4 * k + 4]) for k in range(3)]
        return arm(values, rotations, x[12], x[nq:])

    swing = solve_ivp(rate, (0.0, 0.3), np.hstack([q, u])[0], method="DOP853", rtol=1e-9, atol=1e-9)
    states = [state(x) for x in swing.y.T]
    energies = np.array([energy(s) for s in states])
    exchanged = np.ptp([kinetic_energy(s) for s in states])
    assert exchanged > 0.5
    assert np.ptp(energies) < 1e-6 * exchanged
    if equations.name == "quaternion":
        norms = [np.linalg.norm(swing.y[4 * k : 4 * k + 4], axis=0) for k in range(3)]
        np.testing.assert_allclose(norms, 1.0, atol=1e-7)


@pytest.fixture
def random_state(equations):
    rng = np.random.default_rng(5)
    q = coordinates(equations, random_angles(4))
    return np.hstack([q, rng.normal(size=(4, 20)), 50 * rng.normal(size=(4, 3))])


def test_jacobian_matches_differences(equations, random_state):
    p, z, h = pack(parameters()), random_state, 1e-6
    jacobian = equations.jacobian(z, p)
    numeric = np.stack(
        [
            (equations.residual(z + step, p) - equations.residual(z - step, p)) / (2 * h)
            for step in h * np.eye(z.shape[1])
        ],
        axis=-1,
    )
    np.testing.assert_allclose(jacobian, numeric, atol=1e-7 * np.abs(jacobian).max())
    assert not np.any(jacobian[:, ~equations.jacobian_pattern])


def test_hessian_matches_differences(equations, random_state):
    p, z, h = pack(parameters()), random_state, 1e-6
    multipliers = np.random.default_rng(6).normal(size=(4, 13))

    def gradient(z):
        return np.einsum("nk,nkz->nz", multipliers, equations.jacobian(z, p))

    hessian = equations.hessian(z, multipliers, p)
    numeric = np.stack(
        [(gradient(z + s) - gradient(z - s)) / (2 * h) for s in h * np.eye(z.shape[1])], axis=-1
    )
    np.testing.assert_allclose(hessian, numeric, atol=1e-7 * np.abs(hessian).max())
    assert not np.any(hessian[:, ~equations.hessian_pattern])


def test_rate_map_keeps_the_norm_and_moves_the_rotation(quaternion_equations):
    angles = random_angles(6)
    q = coordinates(quaternion_equations, angles)
    w, h = np.random.default_rng(7).normal(size=(6, 10)), 1e-6
    rate = np.einsum("nij,nj->ni", quaternion_equations.rate_map(q), w)
    for k, columns in enumerate(COLUMNS):
        quaternion = slice(4 * k, 4 * k + 4)
        norm_rate = np.sum(q[:, quaternion] * rate[:, quaternion], axis=1)
        np.testing.assert_allclose(norm_rate, 0.0, atol=1e-15)
        later = quaternion_to_matrix((q + h * rate)[:, quaternion])
        turned = Rotation.from_matrix(quaternion_to_matrix(q[:, quaternion])) * (
            Rotation.from_rotvec(h * w[:, columns])
        )
        np.testing.assert_allclose(later, turned.as_matrix(), atol=1e-11)


def test_pose_matrices_are_those_of_the_chain(equations):
    angles = random_angles(3)
    matrices = equations.pose_matrices(coordinates(equations, angles))
    for actual, pose in zip(matrices, angles, strict=True):
        expected = arm_from_angles(parameters(), pose, np.zeros(10)).rotations
        np.testing.assert_allclose(actual, expected[:3], atol=1e-14)


def test_equations_stay_small(equations):
    """Operations after elimination of common subexpressions: the solver pays for each of them."""
    assert equations.header["operations"] < 10_000
