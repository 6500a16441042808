"""Tables of committed records: what did not finish or changed is marked."""

import pytest

from scapulohumeral.report.speed import (
    diagnosis_table,
    kill_table,
    opty_table,
    peer_table,
    side_by_side,
    speed_content,
)
from scapulohumeral.templates import page_template

pytestmark = pytest.mark.unit


def solve(seconds: float, objective: float, status: str = "optimal") -> dict:
    """What tests/side_by_side writes of one solve."""
    return {
        "processor_seconds": seconds, "iterations": 40, "objective": objective, "status": status,
        "peak_MB": 500.0,
    }  # fmt: skip


@pytest.fixture
def side() -> dict:
    pairs = {
        "tracking/par2/frontal_euler": (solve(30.0, 2.0), solve(10.0, 1.9)),
        "tracking/par2/sagittal_euler": (solve(20.0, 2.0), solve(10.0, 2.1)),
        "prediction/par2/healthy": (solve(90.0, 2.0), solve(30.0, 2.0, "slow")),
    }
    rows = [
        {"case": case, "former": former, "present": present, "load": 1.0,
         "difference": {"objective": 0.0, "constraints": 2e-16}}
        for case, (former, present) in pairs.items()
    ]  # fmt: skip
    return {"commit": "3898186", "calibrations": "present", "rows": rows}


@pytest.fixture
def peers() -> dict:
    own = {
        "tracking_processor_seconds": 10.0, "tracking_iterations": 36,
        "limited_memory_processor_seconds": 120.0, "limited_memory_iterations": 600,
        "limited_memory_seconds": None, "tracking_optimal": True,
    }  # fmt: skip
    ended = {"finished": True, "processor_seconds": 100.0}
    over = {"finished": False, "processor_seconds": 360.0, "message": "not finished in 360 s"}
    evaluated = {"own_evaluation_seconds": 0.002, "evaluation_seconds": 0.004}
    found = {
        "casadi": {**ended, "build_seconds": 55.0, "solve_seconds": 30.0, "iterations": 60,
                   "optimal": True, "message": "Solve_Succeeded"},
        "moco_inverse": {**over, "build_seconds": 10.0, "iterations": 8},
        "moco_track": {**over, "processor_seconds": 1.0, "message": "RuntimeError: locked"},
        "opty_8": {**over, "own_build_seconds": 15.0},
        "opty_2": {**ended, **evaluated, "own_build_seconds": 15.0, "build_seconds": 150.0,
                   "message": ""},
    }  # fmt: skip
    return {"own": own, "peers": found}


def test_times_are_summed_by_kind_and_a_higher_objective_or_a_failure_is_marked(side):
    shown = side_by_side(side)
    assert [row[3] for row in shown.rows] == ["3.0", "2.0", "3.0", "2.5", "3.0"]
    assert shown.rows[3][0] == "tracking, sum of 2"
    assert shown.flagged == {1, 2}
    assert shown.rows[2][-1] == "optimal; slow"


def test_a_peer_is_compared_by_what_it_took_to_solve_and_says_why_it_did_not(peers):
    shown = peer_table(peers)
    rows = {row[0]: row for row in shown.rows}
    assert rows["CasADi, IPOPT, exact Hessian"][2:] == (
        "55.0",
        "30.0",
        "60",
        "Solve_Succeeded",
        "3.0",
    )
    assert rows["OpenSim MocoInverse"][3:] == ("350.0", "8", "not finished in 360 s", "> 35.0")
    assert rows["OpenSim MocoTrack"][5] == "RuntimeError: locked"
    assert rows["this solver, limited memory"][5:] == ("objective not reached", "> 12.0")
    assert shown.flagged == {1, 3, 4}


def test_a_peer_that_gave_up_has_not_solved_it(peers):
    stopped = {"optimal": False, "message": "Maximum_CpuTime_Exceeded"}
    peers["peers"]["casadi"] |= stopped
    del peers["peers"]["moco_track"]
    shown = peer_table(peers)
    assert shown.rows[2][5:] == ("Maximum_CpuTime_Exceeded", "> 3.0")
    assert shown.flagged == {1, 2, 3}


def test_a_tracking_that_is_not_optimal_is_said_and_marked(peers):
    assert peer_table(peers).rows[0][5] == "optimal"
    peers["own"]["tracking_optimal"] = False
    shown = peer_table(peers)
    assert shown.rows[0][5] == "not optimal"
    assert 0 in shown.flagged


def test_opty_stands_by_number_of_muscles(peers):
    shown = opty_table(peers)
    assert [row[0] for row in shown.rows] == ["2", "8"]
    assert shown.rows[0][1:] == ("15.0", "150.0", "2.00", "4.00", "2.00", "built")
    assert shown.flagged == {1}


def test_a_kill_that_cost_finished_work_is_marked():
    row = {"killed_after_s": 10.0, "finished": 3, "lost": 2, "repeated": 0, "resumed": 1}
    assert kill_table({"rounds": [row, {**row, "repeated": 1}]}).flagged == {1}


def test_diagnoses_are_compared_from_nothing_and_once_more(side):
    both = {
        "former": {"first": {"processor_seconds": 90.0}, "again": {"processor_seconds": 60.0}},
        "present": {"first": {"processor_seconds": 45.0}, "again": {"processor_seconds": 20.0}},
    }
    diagnosed = {**side, "diagnoses": [{"case": "motion_alone", **both}]}
    shown = diagnosis_table(diagnosed)
    assert shown.rows == [("motion alone", "90.0", "45.0", "2.0", "60.0", "20.0", "3.0")]
    template = page_template("scapulohumeral.report", "speed.html.j2")
    found = [template.render(speed=speed_content({"side_by_side": r})) for r in (side, diagnosed)]
    assert ["motion alone" in text for text in found] == [False, True]


def test_the_section_says_what_was_not_run(side):
    template = page_template("scapulohumeral.report", "speed.html.j2")
    assert "was run" in template.render(speed=speed_content({}))
    text = template.render(speed=speed_content({"side_by_side": side}))
    assert "3898186" in text
    assert "2e-16" in text
    assert "Peers" not in text
