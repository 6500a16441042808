"""Muscle forces: derivatives by differences, work by hand, straight paths by plain geometry."""

import numpy as np
import pytest
from derivatives import assert_close, differences
from skeleton import muscle, uneven_record

from scapulohumeral.dynamics import muscle_forces
from scapulohumeral.dynamics.hill import HillConstants, MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.muscle_paths.geometry import (
    ROTATION_FEATURES,
    MuscleGeometry,
    straight_coefficients,
)
from scapulohumeral.model.muscle_paths.thorax_clearance import segment_frames
from scapulohumeral.model.rotations import trial_to_pose

pytestmark = pytest.mark.unit

NODES, MUSCLES, H = 3, 8, 1e-6
# Of the largest derivative: what central differences of that step are off by.
SHARE = 2e-7
STRAIGHT = np.arange(MUSCLES) < 3


@pytest.fixture
def geometry():
    """Random lengths around 0.5 m; the first three muscles are straight."""
    rng = np.random.default_rng(1)
    exponents = rng.integers(0, 3, (60, 10)) * (rng.random((60, 10)) < 0.25)
    exponents[0] = 0
    exponents = np.unique(exponents, axis=0)
    size = len(exponents)
    length = 0.02 * rng.normal(size=(MUSCLES, size + ROTATION_FEATURES))
    length *= rng.random(length.shape) < 0.2
    translation = 0.1 * rng.normal(size=(3, *length.shape))
    length[STRAIGHT, :size] = 0.0
    length[~STRAIGHT, size:] = 0.0
    length[:, 0] = np.where(STRAIGHT, 0.25, 0.5)
    names = tuple(f"m{k}" for k in range(MUSCLES))
    return MuscleGeometry(names, exponents, length, translation, STRAIGHT)


@pytest.fixture
def muscles():
    one = np.ones(MUSCLES)
    return MuscleParameters(
        names=tuple(f"m{k}" for k in range(MUSCLES)),
        max_isometric_force=np.linspace(1.0, 3.0, MUSCLES),
        optimal_fibre_length=0.4 * one,
        tendon_slack_length=0.1 * one,
        activation_time=0.02 * one,
        deactivation_time=0.05 * one,
        capacity=np.linspace(0.3, 1.0, MUSCLES),
        constants=HillConstants(),
    )


@pytest.fixture
def forces(equations, geometry):
    return MuscleForces(equations, geometry)


@pytest.fixture
def state(equations):
    """Coordinates (off the unit sphere too), speeds, activations, multipliers."""
    rng = np.random.default_rng(2)
    q = 0.3 * rng.normal(size=(NODES, equations.number_of_coordinates))
    u, a = rng.normal(size=(NODES, 10)), rng.random((NODES, MUSCLES))
    return q, u, a, rng.normal(size=(NODES, 13))


def test_jacobian_matches_differences(forces, muscles, state):
    q, u, a, _ = state
    split = [q.shape[1]]

    def by_state(x):
        return forces.generalised(*np.split(x, split, axis=1), a, muscles)

    value, d_state, d_activation = forces.jacobian(q, u, a, muscles)
    np.testing.assert_array_equal(value, forces.generalised(q, u, a, muscles))
    assert_close(d_state, differences(by_state, np.hstack([q, u])), SHARE)
    assert_close(
        d_activation, differences(lambda a: forces.generalised(q, u, a, muscles), a), SHARE
    )


def test_hessian_matches_differences(forces, muscles, state):
    q, u, a, multipliers = state
    split = [q.shape[1]]

    def gradient(x, a):
        _, d_state, _ = forces.jacobian(*np.split(x, split, axis=1), a, muscles)
        return np.einsum("nk,nkx->nx", multipliers, d_state)

    x = np.hstack([q, u])
    hessian, mixed = forces.hessian(q, u, a, multipliers, muscles)
    assert_close(hessian, differences(lambda x: gradient(x, a), x), SHARE)
    assert_close(mixed, differences(lambda a: gradient(x, a), a), SHARE)
    assert_close(hessian, hessian.transpose(0, 2, 1), SHARE)


def test_velocity_is_the_rate_of_length(forces, equations, state):
    q, u, *_ = state
    rate = np.einsum("nij,nj->ni", equations.rate_map(q), u)
    after, before = (forces.lengths(q + s * H * rate, u)[0] for s in (1.0, -1.0))
    assert_close(forces.lengths(q, u)[1], (after - before) / (2 * H), SHARE)


def test_power_of_the_muscles_is_tension_times_shortening(forces, muscles, state):
    q, u, a, _ = state
    power = np.sum(forces.generalised(q, u, a, muscles)[:, :10] * u, axis=1)
    _, velocity = forces.lengths(q, u)
    tension = forces.tension(q, u, a, muscles)
    np.testing.assert_allclose(power, -np.sum(tension * velocity, axis=1), rtol=1e-12)


