"""Moves of the ladder: alone from the start, on the way from the last rung that converged."""

import numpy as np
import pandas as pd
import pytest

from scapulohumeral.report.drawing.svg import Drawing
from scapulohumeral.report.prediction.ladder import LEVELS_DEG, ladder_figure, ladder_moves

pytestmark = pytest.mark.unit


def rung(kind, step, upward) -> dict:
    levels = {f"ur_{level:g}_deg": upward for level in LEVELS_DEG}
    status = "failed" if np.isnan(upward) else "optimal"
    names = {"condition": "healthy", "kind": kind, "step": step, "plane": "frontal"}
    return {**names, "status": status, **levels}


def test_moves_are_from_the_start_and_from_the_last_rung_that_converged():
    rungs = [
        rung("start", "published", 10.0),
        rung("cumulative", "effort", 12.0),
        rung("alone", "conoid", 9.0),
        rung("cumulative", "conoid", np.nan),
        rung("cumulative", "box", 12.5),
        rung("alone", "serratus_path", np.nan),
        rung("cumulative", "serratus_path", 17.0),
    ]
    found = ladder_moves(pd.DataFrame(rungs))
    assert list(found.rows) == [
        ("healthy", "what an activation costs", "+2.0", "+2.0"),
        ("healthy", "conoid ligament", "-1.0", ""),
        ("healthy", "fence around recorded coordinates", "", "+0.5"),
        ("healthy", "path of serratus, paths by hand", "", "+4.5"),
    ]
    assert found.flagged == {1, 3}


def test_elevations_that_one_rung_does_not_reach_do_not_count():
    high, low = rung("start", "published", 10.0), rung("alone", "arm", 11.0)
    low[f"ur_{LEVELS_DEG[-1]:g}_deg"] = np.nan
    way = {**low, "kind": "cumulative"}
    assert ladder_moves(pd.DataFrame([high, low, way])).rows == [
        ("healthy", "motion of the arm", "+1.0", "+1.0")
    ]


@pytest.fixture
def two_shoulders() -> pd.DataFrame:
    """A weak shoulder turns the other way, and one of its rungs failed."""
    healthy = [rung("start", "published", 10.0), rung("cumulative", "conoid", 12.0)]
    weak = [rung("start", "published", 20.0), rung("cumulative", "conoid", 17.0)]
    weak += [rung("alone", "conoid", np.nan)]
    return pd.DataFrame(healthy + [{**one, "condition": "cuff_w10"} for one in weak])


def test_conditions_are_told_apart(two_shoulders):
    found = ladder_moves(two_shoulders)
    assert list(found.rows) == [
        ("healthy", "conoid ligament", "+2.0", "+2.0"),
        ("cuff_w10", "conoid ligament", "-3.0", "-3.0"),
    ]
    assert found.flagged == {1}


def test_every_condition_has_panels_of_its_own(two_shoulders, monkeypatch):
    drawn = []
    finish = Drawing.finish
    monkeypatch.setattr(Drawing, "finish", lambda d, *text: drawn.append(d) or finish(d, *text))
    ladder_figure(two_shoulders)
    assert drawn[0].axes.shape == (2, 2)
    weak = drawn[0].axes[1, 1]
    assert weak.get_title(loc="left") == "cuff_w10, frontal plane, cumulative"
    assert [label.get_text() for label in weak.get_yticklabels()] == [
        "authors' problem (solved here)",
        "conoid ligament",
    ]
    assert weak.lines[0].get_xdata().tolist() == [20.0, 17.0]
