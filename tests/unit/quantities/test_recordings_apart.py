"""Two recordings of one person: another frame is found, and what is not alike is left out."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from synthetic_study import solution

from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from scapulohumeral.quantities.recordings_apart import recordings_apart

pytestmark = pytest.mark.unit

RECORDED = solution("par2", "frontal", "quaternion").pose


def scapula_turned(pose: np.ndarray, turn_deg: tuple[float, float, float]) -> np.ndarray:
    """The scapula's frame turned about its own axes; clavicle and humerus stay where they are."""
    turn = Rotation.from_rotvec(turn_deg, degrees=True)
    turned = pose.copy()
    acromioclavicular = Rotation.from_quat(pose[:, 4:8], scalar_first=True) * turn
    glenohumeral = turn.inv() * Rotation.from_quat(pose[:, 8:12], scalar_first=True)
    turned[:, 4:8] = acromioclavicular.as_quat(scalar_first=True)
    turned[:, 8:12] = glenohumeral.as_quat(scalar_first=True)
    return turned


def test_a_recording_is_not_apart_from_itself():
    found = recordings_apart(RECORDED, RECORDED)
    assert found.matched_share == 1.0
    assert max(found.ur_rmse_deg, found.turn_deg, found.turn_sd_deg) < 1e-5


def test_a_frame_put_on_otherwise_is_one_turn_without_scatter():
    found = recordings_apart(scapula_turned(RECORDED, (0.0, 8.0, 6.0)), RECORDED)
    assert found.turn_deg == pytest.approx(10.0, abs=1e-6)
    assert found.turn_sd_deg < 1e-5
    assert found.clavicle_elevation_rmse_deg < 1e-9
    assert 5.0 < found.internal_rotation_rmse_deg < 11.0


def test_another_axial_rotation_of_the_arm_is_the_same_direction():
    angles = pose_to_trial(RECORDED)
    angles[:, 8] += np.deg2rad(40.0)
    found = recordings_apart(trial_to_pose(angles), RECORDED)
    assert found.matched_share == 1.0
    assert found.turn_deg < 1e-4


def test_directions_that_the_other_has_not_are_left_out():
    low = recordings_apart(RECORDED, RECORDED[:1])
    assert 0.0 < low.matched_share < 1.0
    away = RECORDED.copy()
    half_turn = Rotation.from_rotvec([0.0, 0.0, np.pi])
    humerus = Rotation.from_quat(away[:, 8:12], scalar_first=True) * half_turn
    away[:, 8:12] = humerus.as_quat(scalar_first=True)
    nowhere = recordings_apart(away, RECORDED[:1])
    assert nowhere.matched_share == 0.0
    assert np.isnan(nowhere.ur_rmse_deg)