def test_tension_acts_along_the_gradient_of_length(forces, muscles, state):
    q, u, a, _ = state
    tension, gradient = forces.tension(q, u, a, muscles), forces.gradients(q)
    expected = -np.einsum("nm,nmk->nk", tension, gradient)
    np.testing.assert_allclose(forces.generalised(q, u, a, muscles), expected, rtol=1e-12)


RECORD = uneven_record()


def straight_muscle(first, second):
    points = (first, [0.03, -0.1, 0.05]), (second, [-0.02, 0.04, 0.01])
    return muscle(f"{first} to {second}", *points)


EXAMPLES = [
    straight_muscle("thorax", "clavicle_r"),
    straight_muscle("thorax", "scapula_r"),
    straight_muscle("scapula_r", "humerus_r"),
]


def straight_geometry():
    """The three examples, with the constant as the only monomial."""
    squared, arms = zip(*(straight_coefficients(RECORD, m) for m in EXAMPLES), strict=True)
    return MuscleGeometry(
        names=tuple(example.name for example in EXAMPLES),
        exponents=np.zeros((1, 10), int),
        length=np.stack(squared),
        translation=np.stack(arms, axis=1),
        squared=np.ones(3, bool),
    )


def ends(example, frames):
    """Positions (N, 3) of both attachments in thorax axes."""
    return [
        frames[point.body][0] + frames[point.body][1] @ np.array(point.location_m)
        for point in example.points
    ]


@pytest.fixture
def angles():
    return np.random.default_rng(3).uniform(0.2, 0.9, (6, 10))


def test_straight_lengths_are_distances(equations, angles):
    pose = trial_to_pose(angles)
    forces = MuscleForces(equations, straight_geometry())
    q = pose if equations.name == "quaternion" else angles
    lengths, _ = forces.lengths(q, np.zeros((6, 10)))
    for k, example in enumerate(EXAMPLES):
        origin, insertion = ends(example, segment_frames(RECORD, pose))
        expected = np.linalg.norm(insertion - origin, axis=1)
        np.testing.assert_allclose(lengths[:, k], expected, rtol=1e-12)


def test_straight_moment_is_lever_cross_pull(quaternion_equations, angles):
    """Generalised force of unit tension: r x F about the joint and F on the humeral head."""
    pose = trial_to_pose(angles)
    gradient = MuscleForces(quaternion_equations, straight_geometry()).gradients(pose)
    frames = segment_frames(RECORD, pose)
    joint_bodies = {"clavicle_r": slice(0, 3), "scapula_r": slice(3, 6), "humerus_r": slice(6, 9)}
    for k, example in enumerate(EXAMPLES):
        origin, insertion = ends(example, frames)
        pull = origin - insertion
        pull /= np.linalg.norm(pull, axis=1, keepdims=True)
        crossed = {0: ["clavicle_r"], 1: ["clavicle_r", "scapula_r"], 2: ["humerus_r"]}[k]
        for body, columns in joint_bodies.items():
            centre, matrix = frames[body]
            moment = np.einsum("nij,ni->nj", matrix, np.cross(insertion - centre, pull))
            expected = moment if body in crossed else np.zeros_like(moment)
            np.testing.assert_allclose(-gradient[:, k, columns], expected, atol=1e-12)
        on_head = np.einsum("nij,ni->nj", frames["scapula_r"][1], pull) if k == 2 else 0.0 * pull
        np.testing.assert_allclose(-gradient[:, k, 10:], on_head, atol=1e-12)


def test_a_point_that_changed_in_place_is_evaluated_anew(forces, muscles, state):
    """Callers may reuse their arrays; the state that is kept must not be mistaken for theirs."""
    q, u, activation, _ = state
    forces.generalised(q, u, activation, muscles)
    u += 0.5
    q[:, 0] += 0.1
    fresh = MuscleForces(forces.dynamics, forces.geometry)
    np.testing.assert_array_equal(
        forces.generalised(q, u, activation, muscles), fresh.generalised(q, u, activation, muscles)
    )
    for one, other in zip(
        forces.jacobian(q, u, activation, muscles),
        fresh.jacobian(q, u, activation, muscles),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)


def test_many_nodes_are_evaluated_as_each_alone(forces, muscles, state, monkeypatch):
    """Blocks of two and one of the three nodes, and all at a second point after the first."""
    q, u, activation, multipliers = state

    def everything(nodes, at):
        point = at[nodes], u[nodes], activation[nodes]
        return (
            forces.generalised(*point, muscles),
            *forces.jacobian(*point, muscles),
            *forces.hessian(*point, multipliers[nodes], muscles),
        )

    monkeypatch.setattr(muscle_forces, "BLOCK", 2)
    for at in (q, q + 1e-3):
        together = everything(slice(None), at)
        alone = [everything(slice(k, k + 1), at) for k in range(NODES)]
        for whole, parts in zip(together, zip(*alone, strict=True), strict=True):
            np.testing.assert_allclose(whole, np.concatenate(parts), rtol=1e-12, atol=1e-12)
