"""Quantities of one elevation, and forces as shares of body weight."""

import numpy as np
import pytest

from scapulohumeral.quantities.joint_loading import percent_body_weight
from scapulohumeral.quantities.prediction_rows import rise_quantities
from scapulohumeral.quantities.published_distance import ANGLES
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN, UPWARD_ROTATION_COLUMN

pytestmark = pytest.mark.unit


def test_force_is_told_as_a_share_of_weight_at_standard_gravity() -> None:
    assert percent_body_weight(98.0665, 10.0) == pytest.approx(100.0)
    np.testing.assert_allclose(percent_body_weight(np.array([0.0, 49.03325]), 10.0), [0.0, 50.0])


def test_elevation_is_told_at_its_levels_and_where_it_starts() -> None:
    """The arm waits, rises by 90 deg with a rhythm of two, and comes down with a larger force."""
    elevation = np.concatenate([[10.0, 10.0], np.linspace(10.0, 100.0, 91), [50.0, 10.0]])
    angles = np.zeros((len(elevation), 10))
    angles[:, ELEVATION_COLUMN] = elevation
    angles[:, UPWARD_ROTATION_COLUMN] = elevation / 3.0
    angles[:, ANGLES["clavicle_elevation"]] = elevation / 10.0
    force = np.arange(len(elevation), dtype=float)
    found = rise_quantities(angles, force, "N", (15.0, 120.0), (70.0,))
    assert list(found) == [
        "ur_15_deg", "ur_120_deg", "ur_peak_deg", "clavicle_70_deg", "rhythm",
        "gh_force_start_N", "gh_force_peak_N",
    ]  # fmt: skip
    assert found["ur_15_deg"] == pytest.approx(5.0)
    assert np.isnan(found["ur_120_deg"])
    assert found["ur_peak_deg"] == pytest.approx(100.0 / 3.0)
    assert found["clavicle_70_deg"] == pytest.approx(7.0)
    assert found["rhythm"] == pytest.approx(2.0)
    # The last node before the arm rises, and the last of all.
    assert (found["gh_force_start_N"], found["gh_force_peak_N"]) == (2.0, len(elevation) - 1.0)
