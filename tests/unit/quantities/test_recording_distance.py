"""Distances of predicted tasks at equal time, and of elevations at equal elevation."""

from dataclasses import astuple

import numpy as np
import pytest
from synthetic_study import solution

from scapulohumeral.model.rotations import ANGLE_NAMES, pose_to_trial, trial_to_pose
from scapulohumeral.quantities.population import UPWARD_ROTATION
from scapulohumeral.quantities.recording_distance import recording_distance, task_distance
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN, thorax_angles

pytestmark = pytest.mark.unit

RECORDED = solution("par2", "frontal", "quaternion").pose
GH_Z = ANGLE_NAMES.index("GH_z")
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


@pytest.mark.parametrize("higher_deg", [0.5, -0.5])
def test_a_trial_that_lowers_the_arm_has_no_rise_to_compare(higher_deg: float):
    """It is at its highest first: the prediction may begin above it, or below."""
    highest = int(thorax_angles(RECORDED)[:, ELEVATION_COLUMN].argmax())
    lowered = RECORDED[highest:]
    angles = pose_to_trial(lowered)
    angles[:, GH_Z] += np.deg2rad(higher_deg)
    found = recording_distance(trial_to_pose(angles), lowered, "lowering", 30.0)
    assert np.isnan(astuple(found)).all()


def test_an_elevation_that_never_rests_is_compared_but_at_rest():
    rise = thorax_angles(RECORDED)[:, ELEVATION_COLUMN]
    raised = RECORDED[rise > 40.0]
    found = recording_distance(raised, raised, "frontal", 30.0)
    assert np.isnan(found.ur_bias_rest_deg)
    assert found.ur_rmse_deg == pytest.approx(0.0, abs=1e-9)
    assert found.compared_to_deg == pytest.approx(rise.max())
