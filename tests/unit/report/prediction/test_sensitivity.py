"""Table and tornado of the sensitivity: changes from the unchanged case, failures kept."""

import numpy as np
import pytest
from synthetic_study import solution

from scapulohumeral.problems.changed_tracking import changed_tracking
from scapulohumeral.problems.sensitivity import Case
from scapulohumeral.problems.solution_mesh import on_mesh
from scapulohumeral.report.prediction.sensitivity import (
    sensitivity_rows,
    sensitivity_table,
    tornado,
)
from scapulohumeral.stages.distances.against import Predicted

pytestmark = pytest.mark.unit

TURN_DEG = 3.0
CASES = [
    Case("base", "base", "nothing"),
    Case("w_gh_divided", "weight", "w gh / 3", factors={"w_gh": 1 / 3}),
    Case("w_gh_times", "weight", "w gh × 3", factors={"w_gh": 3.0}),
    Case("mesh_20ms", "mesh", "mesh interval 0.02 s", time_step_s=0.02),
]


def predicted(found, status="optimal") -> Predicted:
    summary = {
        "status": status, "reached_from": "direct", "iterations": 40, "objective": 2.0,
        "body_mass_kg": 70.0, "planes": {"scapular": [0, len(found.time_s)]},
    }  # fmt: skip
    return Predicted(found, summary)


@pytest.fixture
def table():
    """Scapula turned upward with more weight on stability; with less the solve fails."""
    base = solution("par2", "scapular", "quaternion")
    turned = changed_tracking(base, Case("", "", "", scapula_turn_deg=TURN_DEG), 15.0)
    found = [predicted(base), predicted(base, "failed"), predicted(turned)]
    return sensitivity_table(CASES, [*found, predicted(on_mesh(base, 0.02))])


def test_changes_are_from_the_unchanged_case(table):
    rows = table.set_index("case")
    assert rows.ur_rms_change_deg["base"] == 0.0
    assert rows.ur_rms_change_deg["w_gh_times"] == pytest.approx(TURN_DEG, abs=0.2)
    assert rows.ur_peak_deg["w_gh_times"] > rows.ur_peak_deg["base"]
    assert rows.ur_largest_change_deg["mesh_20ms"] < 0.1


def test_failed_cases_stay_without_numbers(table):
    (failed,) = table[table.status == "failed"].to_dict("records")
    assert (failed["case"], failed["plane"]) == ("w_gh_divided", "scapular")
    assert np.isnan(failed["ur_peak_deg"])
    assert np.isnan(failed["objective"])
    shown = sensitivity_rows(table)
    assert [shown.rows[k][0] for k in shown.flagged] == ["w_gh_divided"]


def test_tornado_shows_weights_alone(table):
    svg = tornado(table).svg
    assert "w gh" in svg
    assert "mesh" not in svg
