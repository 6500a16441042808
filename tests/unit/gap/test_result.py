"""The answer of a diagnosis keeps its format, and the page shows what the answer says."""

import json
from dataclasses import fields, replace

import pandas as pd
import pytest
from gap_files import GAIN, HASHES, STRENGTH, finished_diagnosis
from jsonschema import Draft202012Validator

from scapulohumeral.errors import DataError
from scapulohumeral.gap.curve_files import TABLES, check_curves, read_table, write_curves
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.left_over import SOMETHING_LEFT
from scapulohumeral.gap.output.figures import figures, isolability_figure
from scapulohumeral.gap.output.page import render_report, verdict
from scapulohumeral.gap.recording.one_movement import ONE_MOVEMENT
from scapulohumeral.gap.result import (
    Diagnosis,
    Regions,
    Share,
    Shrinkage,
    read_result,
    schema,
    to_json,
)

pytestmark = pytest.mark.unit


def diagnosis(**changes) -> Diagnosis:
    return finished_diagnosis(**{"hashes": HASHES, **changes})


def failed() -> Diagnosis:
    done = diagnosis()
    return Diagnosis("failed", "no convergence", done.mode, done.inputs, hashes=HASHES)


def objects(node):
    """All objects with properties in a schema."""
    if isinstance(node, dict):
        if "properties" in node and node.get("type") == "object":
            yield node
        for value in node.values():
            yield from objects(value)
    elif isinstance(node, list):
        for value in node:
            yield from objects(value)


def test_schema_is_valid_and_closed():
    Draft202012Validator.check_schema(schema())
    for entry in objects(schema()):
        assert entry["additionalProperties"] is False
        assert set(entry["required"]) == set(entry["properties"])


def test_the_file_has_the_fields_of_the_diagnosis():
    names = {entry.name for entry in fields(Diagnosis)} - {"curves", "told"}
    assert set(schema()["properties"]) == {"schema", *names}


@pytest.mark.parametrize("make", [diagnosis, failed], ids=["finished", "failed"])
def test_written_results_can_be_read(tmp_path, make):
    path = tmp_path / "result.json"
    path.write_text(to_json(make()))
    document = read_result(path)
    assert document["status"] == make().status
    assert [c["label"] for c in document["candidates"]] == [c.label for c in make().candidates]


def without_interval(done: Diagnosis) -> Diagnosis:
    return replace(done, gap=replace(done.gap, size=replace(done.gap.size, ci95=None)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: replace(d, none_p=0.2), r"sum 1\.15; expected 1"),
        (lambda d: replace(d, candidates=d.candidates[::-1]), "not sorted by p"),
        (lambda d: replace(d, set90=("body/hand_load",)), "body/hand_load is no candidate"),
        (lambda d: replace(d, classes=()), "class_id 1 is no class"),
        (lambda d: replace(d, status="perhaps"), "status: 'perhaps' is not one of"),
        (lambda d: replace(d, status="failed"), "status_reason: '' should be non-empty"),
        (
            lambda d: replace(d, status="failed", status_reason="x", candidates=(), set90=()),
            "is not of type 'null'",
        ),
        (lambda d: replace(d, none_p=None), "none_p: None is not of type 'number'"),
        (lambda d: replace(d, untestable=("emg_gain",)), "untestable.0: 'emg_gain' does not match"),
        (lambda d: replace(d, hashes={}), "'code' is a required property"),
        (lambda d: replace(d, gap=replace(d.gap, value=float("nan"))), "gap.value: nan"),
        (without_interval, "gap.size.ci95: null without a line in warnings"),
        (
            lambda d: replace(d, regions=Regions((replace(d.regions.shows[0], share=0.4),))),
            "regions.shows: shares add up to 0.4",
        ),
    ],
)
def test_answers_that_break_a_rule_are_refused(change, message):
    with pytest.raises(DataError, match=message):
        to_json(change(diagnosis()))


def test_a_missing_interval_needs_a_warning():
    done = replace(without_interval(diagnosis()), warnings=("too few trials for an interval",))
    assert json.loads(to_json(done))["gap"]["size"]["ci95"] is None


def test_pairs_are_in_alphabetical_order():
    done = diagnosis()
    pair = replace(done.candidates[0], label=f"{GAIN} + {STRENGTH}")
    with pytest.raises(DataError, match="alphabetical"):
        to_json(replace(done, candidates=(pair, done.candidates[1]), set90=(GAIN,)))


def test_curves_are_written_under_their_names(tmp_path):
    write_curves(diagnosis().curves, tmp_path)
    table = pd.read_csv(tmp_path / "curves" / "shows.csv")
    assert tuple(table.columns) == TABLES["shows"]
    assert len(table) == 202
    pd.testing.assert_frame_equal(read_table(tmp_path, "shows"), table)
    with pytest.raises(DataError, match="factors.csv: not there"):
        read_table(tmp_path, "factors")


def test_unknown_curves_and_columns_are_refused():
    with pytest.raises(DataError, match="'other': unknown"):
        check_curves({"other": pd.DataFrame()})
    with pytest.raises(DataError, match="'controls': columns a; expected name, shrinkage"):
        check_curves({"controls": pd.DataFrame({"a": []})})


