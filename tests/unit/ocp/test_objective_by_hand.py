"""What is minimised, against other software and by hand: derivatives agree with any objective."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from small_arm import STEP, small_motion, small_objective

from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.objective import Trajectory, Weights

pytestmark = pytest.mark.unit

BOTH = pytest.mark.parametrize("name", ["quaternion", "euler"])
AC_DISTANCE_M = 0.5


def coordinates(angles: np.ndarray, name: str) -> np.ndarray:
    """Generalised coordinates of joint angles (T, 10)."""
    return angles if name == "euler" else trial_to_pose(angles)


def segments(angles: np.ndarray) -> tuple[Rotation, Rotation, Rotation]:
    """Clavicle, scapula and humerus in the thorax, by scipy, of joint angles (10,)."""
    clavicle = Rotation.from_euler("YZX", angles[0:3])
    scapula = clavicle * Rotation.from_euler("YZX", angles[3:6])
    return clavicle, scapula, scapula * Rotation.from_euler("YZY", angles[6:9])


@BOTH
def test_tracking_errors_are_those_of_scipy(name):
    errors = pose_errors(name)
    angles = small_motion(2)
    turned = angles + np.random.default_rng(3).uniform(-0.1, 0.1, angles.shape)
    reference = errors.reference(angles, AC_DISTANCE_M)
    at_reference, _ = errors.function.first(coordinates(angles, name), reference)
    np.testing.assert_allclose(at_reference, 0.0, atol=1e-12)
    found, _ = errors.function.first(coordinates(turned, name), reference)
    groups = np.array(errors.groups)
    for row, ours, theirs in zip(found, turned, angles, strict=True):
        mine, known = segments(ours), segments(theirs)
        if name == "euler":
            expected = {
                "clavicle": ours[:2] - theirs[:2],
                "scapula": mine[1].as_euler("YZX") - known[1].as_euler("YZX"),
                "humerus": mine[2].as_euler("YZY") - known[2].as_euler("YZY"),
            }
        else:
            tips = [AC_DISTANCE_M * one[0].as_matrix()[:, 0] for one in (mine, known)]
            expected = {"clavicle": tips[0] - tips[1]}
            for place, segment in ((1, "scapula"), (2, "humerus")):
                between = (mine[place] * known[place].inv()).as_quat(canonical=True)
                expected[segment] = between[:3]
        expected["elbow"] = ours[9:] - theirs[9:]
        for segment, error in expected.items():
            np.testing.assert_allclose(row[groups == segment], error, atol=1e-12, err_msg=segment)


@BOTH
def test_tracking_and_norm_terms_by_hand(name):
    """Two nodes: half an interval each; the elbow is followed where the rest is not."""
    weights = Weights(trajectory=3.0, quaternion_norm=7.0)
    angles = small_motion(2)
    objective = replace(
        small_objective(name, 2, 0.0),
        reference=pose_errors(name).reference(angles, AC_DISTANCE_M),
        weights=weights,
        activity=np.array([1.0, 0.0]),
        elbow_activity=np.array([0.0, 1.0]),
    )
    q = coordinates(angles, name).copy()
    q[:, -1] += [0.1, 0.2]
    if name == "quaternion":
        q[:, :4] *= 1.1
    else:
        q[:, 1] += 0.1
    none = {"u": (2, 10), "a": (2, 3), "e": (2, 3), "reaction": (2, 3)}
    terms = objective.terms(Trajectory(q=q, **{k: np.zeros(v) for k, v in none.items()}))
    assert terms["elbow"] == pytest.approx(3.0 * 0.5 * STEP * 0.2**2, rel=1e-9)
    if name == "quaternion":
        assert terms["norm"] == pytest.approx(7.0 * 2 * 0.5 * STEP * (1.1**2 - 1.0) ** 2, rel=1e-9)
    else:
        assert terms["clavicle"] == pytest.approx(3.0 * 0.5 * STEP * 0.1**2, rel=1e-9)
