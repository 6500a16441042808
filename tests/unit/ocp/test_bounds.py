"""Bounds of the unknowns hold a motion that is followed."""

import numpy as np
import pytest

from scapulohumeral.ocp.problem import ROOM_RAD, Bounds

pytestmark = pytest.mark.unit


def test_usual_bounds_stay_around_a_usual_motion():
    angles = np.tile([0.5] * 9 + [1.2], (6, 1))
    around = Bounds().around(angles)
    assert (around.elbow, around.angle) == (Bounds().elbow, Bounds().angle)


def test_an_elbow_that_extends_further_than_most_is_not_held():
    angles = np.tile([0.5] * 9 + [1.2], (6, 1))
    angles[3, 9] = -0.45
    around = Bounds().around(angles)
    assert around.elbow == pytest.approx((-0.45 - ROOM_RAD, Bounds().elbow[1]))
    assert around.angle == Bounds().angle


def test_euler_angles_may_count_turns():
    angles = np.tile([0.5] * 9 + [1.2], (6, 1))
    angles[:, 6] = np.linspace(0.0, 5.0, 6)
    assert Bounds().around(angles).angle == pytest.approx((-3.5, 5.0 + ROOM_RAD))