def test_verdict_says_what_the_answer_holds():
    said = verdict(diagnosis())
    assert said["Gap"] == "yes; 7.2 against a threshold of 4.1 (max_t)."
    assert "enters at GH_rz, 35 to 88 % of the movement" in said["Where"]
    assert f"{STRENGTH}: f0_factor 0.55 [0.45, 0.66], p 0.71" in said["Cause"]
    assert f"Not told apart from {GAIN}; together p 0.95" in said["Cause"]
    assert said["Left"] == "nothing that shows, once the most probable cause is added."
    assert "removes 86 % [75, 92] of the reducible gap on trials not used" in said["How far"]


def test_verdict_says_that_something_is_left():
    remark = f"{SOMETHING_LEFT} that {STRENGTH} does not explain"
    assert verdict(diagnosis(warnings=("another remark", remark)))["Left"] == f"{remark}."


def test_verdicts_without_a_cause():
    done = diagnosis()
    no_gap = replace(done, gap=replace(done.gap, present=False))
    assert list(verdict(no_gap)) == ["Gap"]
    assert "none of the known effects" in verdict(replace(done, none_p=0.8))["Cause"]
    unnamed = verdict(replace(done, none_p=0.8))
    assert f"once {STRENGTH}, not named as the cause, is added" in unnamed["Left"]
    assert unnamed["How far"].startswith(f"{STRENGTH}, not named as the cause, would remove")
    assert "as probable as no gap at all (p 0.9)" in verdict(replace(done, no_gap_p=0.9))["Cause"]
    abstained = replace(done, status="abstained", status_reason="refits change branch")
    assert "refits change branch" in verdict(abstained)["Cause"]
    assert "no convergence" in verdict(failed())["Gap"]


def test_a_no_that_says_little_says_so():
    gap = replace(diagnosis().gap, present=False)
    for p, little in ((0.2, True), (0.8, False)):
        said = verdict(diagnosis(gap=gap, no_gap_p=p))["Gap"]
        assert said.startswith("no, none above the floor")
        assert ("has p 0.2 only: these trials show little" in said) == little
    assert "show little" not in verdict(diagnosis())["Gap"]


def test_another_movement_is_not_said_to_explain_itself():
    [first, *others] = diagnosis().candidates
    assert "<td>8 %</td>" in render_report(diagnosis(), "")
    moved = replace(first, label=MOVED)
    answer = diagnosis(candidates=(moved, *others), classes=(), set90=(MOVED,), next_trial=None)
    page = render_report(answer, "")
    assert "<td>8 %</td>" not in page
    assert "<td>12 %</td>" in page


def test_regions_that_do_not_stand_out_alone_are_explained():
    shows = diagnosis().curves["shows"]
    for threshold, told in ((1e3, True), (1e-3, False)):
        curves = {**diagnosis().curves, "shows": shows.assign(threshold_sigma=threshold)}
        page = render_report(diagnosis(curves=curves), "")
        assert ("may show in none of them alone" in page) == told


def test_a_gap_in_single_channels_only_leaves_nothing_to_remove():
    done = replace(diagnosis(), shrinkage=Shrinkage(None, None, None, ()))
    assert "nothing to remove" in verdict(done)["How far"]


def test_what_is_expected_of_one_more_task_is_told_from_what_was_seen():
    """8 % expected is no contradiction to nothing seen."""
    done = diagnosis(shrinkage=replace(diagnosis().shrinkage, new_task=Share(0.08, None, 6)))
    assert (
        "removes 8 % [no interval] of the reducible gap on one more task, as is expected (6"
        in (verdict(done)["How far"])
    )
    for after, words in ((2.5, "it grew by 50 % (6 trials)"), (1.5, "50 % went (6 trials)")):
        table = pd.DataFrame({"task": ["a"], "before": [2.0], "after": [after]})
        seen = replace(done, curves={**done.curves, "left_out": table})
        assert f"as is expected; on those left out of the fit, {words}" in verdict(seen)["How far"]


def test_the_page_says_what_the_set_of_answers_is():
    done = diagnosis()
    assert "nine in ten such sets hold the cause; together p 0.95):" in render_report(done, "")
    silent = replace(done, gap=replace(done.gap, present=False), set90=("none", STRENGTH))
    page = render_report(silent, "")
    assert "though no gap was found" in page
    assert "with and without a gap; together p 0.76):" in page
    untold = render_report(replace(done, told=False), "")
    assert "do not tell causes apart" in untold
    assert not any("nine in ten such sets" in one for one in (page, untold))
    assert "told" not in to_json(replace(done, told=False))


