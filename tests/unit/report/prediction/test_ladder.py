"""Moves of the ladder: alone from the start, on the way from the last rung that converged."""

import numpy as np
import pandas as pd
import pytest

from scapulohumeral.report.prediction.ladder import LEVELS_DEG, ladder_moves

pytestmark = pytest.mark.unit


def rung(kind, step, upward) -> dict:
    levels = {f"ur_{level:g}_deg": upward for level in LEVELS_DEG}
    status = "failed" if np.isnan(upward) else "optimal"
    return {"kind": kind, "step": step, "plane": "frontal", "status": status, **levels}


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
        ("what an activation costs", "+2.0", "+2.0"),
        ("conoid ligament", "-1.0", ""),
        ("fence around recorded coordinates", "", "+0.5"),
        ("path of serratus, paths by hand", "", "+4.5"),
    ]
    assert found.flagged == {1, 3}


def test_elevations_that_one_rung_does_not_reach_do_not_count():
    high, low = rung("start", "published", 10.0), rung("alone", "arm", 11.0)
    low[f"ur_{LEVELS_DEG[-1]:g}_deg"] = np.nan
    way = {**low, "kind": "cumulative"}
    assert ladder_moves(pd.DataFrame([high, low, way])).rows == [
        ("motion of the arm", "+1.0", "+1.0")
    ]
