"""Table of predictions: which solutions are the same local optimum of the same problem."""

import numpy as np
import pandas as pd
import pytest

from scapulohumeral.stages.prediction_summary import SAME_OPTIMUM, _branches

pytestmark = pytest.mark.unit


def row(objective, **changes):
    problem = {
        "participant": "par2",
        "parameters": "calibrated",
        "w_gh": 2.0,
        "muscles": "",
        "capacity": 1.0,
        "girdle_stiffness": np.nan,
        "status": "optimal",
    }
    return {**problem, "objective": objective, **changes}


def test_branches_are_lettered_from_the_best_start_of_each_problem():
    rows = [
        row(4.0 * (1.0 + 2.0 * SAME_OPTIMUM)),
        row(4.0),
        row(4.0 * (1.0 + 0.5 * SAME_OPTIMUM)),
        row(9.0, w_gh=10.0),
        row(5.0, girdle_stiffness=5.0),
        row(3.0, status="failed"),
    ]
    assert _branches(pd.DataFrame(rows)) == ["B", "A", "A", "A", "A", ""]