def all_tables() -> dict[str, pd.DataFrame]:
    """A small table for every figure."""
    phase = {"phase_percent": [0.0, 50.0, 100.0]}
    made = {
        "enters": {
            "kind": "dof", "name": "GH_rz", **phase, "effect": [0.0, 4.8, 1.0], "threshold": 2.0,
            "unit": "N m",
        },
        "overlay": {
            "task": "lift", "channel": "EMG_infra", **phase, "difference": [0.0, 0.1, 0.0],
            "with_effect": [0.0, 0.08, 0.0], "floor_low": [-0.02, -0.05, -0.05],
            "floor_high": [0.02, 0.05, 0.05], "unit": "1", "compared_with": "reference trials",
        },
        "signature": {
            "channel": "EMG_infra", **phase, "residual_sigma": [0.0, 7.0, 2.0],
            "signature_sigma": [0.0, 6.5, 2.0], "rest_sigma": [0.0, 0.5, 0.0],
        },
        "isolability": {"label_a": [STRENGTH], "label_b": [GAIN], "p_apart": [0.62]},
        "amplitude": {
            "task": ["lift"], "parameter": ["f0_factor"], "value": [0.55], "low": [0.45],
            "high": [0.66], "unit": ["1"],
        },
        "controls": {"name": ["black box"], "shrinkage": [0.4]},
    }  # fmt: skip
    return {"shows": diagnosis().curves["shows"], **{k: pd.DataFrame(t) for k, t in made.items()}}


def test_every_table_has_its_figure():
    drawn = figures(diagnosis(curves=all_tables()))
    assert set(drawn) == {
        "shows", "enters", "overlay", "signature", "isolability", "amplitude", "candidates",
        "shrinkage",
    }  # fmt: skip
    for picture in drawn.values():
        assert picture.svg.startswith("<svg")


@pytest.mark.filterwarnings("error")
def test_pairs_with_long_names_leave_room_for_their_matrix():
    pair = f"measurement/emg_crosstalk/EMG_trap_clav>EMG_trap_up + {STRENGTH}"
    table = pd.DataFrame({"label_a": [pair], "label_b": [GAIN], "p_apart": [0.62]})
    assert "+ body/" in isolability_figure(table).svg


@pytest.mark.parametrize("make", [diagnosis, failed], ids=["finished", "failed"])
def test_the_page_needs_no_network(make):
    page = render_report(make(), "scapulohumeral gap diagnose a.csv")
    assert "http://" not in page.replace("http://www.w3.org/", "")
    assert "https://" not in page
    assert "<script" not in page


@pytest.mark.parametrize(("repeated", "words"), [(True, "yes"), (False, "no"), (None, "not known")])
def test_the_page_says_whether_halves_have_a_region(repeated, words):
    done = diagnosis()
    [region] = done.regions.shows
    page = render_report(replace(done, regions=Regions((replace(region, repeated=repeated),))), "")
    assert f"<td>100 %</td><td>{words}</td>" in page
    to_json(replace(done, regions=Regions((replace(region, repeated=repeated),))))


def test_the_page_gives_no_share_of_a_gap_that_smooth_causes_would_leave():
    done = diagnosis()
    assert "<td>8 %</td>" in render_report(done, "")
    none = tuple(replace(one, unexplained_share=1.0) for one in done.candidates)
    page = render_report(replace(done, candidates=none), "")
    assert page.count("<td>–</td>") >= 2
    assert "<td>100 %</td><td>0.4</td>" not in page
    one = replace(done, candidates=(done.candidates[0], none[1]))
    assert "<td>100 %</td><td>–</td>" in render_report(one, "")


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("repeats", "floor from repeats of the same person"),
        ("configuration", "floor from the configuration"),
    ],
)
def test_the_page_says_where_the_floor_comes_from(source, words):
    done = diagnosis()
    page = render_report(replace(done, gap=replace(done.gap, floor_source=source)), "")
    assert words in page
    assert "floor from the bank" not in page


def test_the_page_says_what_was_assumed_of_person_and_sessions():
    values = {
        "stiffness": 10.0,
        "marker_share": 0.25,
        "electrode_share": 0.5,
        "signature_error": 0.3,
        "scatter_of_emg_lift": 1.4,
        "scatter_of_kinematics_lift": 1.0,
        "misfit": 1.7,
    }
    table = pd.DataFrame({"error": list(values), "value": list(values.values())})
    done = diagnosis()
    page = render_report(replace(done, curves={**done.curves, "errors": table}), "")
    told = (
        "10 times as firmly",
        "markers and posture by 0.25 of",
        "electrodes by 0.5 of",
        "off by 0.3 of their",
        "leaves 1.7 times",
        "EMG in lift scatters 1.4 times as much as repeats say",
    )
    for words in told:
        assert words in page
    assert "motion in lift" not in page
    assert "Causes are compared by" not in render_report(done, "")


def test_the_page_names_what_missing_data_cost():
    done = diagnosis()
    channels = replace(done.inputs.channels, emg=False)
    motion_only = replace(done, mode="no_reference", inputs=replace(done.inputs, channels=channels))
    page = render_report(motion_only, "")
    assert "No EMG:" in page
    assert "No reference trials" in page
    assert "No EMG:" not in render_report(done, "")
    assert "No EMG:" not in render_report(replace(motion_only, warnings=(ONE_MOVEMENT,)), "")
