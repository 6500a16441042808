"""Elevations joined to one motion: where each stands, what happens between, what is refused."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_study import solution

from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import relative_angle
from scapulohumeral.problems.composite import compose, composite_target

pytestmark = pytest.mark.unit

STEP, PAUSE_S = 0.04, 1.0
# A solution of the synthetic study has 40 nodes; a pause of 25 intervals has 24 nodes of its own.
NODES, BETWEEN = 40, 24
PAUSE = slice(NODES, NODES + BETWEEN)
JOINTS = (slice(0, 4), slice(4, 8), slice(8, 12))


@pytest.fixture
def motions():
    """Two elevations; SC and GH quaternions of the second have the other sign."""
    first, second = (solution("par2", trial, "quaternion") for trial in ("frontal", "sagittal"))
    flipped = second.q.copy()
    flipped[:, JOINTS[0]] *= -1
    flipped[:, JOINTS[2]] *= -1
    return first, replace(second, q=flipped, activation=0.5 * second.activation)


def test_each_motion_stands_where_its_nodes_say(motions):
    joined = compose(motions, STEP, PAUSE_S)
    after = NODES + BETWEEN
    assert joined.nodes == {"frontal": (0, NODES), "sagittal": (after, after + NODES)}
    np.testing.assert_allclose(np.diff(joined.time_s), STEP, atol=1e-12)
    assert joined.time_s[after] - joined.time_s[NODES - 1] == pytest.approx(PAUSE_S)
    for motion in motions:
        own = slice(*joined.nodes[motion.header["trial"]])
        x = joined.trajectory
        for joint in JOINTS:
            angle = relative_angle(x.q[own, joint], motion.q[:, joint])
            np.testing.assert_allclose(angle, 0.0, atol=1e-7)
        np.testing.assert_array_equal(x.q[own, 12], motion.q[:, 12])
        np.testing.assert_array_equal(x.u[own], motion.u)
        np.testing.assert_array_equal(x.a[own], motion.activation)
        np.testing.assert_array_equal(x.e[own], motion.excitation)
        np.testing.assert_allclose(x.reaction[own], motion.reaction_N)
        assert (joined.activity[own] == 1).all()
    assert (joined.activity[PAUSE] == 0).all()
    assert len(joined.activity) == len(joined.trajectory.q) == 2 * NODES + BETWEEN


def test_pause_is_at_rest_at_both_ends(motions):
    joined = compose(motions, STEP, PAUSE_S)
    x = joined.trajectory
    assert (x.u[PAUSE] == 0).all()
    for joint in JOINTS:
        np.testing.assert_allclose(np.linalg.norm(x.q[PAUSE, joint], axis=1), 1.0, atol=1e-12)
    elbow = x.q[NODES - 1 : NODES + BETWEEN + 1, 12]
    steps = np.abs(np.diff(elbow))
    # Minimum jerk: 10 tau^3 of the way in the first interval, 15/8 of the mean speed in the middle.
    way = abs(elbow[-1] - elbow[0])
    assert steps[[0, -1]].max() < 10 * (STEP / PAUSE_S) ** 3 * way
    assert steps.max() == pytest.approx(15 / 8 * STEP / PAUSE_S * way, rel=0.01)
    assert steps.sum() == pytest.approx(way)
    ends = x.a[[NODES - 1, NODES + BETWEEN]]
    assert (x.a[PAUSE] >= ends.min(axis=0)).all()
    assert (x.a[PAUSE] <= ends.max(axis=0)).all()


def test_signs_of_quaternions_do_not_jump(motions):
    q = compose(motions, STEP, PAUSE_S).trajectory.q
    for joint in JOINTS:
        assert ((q[1:, joint] * q[:-1, joint]).sum(axis=1) > 0.9).all()


def test_target_is_the_joined_motion(motions):
    joined = compose(motions, STEP, PAUSE_S)
    target = composite_target(joined, ("humerus", "elbow"), guidance=0.1)
    own = slice(*joined.nodes["frontal"])
    np.testing.assert_allclose(target.reference_rad[own], motions[0].angles_rad, atol=1e-9)
    np.testing.assert_array_equal(target.activity, joined.activity)
    np.testing.assert_array_equal(target.time_s, joined.time_s)
    assert (target.tracked, target.guidance, target.emg) == (("humerus", "elbow"), 0.1, None)


def test_one_motion_has_no_pause(motions):
    joined = compose(motions[:1], STEP, PAUSE_S)
    assert joined.nodes == {"frontal": (0, NODES)}
    assert (joined.activity == 1).all()


def test_other_meshes_and_euler_angles_are_refused(motions):
    coarse = replace(motions[1], time_s=2 * motions[1].time_s)
    with pytest.raises(DataError, match=r"sagittal: mesh interval 0.08 s; expected 0.04 s"):
        compose([motions[0], coarse], STEP, PAUSE_S)
    with pytest.raises(DataError, match="frontal: formulation euler"):
        compose([solution("par2", "frontal", "euler")], STEP, PAUSE_S)
    with pytest.raises(DataError, match="pause of 0.05 s"):
        compose(motions, STEP, 0.05)
