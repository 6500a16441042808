"""A pose lies in the region of the fit if the fit could have drawn it."""

import numpy as np
import pytest

from scapulohumeral.model.muscle_paths.pose_region import Region, draw_poses
from scapulohumeral.model.rotations import (
    girdle_turned,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.quantities.fit_region import outside_region

pytestmark = pytest.mark.unit

REGION = Region(10.0, (-30.0, 30.0), 20.0)
RECORDED = trial_to_pose(
    np.deg2rad(
        [[-20, 5, 0, 40, 10, -5, 10, -30, 40, 20], [-40, 15, 20, 30, 40, 5, 60, -90, 30, 60]]
    )
)


def turned(clavicle_deg=(0, 0, 0), scapula_deg=(0, 0, 0)):
    """The first recorded pose with its girdle turned under the arm."""
    return girdle_turned(RECORDED[:1], np.deg2rad(clavicle_deg), np.deg2rad(scapula_deg))


def test_whatever_the_fit_draws_without_margin_is_inside():
    drawn = draw_poses(RECORDED, Region(0.0, (-30.0, 30.0), 20.0), 300, np.random.default_rng(1))
    assert not outside_region(drawn, RECORDED, REGION).any()


def test_draws_with_margin_are_inside_and_wider_draws_are_not():
    drawn = draw_poses(RECORDED, REGION, 300, np.random.default_rng(1))
    assert outside_region(drawn, RECORDED, REGION).mean() < 0.1
    far = draw_poses(RECORDED, Region(40.0), 300, np.random.default_rng(1))
    assert outside_region(far, RECORDED, REGION).mean() > 0.5


@pytest.mark.parametrize(
    ("clavicle", "scapula", "outside"),
    [
        # 20 deg of the clavicle's own and 10 of the margin of its joints.
        ((29, 0, 0), (0, 0, 0), False),
        ((31, 0, 0), (0, 0, 0), True),
        # Upward 30 deg of the scapula's own and 10 of the margin of its joints.
        ((0, 0, 0), (0, 0, 39), False),
        ((0, 0, 0), (0, 0, -41), True),
        # Tilt and internal rotation as the clavicle.
        ((0, 0, 0), (29, 0, 0), False),
        ((0, 0, 0), (0, 31, 0), True),
        # All together.
        ((0, 0, -19), (10, -15, 29), False),
    ],
)
def test_border_is_that_of_the_draws(clavicle, scapula, outside):
    assert outside_region(turned(clavicle, scapula), RECORDED, REGION).tolist() == [outside]


@pytest.mark.parametrize("turns", [((0, 15, 0), (0, 0, 0)), ((0, 0, 0), (15, 0, 0))])
def test_without_turns_of_the_girdle_joints_have_the_margin_alone(turns):
    pose = turned(*turns)
    assert outside_region(pose, RECORDED, Region(10.0, (-30.0, 30.0))).tolist() == [True]
    assert outside_region(pose, RECORDED, REGION).tolist() == [False]


def test_arm_and_elbow_count():
    pose = RECORDED[:1].copy()
    # More than the margins of three joints.
    turn = rotation_vector_to_quaternion(np.deg2rad([0.0, 31.0, 0.0]))
    pose[:, 8:12] = quaternion_multiply(pose[:, 8:12], turn)
    assert outside_region(pose, RECORDED, REGION).tolist() == [True]
    bent = RECORDED[:1].copy()
    bent[0, 12] -= np.deg2rad(11.0)
    assert outside_region(bent, RECORDED, REGION).tolist() == [True]
    assert outside_region(-RECORDED[:1] * ([1] * 12 + [-1]), RECORDED, REGION).tolist() == [False]
