"""Poses are drawn within the margin, repeatably, and outside the thorax."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skeleton import joint, muscle, skeleton_record, surface

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.muscle_paths.pose_region import Region, draw_angles, draw_poses
from scapulohumeral.model.muscle_paths.thorax_clearance import (
    arm_hanging,
    attachment_levels,
    is_clear,
    segment_frames,
)
from scapulohumeral.model.rotations import (
    quaternion_multiply,
    relative_angle,
    rotation_vector_to_quaternion,
    trial_to_pose,
)

pytestmark = pytest.mark.unit

IDENTITY = np.tile([1.0, 0.0, 0.0, 0.0], 3)
REST = np.append(IDENTITY, 0.5)[None]
ORIGIN = ("thorax", [0.0, -0.1, 0.05])
RECORD = replace(
    skeleton_record(),
    joints={
        "sc1": joint([0.02, 0.0, 0.0]),
        "ac1": joint([0.16, 0.0, 0.0]),
        "gh1": joint([0.0, -0.05, 0.0]),
    },
    wrap_objects=(surface("wall", "ellipsoid", "thorax", [0.0, -0.1, 0.05], 0.1, 0.2, 0.1),),
    muscles=(
        muscle("wrapping", ORIGIN, ("scapula_r", [0.02, -0.1, 0.05]), wraps=("wall",)),
        muscle("free", ("scapula_r", [-0.18, -0.1, 0.05])),
    ),
)


def test_turns_stay_within_the_margin_and_use_it():
    poses = draw_poses(REST, Region(15.0), 4000, np.random.default_rng(1))
    for start in (0, 4, 8):
        angle = np.rad2deg(relative_angle(poses[:, start : start + 4], IDENTITY[:4]))
        assert angle.max() <= 15.0 + 1e-9
        # Uniform in a ball: half of the volume lies within 0.5 ** (1 / 3) of the radius.
        np.testing.assert_allclose(np.median(angle), 15.0 * 0.5 ** (1 / 3), rtol=0.02)
    assert np.abs(poses[:, 12] - 0.5).max() <= np.deg2rad(15.0)


def test_scapula_turns_under_the_arm():
    region = Region(0.0, (-30.0, 10.0))
    poses = draw_poses(REST, region, 4000, np.random.default_rng(1))
    np.testing.assert_allclose(poses[:, 0:4], np.tile(IDENTITY[:4], (4000, 1)), atol=1e-12)
    upward = np.rad2deg(2 * np.arctan2(poses[:, 7], poses[:, 4]))
    assert -30.0 <= upward.min() < -29.0
    assert 9.0 < upward.max() <= 10.0
    humerus = quaternion_multiply(poses[:, 4:8], poses[:, 8:12])
    np.testing.assert_allclose(relative_angle(humerus, IDENTITY[:4]), 0.0, atol=1e-7)


def test_clavicle_and_scapula_turn_under_the_arm():
    region = Region(0.0, (-30.0, 30.0), 20.0)
    poses = draw_poses(REST, region, 4000, np.random.default_rng(1))
    turn = np.rad2deg(relative_angle(poses[:, 0:4], IDENTITY[:4]))
    assert 19.5 < turn.max() <= 20.0 + 1e-9
    axes = poses[:, 1:4] / np.linalg.norm(poses[:, 1:4], axis=1, keepdims=True)
    np.testing.assert_allclose(axes.mean(axis=0), 0.0, atol=0.03)
    scapula = quaternion_multiply(poses[:, 0:4], poses[:, 4:8])
    vectors = np.rad2deg(Rotation.from_quat(scapula, scalar_first=True).as_rotvec())
    assert 19.5 < np.hypot(vectors[:, 0], vectors[:, 1]).max() <= 20.0 + 1e-9
    assert -30.0 <= vectors[:, 2].min() < -29.0
    assert 29.0 < vectors[:, 2].max() <= 30.0
    # Turns of clavicle and scapula have nothing to do with each other.
    np.testing.assert_allclose(np.corrcoef(vectors.T, poses[:, 1:4].T)[:3, 3:], 0.0, atol=0.05)
    humerus = quaternion_multiply(scapula, poses[:, 8:12])
    np.testing.assert_allclose(relative_angle(humerus, IDENTITY[:4]), 0.0, atol=1e-7)


def test_region_without_the_recorded_scapula_is_refused():
    with pytest.raises(ConfigError, match="interval around 0"):
        Region(10.0, (5.0, 20.0))
    with pytest.raises(ConfigError, match="girdle_turn_deg -1"):
        Region(10.0, girdle_turn_deg=-1.0)


def test_hanging_arm_points_down_from_the_same_girdle():
    raised = draw_poses(REST, Region(60.0), 50, np.random.default_rng(1))
    hanging = arm_hanging(raised)
    np.testing.assert_array_equal(hanging[:, [*range(8), 12]], raised[:, [*range(8), 12]])
    axes = [segment_frames(RECORD, poses)["humerus_r"][1][:, :, 1] for poses in (raised, hanging)]
    np.testing.assert_allclose(axes[1], np.tile([0.0, 1.0, 0.0], (50, 1)), atol=1e-12)
    # The shortest way: as far as the arm was raised.
    way = relative_angle(raised[:, 8:12], hanging[:, 8:12])
    np.testing.assert_allclose(way, np.arccos(axes[0][:, 1]), atol=1e-6)
    np.testing.assert_allclose(arm_hanging(hanging), hanging, atol=1e-12)


def test_quaternions_are_normalised_and_scalar_part_is_not_negative():
    poses = draw_poses(REST * -1.0, Region(15.0), 200, np.random.default_rng(1))
    for start in (0, 4, 8):
        np.testing.assert_allclose(np.linalg.norm(poses[:, start : start + 4], axis=1), 1.0)
        assert poses[:, start].min() >= 0.0


def test_angles_stay_within_the_margin_and_on_their_branch():
    recorded = np.array([[0.1] * 7 + [-0.05, 0.3, 0.5]])  # GH_z is negative: the other branch
    angles = draw_angles(recorded, 10.0, 2000, np.random.default_rng(1))
    moved = angles - recorded
    for start in (0, 3, 6):
        distance = np.rad2deg(np.linalg.norm(moved[:, start : start + 3], axis=1))
        assert distance.max() <= 10.0 + 1e-9
        np.testing.assert_allclose(np.median(distance), 10.0 * 0.5 ** (1 / 3), rtol=0.02)
    assert np.abs(moved[:, 9]).max() <= np.deg2rad(10.0)


def test_refused_angles_are_judged_as_poses():
    recorded = np.array([[0.1] * 10])
    seen = []

    def accept(poses):
        seen.append(poses)
        return poses[:, 12] > 0.1

    angles = draw_angles(recorded, 10.0, 100, np.random.default_rng(1), accept)
    assert angles[:, 9].min() > 0.1
    kept = np.concatenate([poses[poses[:, 12] > 0.1] for poses in seen])[:100]
    np.testing.assert_allclose(trial_to_pose(angles)[:, 12], kept[:, 12])


def test_same_seed_same_poses_and_input_unchanged():
    recorded = REST.copy()
    first, second = (
        draw_poses(recorded, Region(10.0), 50, np.random.default_rng(7)) for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(recorded, REST)


def test_refused_poses_are_drawn_again():
    poses = draw_poses(REST, Region(15.0), 300, np.random.default_rng(1), lambda p: p[:, 12] > 0.5)
    assert poses.shape == (300, 13)
    assert poses[:, 12].min() > 0.5


def test_margin_that_leaves_nothing_is_refused():
    rng = np.random.default_rng(1)
    with pytest.raises(ConfigError, match="0 of 100 drawn poses.*smaller margin"):
        draw_poses(REST, Region(15.0), 100, rng, lambda p: np.zeros(len(p), bool))
    with pytest.raises(ConfigError, match="margin 120 deg"):
        draw_poses(REST, Region(120), 100, rng)


def test_segment_frames_at_a_known_turn():
    pose = REST.copy()
    pose[0, :4] = rotation_vector_to_quaternion([0.0, 0.0, np.pi / 2])
    frames = segment_frames(RECORD, pose)
    np.testing.assert_allclose(frames["scapula_r"][0], [[0.02, 0.16, 0.0]], atol=1e-15)
    np.testing.assert_allclose(frames["humerus_r"][0], [[0.07, 0.16, 0.0]], atol=1e-15)


def test_level_counts_moving_attachments_of_wrapping_muscles_only():
    # Attachment at x = 0.2 on the axis of the ellipsoid, two radii from the centre: 2^2 - 1 = 3.
    np.testing.assert_allclose(attachment_levels(RECORD, REST)["wall"], [3.0])
    assert is_clear(RECORD, REST).tolist() == [True]


def test_attachment_inside_the_thorax_is_not_clear():
    inside = REST.copy()
    inside[0, :4] = rotation_vector_to_quaternion([0.0, np.pi, 0.0])  # clavicle to the left
    deep = muscle("wrapping", ORIGIN, ("scapula_r", [-0.14, -0.1, -0.05]), wraps=("wall",))
    record = replace(RECORD, muscles=(deep,))
    # In thorax axes at 0.02 - (0.16 - 0.14) = 0: the centre of the ellipsoid.
    assert attachment_levels(record, inside)["wall"][0] == pytest.approx(-1.0)
    assert is_clear(record, inside).tolist() == [False]


def test_clearance_asks_for_more_distance():
    assert is_clear(RECORD, REST, 2.9).tolist() == [True]  # the level is 3
    assert is_clear(RECORD, REST, 3.1).tolist() == [False]
