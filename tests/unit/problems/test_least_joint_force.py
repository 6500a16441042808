"""The least force on a joint, where it can be seen by hand."""

import numpy as np
import pytest

from scapulohumeral.problems.least_joint_force import least_force

pytestmark = pytest.mark.unit

# A weight of 10 N hangs in a joint (rows 1 to 3: forces; the last: a moment of 2 N m to be held).
BALANCE = np.array([0.0, -10.0, 0.0, 2.0])
REACTION = np.vstack([np.eye(3), np.zeros(3)])


def test_the_muscle_that_carries_the_weight_spares_the_joint():
    """Both hold the moment with 10 N; the first lifts, the second presses."""
    lifting, pressing = [0.0, 20.0, 0.0, -4.0], [20.0, 0.0, 0.0, -4.0]
    both = np.array([lifting, pressing]).T
    assert least_force(BALANCE, both, REACTION) == pytest.approx(0.0, abs=1e-9)
    assert least_force(BALANCE, both[:, 1:], REACTION) == pytest.approx(np.hypot(10, 10), rel=0.02)


def test_in_between_both_share():
    """A moment of 2 N m needs 10 N of two muscles that press along x or y; no weight."""
    press = np.array([[20.0, 0.0, 0.0, -4.0], [0.0, 20.0, 0.0, -4.0]]).T
    moment = np.array([0.0, 0.0, 0.0, 2.0])
    assert least_force(moment, press, REACTION) == pytest.approx(np.hypot(5, 5), rel=0.02)


def test_pose_that_nothing_holds_has_no_force():
    assert np.isnan(least_force(BALANCE, np.array([[0.0], [0.0], [0.0], [-1.0]]), REACTION))
