"""The table of what uncertain scalers leave of predictions."""

import pandas as pd
import pytest

from scapulohumeral.report.prediction.tables import spread_table

pytestmark = pytest.mark.unit


def test_every_elevation_shows_its_deviation_and_the_scaler_behind_it():
    spreads = pd.DataFrame(
        {
            "participant": ["par2"],
            "condition": ["cuff_w10"],
            "plane": ["scapular"],
            "arm_deg": [45.0],
            "mostly_by": ["fibre of clavicular_trapezius"],
            "upward_rotation_deg": [11.2],
            "sd_deg": [0.394],
            "by_it_deg": [0.365],
        }
    )
    (row,) = spread_table(spreads).rows
    assert row == (
        "par2", "cuff_w10", "scapular", "45", "11.2", "0.4", "fibre of clavicular trapezius (0.4)",
    )  # fmt: skip


def test_without_calibrated_predictions_there_is_nothing_to_show():
    assert spread_table(pd.DataFrame()).rows == []
