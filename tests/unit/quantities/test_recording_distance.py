"""Distance of a predicted daily task: angle by angle, at equal time."""

import numpy as np
import pytest
from synthetic_study import solution

from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from scapulohumeral.quantities.population import UPWARD_ROTATION
from scapulohumeral.quantities.recording_distance import task_distance
from scapulohumeral.quantities.segment_angles import thorax_angles

pytestmark = pytest.mark.unit

RECORDED = solution("par2", "frontal", "quaternion").pose
RMSE = ("ur", "tilt", "internal_rotation", "clavicle_elevation", "arm")


def errors(pose: np.ndarray) -> dict[str, float]:
    found = task_distance(pose, RECORDED)
    return {name: getattr(found, f"{name}_rmse_deg") for name in RMSE}


def test_a_right_prediction_is_nowhere_off_and_the_yardstick_is_the_recording():
    assert max(errors(RECORDED).values()) < 1e-9
    upward = thorax_angles(RECORDED)[:, UPWARD_ROTATION]
    found = task_distance(RECORDED, RECORDED)
    still = np.sqrt(np.mean((upward - upward.mean()) ** 2))
    assert found.ur_recorded_sd_deg == pytest.approx(still)
    assert still > 1.0, "the scapula turns"


def test_a_clavicle_held_higher_carries_the_scapula_and_keeps_its_sign():
    angles = pose_to_trial(RECORDED)
    # The clavicle is elevated by Z of its Y-Z-X, which is its second angle in the thorax, too.
    angles[:, 1] += np.deg2rad(4.0)
    found = task_distance(trial_to_pose(angles), RECORDED)
    assert found.clavicle_elevation_rmse_deg == pytest.approx(4.0)
    assert found.ur_bias_deg > 1.0
    assert abs(found.ur_bias_deg) <= found.ur_rmse_deg + 1e-9


def test_equal_time_counts_and_not_equal_elevation():
    late = np.concatenate([RECORDED[:1], RECORDED[:-1]])
    assert errors(late)["arm"] > 0.5
    assert errors(late)["ur"] > 0.1
