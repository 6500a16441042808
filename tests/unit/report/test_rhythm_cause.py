"""The step between own and printed rhythm that explains most of the difference."""

import pandas as pd
import pytest

from scapulohumeral.report.published.rhythm_cause import RhythmCell, largest_rung, rhythm_cause

pytestmark = pytest.mark.unit

CELL = RhythmCell("healthy", "frontal", "start-90", 2.0)
NO_LADDER = pd.DataFrame()


def on_published_arm(same_model: float, authors: float) -> pd.DataFrame:
    row = {"condition": "healthy", "plane": "frontal", "phase": "start-90"}
    row["quantity"] = "rhythm_range"
    values = {"study_arm": same_model, "published": authors}
    return pd.DataFrame([{**row, "variant": v, "reproduced": x} for v, x in values.items()])


def ladder(*rhythms: float) -> pd.DataFrame:
    steps = ("published", "effort", "springs", "arm")
    rows = [
        {
            "step": step, "kind": "cumulative" if k else "start", "plane": "frontal",
            "condition": "healthy", "status": "optimal", "rhythm": rhythm,
        }
        for k, (step, rhythm) in enumerate(zip(steps, rhythms, strict=True))
    ]  # fmt: skip
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("same_model", "authors", "cause"),
    [
        (2.1, 2.0, "the motion of the arm"),
        (3.9, 2.1, "model and problem"),
        (3.9, 3.8, "what the authors' problem leaves open"),
        # A step away from the printed rhythm is no cause of being far from it on the other side.
        (2.5, 0.5, "what the authors' problem leaves open"),
    ],
)
def test_the_largest_step_towards_the_own_rhythm_is_the_cause(same_model, authors, cause):
    own = 4.0 if authors > 1.0 else 0.9
    said = rhythm_cause(CELL, own, on_published_arm(same_model, authors), NO_LADDER)
    assert said.endswith(f"the largest step is {cause}")


def test_a_rhythm_that_agrees_has_no_cause_and_a_missing_one_no_words():
    assert "largest step" not in rhythm_cause(CELL, 2.3, on_published_arm(5.0, 2.0), NO_LADDER)
    assert rhythm_cause(CELL, 4.0, on_published_arm(float("nan"), 2.0), NO_LADDER) == ""
    assert rhythm_cause(CELL, float("inf"), on_published_arm(2.1, 2.0), NO_LADDER) == ""
    empty = on_published_arm(2.1, 2.0).iloc[:0]
    assert rhythm_cause(CELL, 4.0, empty, NO_LADDER) == ""


def test_the_step_of_the_ladder_is_named_where_the_model_is_the_cause():
    rungs = ladder(2.0, 2.1, 3.9, 9.0)
    said = rhythm_cause(CELL, 4.0, on_published_arm(3.9, 2.1), rungs)
    assert said.endswith("model and problem, above all passive joints (2.10 to 3.90)")
    other = RhythmCell("healthy", "frontal", "30-60", 2.0)
    assert largest_rung(rungs, other) == largest_rung(NO_LADDER, CELL) == ""
    assert "passive" not in rhythm_cause(CELL, 4.0, on_published_arm(2.1, 2.0), rungs)
