"""Joint moments and torque capacity of arms with few muscles."""

from dataclasses import replace

import numpy as np
import pytest
from small_arm import small_forces, small_motion, small_muscles

from scapulohumeral.dynamics.hill import force_derivatives
from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.quantities.joint_moments import (
    DIRECTIONS,
    JointMoments,
    joint_moments,
    torque_capacity,
)

pytestmark = pytest.mark.unit

ELBOW = DIRECTIONS.index("EL")
NODES = 5


def constant_moments(columns: dict[str, list[float]], activation: list[float]) -> JointMoments:
    """One node; moments of each fully active muscle by direction, 0.5 N m passive at the elbow."""
    per_activation = np.zeros((1, 10, len(activation)))
    for direction, values in columns.items():
        per_activation[0, DIRECTIONS.index(direction)] = values
    passive = np.zeros((1, 10))
    passive[0, ELBOW] = 0.5
    return JointMoments(per_activation, per_activation @ np.array(activation), passive)


def test_one_muscle_at_one_joint() -> None:
    capacity = torque_capacity(constant_moments({"EL": [8.0]}, [0.25]), [0])
    assert capacity.required[0, ELBOW] == pytest.approx(2.5)
    assert capacity.lowest[0, ELBOW] == pytest.approx(0.5)
    assert capacity.highest[0, ELBOW] == pytest.approx(8.5)
    assert capacity.margin[0, ELBOW] == pytest.approx(8.5 / 2.5)
    assert np.isnan(np.delete(capacity.margin, ELBOW)).all()


def test_other_joint_ties_the_muscle() -> None:
    """A muscle that also turns the shoulder cannot pull harder unless another one balances it."""
    alone = constant_moments({"EL": [8.0], "GH_x": [2.0]}, [0.25])
    assert torque_capacity(alone, [0]).margin[0, ELBOW] == pytest.approx(1.0)
    balanced = constant_moments({"EL": [8.0, 0.0], "GH_x": [2.0, -1.0]}, [0.25, 0.0])
    # Full antagonist: 2 a - 1 = 0.5, so a = 0.75.
    assert torque_capacity(balanced, [0]).highest[0, ELBOW] == pytest.approx(6.5)


def test_sense_of_the_margin_is_that_of_the_required_moment() -> None:
    capacity = torque_capacity(constant_moments({"EL": [8.0, -5.0]}, [0.0, 0.5]), [0])
    assert capacity.required[0, ELBOW] == pytest.approx(-2.0)
    assert capacity.margin[0, ELBOW] == pytest.approx(4.5 / 2.0)


def test_activations_out_of_range_are_refused() -> None:
    moments = constant_moments({"EL": [8.0], "GH_x": [2.0]}, [1.5])
    with pytest.raises(SolveError, match="node 0, SC_x"):
        torque_capacity(moments, [0])


def small_state() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q, u and activations of the slow elevation."""
    activation = np.linspace(0.1, 0.8, 3 * NODES).reshape(NODES, 3)
    return trial_to_pose(small_motion(NODES)), np.full((NODES, 10), 0.1), activation


def test_parts_sum_to_the_generalised_force(quaternion_equations) -> None:
    forces, muscles, state = small_forces(quaternion_equations), small_muscles(), small_state()
    moments = joint_moments(forces, muscles, *state)
    np.testing.assert_allclose(moments.net, forces.generalised(*state, muscles)[:, :10], atol=1e-10)
    relaxed = joint_moments(forces, muscles, *state[:2], 0 * state[2])
    np.testing.assert_allclose(relaxed.net, moments.passive)


def test_elbow_moment_is_force_times_lever(quaternion_equations) -> None:
    """Only brachialis active; its length falls by 0.02 m per radian."""
    forces, muscles = small_forces(quaternion_equations), small_muscles()
    q, u, _ = small_state()
    moments = joint_moments(forces, muscles, q, u, np.tile([0.0, 0.0, 1.0], (NODES, 1)))
    force = force_derivatives(*forces.lengths(q, u), muscles).active[:, 2]
    np.testing.assert_allclose(moments.active[:, ELBOW], 0.02 * force)
    np.testing.assert_allclose(np.delete(moments.active, ELBOW, axis=1), 0.0, atol=1e-12)


def test_margin_is_at_least_one_and_grows_with_strength(quaternion_equations) -> None:
    forces, muscles, (q, u, a) = small_forces(quaternion_equations), small_muscles(), small_state()
    weak = torque_capacity(joint_moments(forces, muscles, q, u, a), range(NODES))
    assert np.nanmin(weak.margin) >= 1.0 - 1e-6
    # The same moments, from half the activation of a brachialis with twice the capacity.
    strong = replace(muscles, capacity=muscles.capacity * [1.0, 1.0, 2.0])
    half = a * [1.0, 1.0, 0.5]
    after = torque_capacity(joint_moments(forces, strong, q, u, half), range(NODES))
    np.testing.assert_allclose(after.required, weak.required)
    assert (after.highest[:, ELBOW] > weak.highest[:, ELBOW] + 0.1).all()


def test_euler_angles_are_refused(euler_equations) -> None:
    forces = small_forces(euler_equations)
    _, u, activation = small_state()
    with pytest.raises(ConfigError, match="'euler'"):
        joint_moments(forces, small_muscles(), small_motion(NODES), u, activation)
