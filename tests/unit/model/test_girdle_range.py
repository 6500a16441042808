"""Ranges of SC and AC: wide enough for what was recorded, and where the girdle hangs."""

import numpy as np
import pytest
from places import REPOSITORY
from scipy.spatial.transform import Rotation

from scapulohumeral.model.girdle_range import arm_elevation, girdle_range
from scapulohumeral.model.tables import read_tables

pytestmark = pytest.mark.unit

COORDINATES = read_tables(REPOSITORY / "config/model").coordinates
MARGIN_RAD = np.deg2rad(15.0)


def frames(clavicle_deg, glenohumeral_deg):
    """Angles (F, 10) [rad] with clavicle elevations and glenohumeral rotations about z."""
    angles = np.zeros((len(clavicle_deg), 10))
    angles[:, 1], angles[:, 7] = np.deg2rad(clavicle_deg), np.deg2rad(glenohumeral_deg)
    return angles


def test_range_is_widened_to_the_recording_and_no_further():
    angles = frames([10.0, 20.0, 40.0], [0.0, 40.0, 80.0])
    angles[:, 0], angles[:, 3] = -0.5, np.deg2rad([40.0, 80.0, 20.0])
    found = girdle_range(COORDINATES, angles, "hanging", MARGIN_RAD)
    base = COORDINATES["SC_y"]
    assert found["SC_y"] == (base.min_rad, base.max_rad)
    np.testing.assert_allclose(np.rad2deg(found["AC_y"]), [20.0, 80.0])
    np.testing.assert_allclose(np.rad2deg(found["SC_z"][1]), 40.0)


def test_depression_ends_where_the_clavicle_is_while_the_arm_hangs():
    """Not where it is lowest: the clavicle of this recording dips once the arm is up."""
    angles = frames([2.0, 3.0, 4.0, 12.0, -6.0], [0.0, 0.5, -0.5, 60.0, 90.0])
    found = girdle_range(COORDINATES, angles, "hanging", MARGIN_RAD)
    np.testing.assert_allclose(np.rad2deg(found["SC_z"][0]), 3.0)


def test_depression_ends_no_higher_than_in_the_base_model():
    found = girdle_range(COORDINATES, frames([12.0, 14.0], [0.0, 50.0]), "hanging", MARGIN_RAD)
    assert found["SC_z"][0] == COORDINATES["SC_z"].min_rad


def test_wide_stops_lie_a_margin_beyond_everything_recorded():
    """Also where the clavicle is lowest, so that they bear nothing while the arm moves."""
    angles = frames([2.0, 3.0, 40.0, -6.0], [0.0, 0.5, 60.0, 90.0])
    found = girdle_range(COORDINATES, angles, "wide", MARGIN_RAD)
    np.testing.assert_allclose(np.rad2deg(found["SC_z"]), [-21.0, 55.0])
    base = COORDINATES["SC_y"]
    np.testing.assert_allclose(found["SC_y"][0], base.min_rad - MARGIN_RAD)


def test_elevation_is_the_angle_between_the_long_axes():
    angles = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 10))
    for row, elevation in zip(angles, arm_elevation(angles), strict=True):
        turn = Rotation.identity()
        for first, sequence in zip((0, 3, 6), ("YZX", "YZX", "YZY"), strict=True):
            turn = turn * Rotation.from_euler(sequence, row[first : first + 3])
        axis = turn.apply([0.0, 1.0, 0.0])
        assert elevation == pytest.approx(np.arctan2(np.hypot(axis[0], axis[2]), axis[1]))
