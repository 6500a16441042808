"""Angles at fixed elevations of an arm that dips on its way."""

import numpy as np
import pytest

from scapulohumeral.quantities.published_distance import at_level
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN

pytestmark = pytest.mark.unit

ELEVATIONS = [0.0, 10.0, 20.0, 15.0, 18.0, 30.0, 12.0]


@pytest.mark.parametrize(
    ("level", "node"), [(0.0, 0.0), (5.0, 0.5), (20.0, 2.0), (22.0, 4.0 + 4.0 / 12.0), (30.0, 5.0)]
)
def test_the_first_time_at_an_elevation_counts(level: float, node: float) -> None:
    angles = np.zeros((len(ELEVATIONS), 11))
    angles[:, ELEVATION_COLUMN] = ELEVATIONS
    angles[:, 10] = np.arange(len(ELEVATIONS))
    assert at_level(angles, 10, level) == pytest.approx(node)


@pytest.mark.parametrize("level", [-1.0, 31.0])
def test_an_elevation_that_is_not_reached_has_no_angle(level: float) -> None:
    angles = np.zeros((len(ELEVATIONS), 10))
    angles[:, ELEVATION_COLUMN] = ELEVATIONS
    assert np.isnan(at_level(angles, 0, level))
