"""Calibrations to arms of other structure: their table, and what the report makes of it."""

import json

import pytest

from scapulohumeral.report.calibration.figures import recovery_table as shown_table
from scapulohumeral.stages.calibration_score import recovery_table

pytestmark = pytest.mark.unit


def entry(value: float, plant: float, paper: float, identifiable: bool = True) -> dict:
    """A scored scaler with an interval of 0.1 to either side."""
    low, high = value - 0.1, value + 0.1
    return {
        "value": value,
        "ci90": [low, high],
        "identifiable": identifiable,
        "at_bound": False,
        "paper_problem": paper,
        "plant": plant,
        "covered": low <= plant <= high,
    }


@pytest.fixture
def table(tmp_path):
    """Two groups of one arm: one off by 20 % and missed by its interval, one unidentifiable."""
    groups = {
        "upper": {"force": entry(1.2, 1.0, 1.5), "fibre": entry(1.0, 1.0, 0.9)},
        "lower": {"force": entry(1.04, 1.0, 1.1, False), "fibre": entry(0.9, 0.9, 0.9)},
    }
    path = tmp_path / "par2.json"
    document = {"groups": groups, "misfit": 1.5, "status": "converged"}
    path.write_text(json.dumps(document), encoding="utf-8")
    return recovery_table({"cubed_effort": path})


def test_table_has_a_row_per_scaler(table):
    assert len(table) == 4
    first = table.set_index(["group", "kind"]).loc[("upper", "force")]
    assert (first.arm, first.value, first.plant, first.paper_problem) == (
        "cubed_effort", 1.2, 1.0, 1.5,
    )  # fmt: skip
    assert not first.covered
    assert (first.low, first.high, first.misfit) == pytest.approx((1.1, 1.3, 1.5))


def test_report_gives_medians_over_all_and_coverage_of_the_identifiable(table):
    force, fibre = shown_table(table).rows
    assert force[0] == "cubed effort"
    # Errors of 20 % and 4 %, those of the paper's problem of 50 % and 10 %.
    assert force[2:6] == ("12.0", "30.0", "1 of 2", "0 of 1")
    assert fibre[2:6] == ("0.0", "5.0", "2 of 2", "2 of 2")
    assert force[6:] == ("1.50", "converged")


def test_nothing_is_shown_where_nothing_was_calibrated(table):
    assert shown_table(table.iloc[:0]).rows == []
