"""Wilson intervals against published and exact values."""

import pytest

from scapulohumeral.quantities.proportion import wilson95

pytestmark = pytest.mark.unit


def test_known_intervals() -> None:
    # Newcombe 1998, Stat Med 17: 857-872, table I, method 3.
    assert wilson95(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson95(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert wilson95(29, 29) == pytest.approx((0.8830, 1.0), abs=1e-4)
