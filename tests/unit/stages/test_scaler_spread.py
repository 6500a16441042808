"""What uncertain scalers leave of a prediction: derivatives against solves with other scalers."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from small_arm import small_muscles
from small_posed import small_posed, small_settings, small_target
from synthetic_study import solution

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solution import write_solution
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve
from scapulohumeral.problems.posed_problem import effort_factors
from scapulohumeral.quantities.segment_angles import UPWARD_ROTATION_COLUMN, thorax_angles
from scapulohumeral.report.prediction.tables import spread_table
from scapulohumeral.stages.calibration import read_covariance
from scapulohumeral.stages.checks.scaler_spread import scaler_spread, upward_rotation_slopes
from scapulohumeral.stages.prediction import TRACKED, Condition

pytestmark = pytest.mark.unit

GROUPS = Scalers(("upper", "lower"), np.array([[1, 1, 0], [0, 0, 1]], dtype=bool))
ONES = np.ones(4)
EXPONENT = 1.0
# Smooths the bounds of activations, so that derivatives hold on both sides.
BARRIER = 1e-4
STEP = 0.01


@pytest.fixture(scope="module")
def posed_with(quaternion_equations):
    """Function that poses the arm with a free girdle for scalers (4,), forces first."""
    settings = small_settings(stability=0.0)
    target = small_target(21, tracked=TRACKED)

    def posed_with(theta: np.ndarray):
        muscles = GROUPS.apply(small_muscles(), theta.reshape(2, 2))
        posed = small_posed(quaternion_equations, target, settings, muscles=muscles)
        effort = effort_factors(muscles, EXPONENT)
        return replace(posed, objective=replace(posed.objective, effort=effort))

    return posed_with


def solved(posed, start: Start | None = None) -> Start:
    """Solution of a problem from a start or cold."""
    start = start or Start(posed.layout().join(posed.cold_start()))
    result = solve(posed.problem, start, SolverSettings(tolerance=1e-9, barrier_target=BARRIER))
    assert result.optimal, result.message
    return result.point


def upward_rotation(posed, point: Start) -> np.ndarray:
    """Upward rotation (N,) of a solution [deg]."""
    return thorax_angles(posed.layout().split(point.free).q)[:, UPWARD_ROTATION_COLUMN]


@pytest.mark.parametrize("scaler", range(4))
def test_derivatives_are_those_of_solves_with_other_scalers(posed_with, scaler):
    point = solved(posed_with(ONES))
    slopes = upward_rotation_slopes(posed_with, point, ONES)
    assert slopes.shape == (21, 4)
    shift = STEP * np.eye(4)[scaler]
    others = (posed_with(ONES + sign * shift) for sign in (1.0, -1.0))
    above, below = (upward_rotation(posed, solved(posed, point)) for posed in others)
    expected = (above - below) / (2.0 * STEP)
    size = np.abs(expected).max()
    assert size > 0.05
    np.testing.assert_allclose(slopes[:, scaler], expected, atol=0.02 * size)


def test_generic_muscles_have_no_spread():
    unread = Path("unread")

    class Files:
        calibration = None

    with pytest.raises(ConfigError, match="prediction healthy: its muscles are generic"):
        scaler_spread(unread, Condition("healthy", "generic", 2.0), Files(), None)


def test_failed_prediction_has_a_table_without_rows(tmp_path):
    write_solution(solution("par2", "frontal", "quaternion", "failed"), tmp_path / "failed.npz")

    class Files:
        calibration = tmp_path / "unread.json"

    condition = Condition("healthy", "calibrated", 2.0)
    table = scaler_spread(tmp_path / "failed.npz", condition, Files(), None)
    table.to_csv(tmp_path / "spread.csv", index=False)
    assert spread_table(pd.read_csv(tmp_path / "spread.csv")).rows == []


def test_calibration_without_covariance_is_refused(tmp_path):
    path = tmp_path / "par2_scalers.json"
    path.write_text(json.dumps({"groups": {}}), encoding="utf-8")
    with pytest.raises(DataError, match="par2_scalers.json: no key covariance. Calibrate again"):
        read_covariance(path)
    path.write_text(json.dumps({"covariance": [[4.0, 0.0], [0.0, 1.0]]}), encoding="utf-8")
    assert read_covariance(path).tolist() == [[4.0, 0.0], [0.0, 1.0]]
