"""Static postures: derivatives, equilibrium, and least effort between guided and free."""

from dataclasses import replace

import numpy as np
import pytest
from arm import parameters
from scipy.optimize import minimize
from small_arm import small_motion

from scapulohumeral.dynamics.hill import HillConstants, MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.model.muscle_paths.geometry import ROTATION_FEATURES, MuscleGeometry
from scapulohumeral.model.rotations import (
    pose_to_trial,
    quaternion_multiply,
    relative_angle,
    trial_to_pose,
)
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.problems.least_joint_force import least_joint_force
from scapulohumeral.problems.static_posture import (
    REACTION_N,
    Posture,
    StaticProblem,
    static_posture,
)

pytestmark = pytest.mark.unit

# A pair of opposite muscles for every variable: they can hold any pose.
NAMES = tuple(f"{variable}{side}" for variable in range(10) for side in "+-")
POSE = trial_to_pose(small_motion(5))[3]


@pytest.fixture
def posture(quaternion_equations):
    length = np.zeros((20, 11 + ROTATION_FEATURES))
    length[:, 0] = 0.2
    for variable in range(10):
        length[2 * variable : 2 * variable + 2, 1 + variable] = 0.06, -0.06
    exponents = np.vstack([np.zeros(10, dtype=int), np.eye(10, dtype=int)])
    translation = np.zeros((3, *length.shape))
    translation[0, 12:18, 0] = -1.0
    geometry = MuscleGeometry(NAMES, exponents, length, translation, np.zeros(20, bool))
    muscles = MuscleParameters(
        names=NAMES,
        max_isometric_force=np.full(20, 800.0),
        optimal_fibre_length=np.full(20, 0.12),
        tendon_slack_length=np.full(20, 0.08),
        activation_time=np.full(20, 0.01),
        deactivation_time=np.full(20, 0.04),
        capacity=np.ones(20),
        constants=HillConstants(),
    )
    soft = {"contact_stiffness": 100.0, "stop_stiffness": 0.5}
    values = pack(parameters(gravity=[0.1, -3.0, 0.2], mass_load=0.0, **soft))
    forces = MuscleForces(quaternion_equations, geometry)
    effort = np.linspace(0.6, 1.4, 20)
    return Posture(forces, muscles, values, (0.11, 0.23), (0.62, 2.0), effort, 0.5)


@pytest.fixture
def problem(posture):
    reference = pose_errors("quaternion").reference(pose_to_trial(POSE[None]), 0.5)
    return StaticProblem(posture, reference, 0.7)


def point():
    rng = np.random.default_rng(1)
    pose = POSE + 0.02 * rng.normal(size=13)
    return np.concatenate([pose, [-3.0, 0.4, -0.5], rng.uniform(0.1, 0.6, 20)])


def slopes(function, x, step=1e-6):
    columns = [
        (function(x + step * unit) - function(x - step * unit)) / (2 * step)
        for unit in np.eye(len(x))
    ]
    return np.array(columns).T


def test_first_derivatives(problem):
    x = point()
    np.testing.assert_allclose(problem.gradient(x), slopes(problem.objective, x), atol=1e-6)
    jacobian = problem.jacobian(x).reshape(-1, len(x))
    np.testing.assert_allclose(jacobian, slopes(problem.constraints, x), atol=1e-5)


def test_second_derivatives(problem):
    x = point()
    multipliers = np.random.default_rng(2).normal(size=len(problem.constraints(x)))

    def gradient(x):
        return 0.3 * problem.gradient(x) + multipliers @ problem.jacobian(x).reshape(-1, len(x))

    rows, columns = problem.hessianstructure()
    expected = slopes(gradient, x)[rows, columns]
    np.testing.assert_allclose(problem.hessian(x, multipliers, 0.3), expected, atol=2e-5)


def test_free_girdle_takes_less_effort_than_the_recorded_one(posture, problem):
    held = static_posture(posture, POSE, (200.0,))
    free = static_posture(posture, POSE)
    x = np.concatenate([held.pose, held.reaction_N / REACTION_N, held.activation])
    assert free.objective < replace(problem, guidance=0.0).objective(x)
    scapula = [quaternion_multiply(pose[0:4], pose[4:8]) for pose in (POSE, held.pose, free.pose)]
    far = [np.rad2deg(relative_angle(scapula[0], other)) for other in scapula[1:]]
    assert far[0] < 1.5 < far[1]


def test_arm_stays_and_the_posture_is_in_equilibrium(posture):
    free = static_posture(posture, POSE)
    humeri = [
        quaternion_multiply(quaternion_multiply(pose[0:4], pose[4:8]), pose[8:12])
        for pose in (POSE, free.pose)
    ]
    assert relative_angle(*humeri) < 1e-5
    assert free.pose[12] == pytest.approx(POSE[12])
    q, still = free.pose[None], np.zeros((1, 10))
    z = np.concatenate([free.pose, np.zeros(20), free.reaction_N])[None]
    balance = posture.forces.dynamics.residual(z, posture.parameters)
    balance = balance + posture.forces.generalised(q, still, free.activation[None], posture.muscles)
    assert np.abs(balance[0, :10]).max() < 1e-4
    assert np.abs(balance[0, 10:]).max() < 1e-2


def unbalanced(posture, reaction_n, activation):
    """Left sides (13,) of the equations of the pose at rest [N m, N]."""
    z = np.concatenate([POSE, np.zeros(20), reaction_n])[None]
    pulled = posture.forces.generalised(
        POSE[None], np.zeros((1, 10)), activation[None], posture.muscles
    )
    return (posture.forces.dynamics.residual(z, posture.parameters) + pulled)[0]


def test_least_joint_force_is_that_of_a_general_optimiser(posture):
    """Equations are linear in reaction and activations, so units tell all of them."""
    rest = unbalanced(posture, np.zeros(3), np.zeros(20))
    units = [unbalanced(posture, unit, np.zeros(20)) - rest for unit in REACTION_N * np.eye(3)]
    units += [unbalanced(posture, np.zeros(3), unit) - rest for unit in np.eye(20)]
    equations = np.array(units).T
    found = minimize(
        lambda x: x[:3] @ x[:3] / 2,
        np.concatenate([np.zeros(3), np.full(20, 0.3)]),
        jac=lambda x: np.concatenate([x[:3], np.zeros(20)]),
        bounds=[(None, None)] * 3 + [(0.0, 1.0)] * 20,
        constraints={
            "type": "eq",
            "fun": lambda x: rest + equations @ x,
            "jac": lambda _: equations,
        },
        method="SLSQP",
        options={"ftol": 1e-10, "maxiter": 500},
    )
    assert found.success
    expected = REACTION_N * np.linalg.norm(found.x[:3])
    assert expected > 1.0
    assert least_joint_force(posture, POSE) == pytest.approx(expected, rel=0.02)
