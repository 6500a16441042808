"""Variants against recordings: who would have chosen which, without the one that is judged."""

import numpy as np
import pandas as pd
import pytest

from scapulohumeral.stages.distances.tried import tried_table

pytestmark = pytest.mark.unit

# Error of upward rotation by participant and variant [deg].
ERRORS = {
    "one": {"study": 9.0, "soft": 1.0, "stiff": 5.0},
    "two": {"study": 9.0, "soft": 4.0, "stiff": 3.0},
    "three": {"study": 9.0, "soft": 4.0, "stiff": 3.0},
}


NO_TASKS = pd.DataFrame(columns=["variant", "participant", "task", "ur_rmse_deg"])


def distances(errors: dict[str, dict[str, float]]) -> pd.DataFrame:
    """A table of two planes with the same error in both."""
    return pd.DataFrame(
        {"variant": v, "participant": p, "plane": plane, "ur_rmse_deg": error, "other": 1.0}
        for p, by_variant in errors.items()
        for v, error in by_variant.items()
        for plane in ("frontal", "sagittal")
    )


def chosen(errors: dict[str, dict[str, float]]) -> dict[str, set[str]]:
    """Variants that the others choose, by participant."""
    table = tried_table(distances(errors), NO_TASKS)
    return {
        name: set(rows.variant[rows.chosen_by_others])
        for name, rows in table.groupby("participant")
    }


def test_others_choose_and_the_judged_one_has_no_say():
    # The first alone makes the soft one the best on average, so only without it stiff is chosen.
    assert chosen(ERRORS) == {"one": {"stiff"}, "two": {"soft"}, "three": {"soft"}}
    table = tried_table(distances(ERRORS), NO_TASKS)
    assert "other" not in table.columns
    assert list(table.participant[:6]) == ["one"] * 6


def test_variant_with_a_failed_solve_is_not_chosen():
    failed = {**ERRORS, "two": {**ERRORS["two"], "stiff": np.nan}}
    assert chosen(failed) == {"one": {"soft"}, "two": {"soft"}, "three": {"soft"}}


def test_one_participant_alone_chooses_nothing():
    assert chosen({"one": ERRORS["one"]}) == {"one": set()}


def test_daily_tasks_are_judged_and_have_no_say():
    """The study is by far the best in the tasks of one, and still nobody chooses it."""
    tasks = pd.DataFrame(
        {"variant": v, "participant": "one", "task": "lifting", "ur_rmse_deg": error}
        for v, error in (("study", 0.1), ("soft", 7.0), ("stiff", 8.0))
    )
    table = tried_table(distances(ERRORS), tasks)
    rows = table[table.trial == "lifting"].set_index("variant")
    assert rows.ur_rmse_deg.to_dict() == {"study": 0.1, "soft": 7.0, "stiff": 8.0}
    assert rows.chosen_by_others.to_dict() == {"study": False, "soft": False, "stiff": True}
    assert len(table) == len(distances(ERRORS)) + 3
