"""Rotations with known results, and identities at random orientations."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scapulohumeral.model import rotations as rot

pytestmark = pytest.mark.unit

HALF = np.sqrt(0.5)
RNG = np.random.default_rng(1)
RANDOM = rot.rotation_vector_to_quaternion(RNG.uniform(-1.5, 1.5, (20, 3)))


def test_quarter_turn_about_y_takes_z_to_x():
    matrix = rot.quaternion_to_matrix([HALF, 0.0, HALF, 0.0])
    np.testing.assert_allclose(matrix @ [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], atol=1e-15)


def test_product_is_composition_of_matrices():
    p, q = RANDOM[:10], RANDOM[10:]
    expected = rot.quaternion_to_matrix(p) @ rot.quaternion_to_matrix(q)
    actual = rot.quaternion_to_matrix(rot.quaternion_multiply(p, q))
    np.testing.assert_allclose(actual, expected, atol=1e-14)


def test_product_with_conjugate_is_identity():
    product = rot.quaternion_multiply(RANDOM, rot.quaternion_conjugate(RANDOM))
    np.testing.assert_allclose(product, np.tile([1.0, 0, 0, 0], (20, 1)), atol=1e-15)


def test_matrix_round_trip_is_canonical():
    q = rot.matrix_to_quaternion(rot.quaternion_to_matrix(-RANDOM))
    np.testing.assert_allclose(q, RANDOM * np.sign(RANDOM[:, :1]), atol=1e-14)


@pytest.mark.parametrize("sequence", ["YZX", "YZY"])
def test_euler_sequence_is_body_fixed(sequence):
    angles = np.array([0.4, 0.7, -0.9])
    axes = {"X": [1.0, 0, 0], "Y": [0, 1.0, 0], "Z": [0, 0, 1.0]}
    factors = [
        rot.rotation_vector_to_quaternion(angle * np.array(axes[letter]))
        for letter, angle in zip(sequence, angles, strict=True)
    ]
    product = rot.quaternion_multiply(rot.quaternion_multiply(*factors[:2]), factors[2])
    np.testing.assert_allclose(rot.euler_to_quaternion(angles, sequence), product, atol=1e-15)
    np.testing.assert_allclose(rot.quaternion_to_euler(product, sequence), angles, atol=1e-14)


def test_leading_axes_are_kept():
    q = RANDOM.reshape(4, 5, 4)
    assert rot.quaternion_to_matrix(q).shape == (4, 5, 3, 3)
    assert rot.quaternion_to_euler(q, "YZX").shape == (4, 5, 3)


def test_make_continuous_removes_sign_flips_only():
    angle = np.linspace(0.0, 4.0 * np.pi, 50)
    smooth = np.stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle], axis=1)
    flipped = smooth * np.where(RNG.random((50, 1)) < 0.5, -1.0, 1.0)
    flipped[0] = smooth[0]
    np.testing.assert_allclose(rot.make_continuous(flipped), smooth)


def test_motion_through_the_singularity_does_not_jump():
    """The branch with a positive second angle folds a motion through zero; it is unfolded."""
    angles = np.zeros((41, 10))
    angles[:, 6:9] = np.column_stack(
        [np.full(41, 0.2), np.linspace(-0.5, 0.5, 41), np.full(41, -0.1)]
    )
    angles[:, 0] = np.linspace(3.0, 3.4, 41)
    folded = angles.copy()
    half = angles[:, 7] < 0.0
    folded[half, 6:9] = angles[half, 6:9] * [1, -1, 1] + [np.pi, 0, -np.pi]
    folded[angles[:, 0] > np.pi, 0] -= 2.0 * np.pi
    np.testing.assert_allclose(rot.continuous_angles(folded, angles[0]), angles, atol=1e-12)
    # From the other form of the first frame on, the other form throughout.
    other = angles[0] + [0, 0, 0, 0, 0, 0, np.pi, -2.0 * angles[0, 7], -np.pi, 0]
    found = rot.continuous_angles(folded, other)
    np.testing.assert_allclose(found[:, 7], -angles[:, 7], atol=1e-12)
    np.testing.assert_allclose(rot.trial_to_pose(found), rot.trial_to_pose(angles), atol=1e-12)


def test_sign_of_quaternions_is_no_turn():
    poses = rot.trial_to_pose(RNG.uniform(-1.0, 1.0, (5, 10)))
    flipped = poses.copy()
    flipped[1:3, 4:8] *= -1.0
    flipped[:, 8:12] *= -1.0
    for made, known in (
        (rot.positive_pose(flipped), poses),
        (rot.positive_pose(flipped[1]), poses[1]),
    ):
        assert (made[..., [0, 4, 8]] >= 0.0).all()
        np.testing.assert_array_equal(made[..., 12], known[..., 12])
        for first in (0, 4, 8):
            joint = slice(first, first + 4)
            matrices = [rot.quaternion_to_matrix(one[..., joint]) for one in (made, known)]
            np.testing.assert_allclose(*matrices, atol=1e-12)


def test_relative_angle_ignores_sign_and_keeps_small_angles():
    small = rot.rotation_vector_to_quaternion([1e-9, 0.0, 0.0])
    identity = np.array([1.0, 0.0, 0.0, 0.0])
    np.testing.assert_allclose(rot.relative_angle(identity, -small), 1e-9, rtol=1e-6)
    turn = rot.rotation_vector_to_quaternion([0.0, 2.5, 0.0])
    np.testing.assert_allclose(rot.relative_angle(identity, turn), 2.5)


def test_interpolated_poses_get_unit_quaternions_and_keep_the_elbow():
    pose = rot.trial_to_pose(np.linspace(0.1, 0.9, 20).reshape(2, 10))
    between = 0.5 * (pose[:1] + pose[1:])
    assert np.linalg.norm(between[0, :4]) < 0.99
    unit = rot.unit_pose(between)
    for first in (0, 4, 8):
        joint = slice(first, first + 4)
        np.testing.assert_allclose(np.linalg.norm(unit[:, joint], axis=1), 1.0)
        np.testing.assert_allclose(
            rot.relative_angle(pose[:1, joint], unit[:, joint]),
            rot.relative_angle(pose[1:, joint], unit[:, joint]),
        )
    np.testing.assert_array_equal(unit[:, 12], between[:, 12])


def test_trial_and_pose_round_trip():
    angles = RNG.uniform(0.1, 1.2, (6, 10))
    pose = rot.trial_to_pose(angles)
    assert pose.shape == (6, 13)
    np.testing.assert_allclose(rot.pose_to_trial(pose), angles, atol=1e-13)


@pytest.mark.parametrize("column", [0, 3, 6, 8])
def test_poses_do_not_depend_on_how_often_angles_were_wrapped(column):
    # Start and middle of an elevation of a blind case: both outer glenohumeral angles near -160 deg
    # make one turn of 40 deg, whose quaternion had a negative scalar part.
    angles = np.deg2rad(
        [
            [-24.5, 3.4, 9.0, 44.8, 3.1, -0.1, -160.7, 1.9, -159.8, 20.1],
            [-25.3, 4.6, 8.5, 45.4, 3.2, 1.6, -342.0, 14.2, 3.0, 14.5],
        ]
    )
    pose = rot.trial_to_pose(angles)
    assert np.all(pose[:, [0, 4, 8]] > 0.0)
    wrapped = angles + 2.0 * np.pi * np.eye(10)[column]
    np.testing.assert_allclose(rot.trial_to_pose(wrapped), pose, atol=1e-13)


def test_trial_keeps_its_continuity_where_a_scalar_part_changes_sign():
    angles = np.zeros((9, 10))
    angles[:, 0] = np.linspace(0.6, 1.1, 9) * np.pi
    pose = rot.trial_to_pose(angles)
    assert pose[0, 0] > 0.0 > pose[-1, 0]
    assert np.abs(np.diff(pose[:, :4], axis=0)).max() < 0.2


@pytest.mark.parametrize("sequence", ["YZX", "YZY"])
def test_euler_rates_give_the_angular_velocity_in_child_axes(sequence):
    """Against the turn between two instants, R(t - h)^T R(t + h), seen from the child."""
    angles = RNG.uniform(-1.5, 1.5, (20, 3))
    rates, h = RNG.normal(size=(20, 3)), 1e-5
    before, after = (rot.euler_to_quaternion(angles + s * h * rates, sequence) for s in (-1, 1))
    turn = rot.quaternion_multiply(rot.quaternion_conjugate(before), after)
    turn *= np.sign(turn[:, :1])
    expected = turn[:, 1:] / h
    actual = np.einsum("pij,pj->pi", rot.euler_rate_jacobian(angles, sequence), rates)
    np.testing.assert_allclose(actual, expected, atol=1e-8)


def test_euler_rate_jacobian_is_singular_at_gimbal_lock_only():
    angles = np.array([[0.3, 0.0, 0.4], [0.3, 0.2, 0.4]])
    determinants = np.linalg.det(rot.euler_rate_jacobian(angles, "YZY"))
    np.testing.assert_allclose(np.abs(determinants), [0.0, np.sin(0.2)], atol=1e-15)


def test_frame_of_a_joint_is_turned_about_its_own_axes():
    """About x, then about the y and the z that were turned with it."""
    quarter = np.pi / 2
    turned = rot.joint_rotation([quarter, quarter, 0.0])
    np.testing.assert_allclose(turned @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=1e-15)
    angles = [0.2, -0.1, 0.3]
    expected = Rotation.from_euler("XYZ", angles).as_matrix()
    np.testing.assert_allclose(rot.joint_rotation(angles), expected, atol=1e-15)
