"""The section on cases of known cause, from a table as it is committed."""

from pathlib import Path

import jinja2
import pandas as pd
import pytest

from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.report.gap.real_cases import WORDS, real_content
from scapulohumeral.report.study import read_known_cases

pytestmark = pytest.mark.unit

LOAD = "body/hand_load"
FRAME = "input/frame_misalignment/humerus"


def row(case: str, kind: str, first: str, p: float, **changes) -> dict:
    """One row as `scapulohumeral.gap.benchmark.real_cases` writes it."""
    truth = "no_gap" if kind == "no_effect" else LOAD
    return {
        "case": case, "kind": kind, "known": "2 kg", "source": "Seth 2019", "truth": truth,
        "status": "ok", "present": first != "no_gap", "p_value": 0.016, "first": first,
        "first_p": p, "right": first == truth, "in_set90": first == truth, "set_size": 3,
        "truth_p": 0.2, "none_p": 0.1, "no_gap_p": 0.1, "unexplained": 0.8, "held_out": None,
        "status_reason": "", "said": "", "seconds": 61.0, **changes,
    }  # fmt: skip


@pytest.fixture
def table(tmp_path: Path) -> pd.DataFrame:
    """Written and read again: empty cells, and truths of mixed columns."""
    unknown = ("present", "p_value", "first", "first_p", "right", "in_set90", "set_size", "truth_p")
    failed = {**dict.fromkeys(unknown), "status": "failed", "status_reason": "no solve"}
    rows = [
        row("load", "effect", LOAD, 0.7, held_out=-0.13, said="one | two"),
        row("load_shrug", "effect", FRAME, 0.68),
        row("unsure", "effect", FRAME, 0.4),
        row("cuff", "effect", FRAME, 0.9, status="abstained", status_reason="variants differ"),
        row("broken", "simulation", "", 0.0) | failed,
        row("still_1", "no_effect", "no_gap", 0.8),
        row("still_2", "no_effect", "none", 0.9),
        row("still_3", "no_effect", "no_gap", 0.8),
    ]
    path = tmp_path / "real_cases.csv"
    pd.DataFrame(rows).to_csv(path, index=False)
    return read_known_cases(path)


def test_only_what_misleads_is_pointed_out(table: pd.DataFrame) -> None:
    """Neither a right cause, nor a doubtful one, nor an answer that decides nothing."""
    content = real_content(table)
    assert content["confident_and_wrong"] == ["load_shrug"]
    assert content["cases"].flagged == {1}


def test_wrong_cause_of_a_null_misleads_too(table: pd.DataFrame) -> None:
    table.loc[table.case == "still_2", "first"] = FRAME
    content = real_content(table)
    assert content["confident_and_wrong"] == ["load_shrug", "still_2"]
    assert content["nulls"].flagged == {1}


def test_another_movement_is_no_cause_but_told_where_it_is_wrong(table: pd.DataFrame) -> None:
    assert {NONE, NO_GAP, MOVED} == set(WORDS)
    table.loc[table.case == "load_shrug", "first"] = MOVED
    content = real_content(table)
    assert not content["confident_and_wrong"]
    assert content["moved_and_wrong"] == ["load_shrug (68 %)"]
    assert content["cases"].flagged == {1}
    assert content["cases"].rows[1][3] == "the movement was done differently (68 %)"
    table.loc[table.case == "load_shrug", "right"] = True
    assert not real_content(table)["moved_and_wrong"]


def test_false_alarms_are_counted_with_their_interval(table: pd.DataFrame) -> None:
    assert real_content(table)["alarms"] == "1 of 3 [6 %, 79 %]"
    assert real_content(table[table.kind != "no_effect"])["alarms"] is None


def test_errors_put_in_are_right_only_with_a_gap(table: pd.DataFrame) -> None:
    spoilt = [
        row("skin", "artefact", LOAD, 0.9),
        row("frame", "artefact", FRAME, 0.6),
        row("small", "artefact", LOAD, 0.3, present=False),
    ]
    content = real_content(pd.concat([table, pd.DataFrame(spoilt)], ignore_index=True))
    assert content["spoilt_right"] == "1 of 3 [6 %, 79 %]"
    assert [cells[0] for cells in content["spoilt"].rows] == [
        "skin: 2 kg",
        "frame: 2 kg",
        "small: 2 kg",
    ]
    assert len(content["cases"].rows) == 5
    assert "frame" in content["confident_and_wrong"]
    assert real_content(table)["spoilt_right"] is None


def test_rows_say_answer_and_truth(table: pd.DataFrame) -> None:
    content = real_content(table)
    load, _, _, cuff, broken = content["cases"].rows
    assert load == (
        "load: 2 kg", LOAD, "yes (0.016)", f"{LOAD} (70 %)", "20 %", "yes (3)", "-13 %",
    )  # fmt: skip
    assert cuff[3] == f"not decided: variants differ; most probable {FRAME} (90 %)"
    assert broken[2:] == ("", "no verdict: no solve", "", "", "")
    assert content["nulls"].rows[1][1:4] == (
        "no gap", "yes (0.016)", "none of the known effects (90 %)",
    )  # fmt: skip
    assert content["doubts"] == [{"case": "load", "texts": ["one", "two"]}]
    assert content["failed"] == 1


def test_rows_are_counted_by_their_code_where_the_table_says_it(table: pd.DataFrame) -> None:
    assert real_content(table)["codes"] == []
    codes = ["a" * 64] * 3 + ["b" * 64] * (len(table) - 4) + [None]
    found = real_content(table.assign(code=codes))["codes"]
    assert found == [f"{len(table) - 4} by {'b' * 12}", f"3 by {'a' * 12}"]


def test_section_is_drawn_with_and_without_cases(table: pd.DataFrame) -> None:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("scapulohumeral.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    template = environment.get_template("gap/real_cases.html.j2")
    html = template.render(real=real_content(table))
    assert "1 of 3 [6 %, 79 %]" in html
    assert "load_shrug (marked)" in html
    assert html.count('class="flagged"') == 1
    assert "was made because of these very" in html
    assert "by the code of their time" not in html
    coded = template.render(real=real_content(table.assign(code="a" * 64)))
    assert f"Answers are by the code of their time: {len(table)} by aaaaaaaaaaaa." in coded
    nothing = real_content(pd.DataFrame())
    assert nothing is None
    assert "were not run" in template.render(real=nothing)
