"""Tables beside published measurements: what holds, what does not, and what is not there."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from places import REPOSITORY

from scapulohumeral.errors import DataError
from scapulohumeral.model.motion import read_motion
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)
from scapulohumeral.report.prediction.literature import (
    CLAIMS,
    _elements,
    _judged,
    arm_along_rise,
    joint_forces,
)

pytestmark = pytest.mark.unit

FOLDER = REPOSITORY / "config/literature"
WHOLE = {"par2": "healthy"}
NAMES = ("supra_1", "supra_2", "infra_1")


@pytest.mark.parametrize(
    ("claim", "elements", "holds"),
    [
        ("positive", [0, 1], True),
        ("negative", [0, 1], False),
        ("negative", [2], True),
        ("largest", [0, 1], True),
        ("largest", [2], False),
        ("smallest", [2], True),
        ("smallest", [0], False),
    ],
)
def test_claims_are_judged_by_sign_of_the_mean_or_by_the_extreme(claim, elements, holds):
    arm = _judged("par2 frontal 30 deg", np.array([20.0, -5.0, -30.0]), elements, claim, NAMES)
    assert arm.holds == holds
    assert arm.extreme == {"largest": "supra_1 20", "smallest": "infra_1 -30"}.get(claim, "")


def test_arm_along_a_recorded_rise_is_shortening_per_upward_rotation():
    """An element that lengthens by 20 mm per radian works against the rotation by 20 mm."""
    folder = REPOSITORY / "config/participants/par2"
    pose = trial_to_pose(read_motion(folder / "frontal.csv").angles_rad)

    def lengths(pose, _):
        upward = np.deg2rad(thorax_angles(pose)[:, UPWARD_ROTATION_COLUMN])
        return np.stack([0.1 + 0.02 * upward, 0.3 - 0.01 * upward], axis=1), None

    forces = SimpleNamespace(lengths=lengths)
    assert arm_along_rise(forces, pose, [0]) == pytest.approx(-20.0)
    assert arm_along_rise(forces, pose, [0, 1]) == pytest.approx(-5.0)
    low = pose[thorax_angles(pose)[:, ELEVATION_COLUMN] < 25.0]
    assert arm_along_rise(forces, low, [0]) is None


def test_unknown_elements_and_claims_are_refused():
    forces = SimpleNamespace(geometry=SimpleNamespace(names=NAMES))
    claim = {"muscle": "supraspinatus", "elements": "supra_1 supra_9", "claim": "positive"}
    with pytest.raises(DataError, match="supraspinatus: elements supra_9, claim 'positive'"):
        _elements(forces, claim)
    with pytest.raises(DataError, match="all known, claim 'huge'; .* positive, negative"):
        _elements(forces, {**claim, "elements": "supra_1", "claim": "huge"})


def test_committed_claims_name_elements_of_the_model_and_say_where_they_are_from():
    claims = pd.read_csv(FOLDER / "moment_arms.csv", dtype=str)
    muscles = set(pd.read_csv("config/model/muscles.csv").muscle)
    assert not {name for row in claims.elements for name in row.split()} - muscles
    assert set(claims.claim) <= set(CLAIMS)
    assert claims.notna().all(axis=None)
    assert set(claims["read"]) <= {"abstract", "paper", "textbook"}


def forces(plane, **changes) -> pd.DataFrame:
    row = {
        "participant": "par2", "variant": "study_arm", "condition": "healthy", "plane": plane,
        "status": "optimal", "arm_peak_deg": 93.0, "gh_force_rest_bw": 5.0,
        "gh_force_30_bw": 20.0, "gh_force_45_bw": 30.0, "gh_force_60_bw": 40.0,
        "gh_force_90_bw": 58.9, "gh_force_peak_bw": 60.0,
    }  # fmt: skip
    return pd.DataFrame([row | changes])


def test_forces_are_compared_where_implants_were_measured():
    (row,) = joint_forces(forces("frontal"), WHOLE, FOLDER / "joint_force.csv").rows
    assert row[-2:] == ("85.3 ± 26.4 (n = 6)", "-1.0")
    (row,) = joint_forces(forces("scapular"), WHOLE, FOLDER / "joint_force.csv").rows
    assert row[-2:] == ("none", "")
    low = forces("sagittal", gh_force_90_bw=np.nan, arm_peak_deg=72.0)
    (row,) = joint_forces(low, WHOLE, FOLDER / "joint_force.csv").rows
    assert row[-1] == "arm too low"
    assert row[-4:-2] == ("", "60.0")
    assert (
        joint_forces(forces("frontal", status="failed"), WHOLE, FOLDER / "joint_force.csv") is None
    )


def test_forces_of_generic_muscles_are_shown_where_there_are_no_others():
    own = forces("frontal", condition="healthy_generic")
    (row,) = joint_forces(own, {"par2": "healthy_generic"}, FOLDER / "joint_force.csv").rows
    assert row[-1] == "-1.0"
    assert joint_forces(own, WHOLE, FOLDER / "joint_force.csv") is None
