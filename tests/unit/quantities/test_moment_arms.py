"""Moment arms of movements: each movement is the one it is called, and muscles shorten by it."""

from types import SimpleNamespace

import numpy as np
import pytest
from small_arm import small_forces, small_motion

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import (
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.quantities.moment_arms import JOINTS, _axes, movement_arms
from scapulohumeral.quantities.segment_angles import thorax_angles

pytestmark = pytest.mark.unit

STEP = 1e-4
FIRST = {"clavicle": 0, "scapula": 4, "humerus": 8}
# Angle in the thorax that each movement changes alone; axial rotation is no such angle.
COLUMNS = {"elevation": 7, "upward_rotation": 4, "clavicle_elevation": 1}


@pytest.fixture
def pose():
    """Poses with the arm raised to different planes."""
    pose = trial_to_pose(small_motion(6))[2:]
    raised = rotation_vector_to_quaternion(np.array([[0.3, 0.2, 0.8]]))
    pose[:, 8:12] = quaternion_multiply(raised, pose[:, 8:12])
    return pose


def moved(pose, movement, angle):
    """Poses turned by an angle about the axis of a movement."""
    first = FIRST[JOINTS[movement][0]]
    turn = rotation_vector_to_quaternion(angle * _axes(pose)[movement])
    result = pose.copy()
    result[:, first : first + 4] = quaternion_multiply(pose[:, first : first + 4], turn)
    return result


@pytest.mark.parametrize("movement", COLUMNS)
def test_movement_is_the_one_it_is_called(pose, movement):
    more, less = (thorax_angles(moved(pose, movement, s * STEP)) for s in (1, -1))
    change = np.deg2rad(more - less) / (2 * STEP)
    column = COLUMNS[movement]
    np.testing.assert_allclose(change[:, column], 1.0, atol=1e-5)
    others = [c for c in range(3 * (column // 3), 3 * (column // 3) + 3) if c != column]
    np.testing.assert_allclose(change[:, others], 0.0, atol=1e-5)


def test_axial_rotation_keeps_the_arm_where_it_is(pose):
    turned = moved(pose, "axial_rotation", 0.3)
    before, after = thorax_angles(pose), thorax_angles(turned)
    np.testing.assert_allclose(after[:, 6:8], before[:, 6:8], atol=1e-6)
    np.testing.assert_allclose(after[:, 8] - before[:, 8], np.rad2deg(0.3), atol=1e-6)


@pytest.mark.parametrize("movement", JOINTS)
def test_arms_are_what_muscles_shorten_by(quaternion_equations, pose, movement):
    forces = small_forces(quaternion_equations)
    still = np.zeros((len(pose), 10))
    more, less = (forces.lengths(moved(pose, movement, s * STEP), still)[0] for s in (1, -1))
    arms = movement_arms(forces, pose)[movement]
    np.testing.assert_allclose(arms, (less - more) / (2 * STEP), atol=1e-8)


def test_some_muscle_has_an_arm(quaternion_equations, pose):
    arms = movement_arms(small_forces(quaternion_equations), pose)
    assert np.abs(arms["elevation"]).max() > 1e-3


def test_euler_angles_are_refused(pose):
    forces = SimpleNamespace(dynamics=SimpleNamespace(name="euler"))
    with pytest.raises(ConfigError, match="formulation 'euler': expected 'quaternion'"):
        movement_arms(forces, pose)
