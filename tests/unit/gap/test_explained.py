"""How far a gap shrinks: what was observed, and what one more task is expected to show."""

import numpy as np
import pytest

from scapulohumeral.gap.explained import _expected, removed_of_tasks
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import Share

pytestmark = pytest.mark.unit

SIZE = 24
OBSERVED = Share(1.0, None, 3)


def task(delta: np.ndarray) -> Residual:
    """One task whose differences without a cause have unit variance."""
    return Residual(
        delta=delta,
        covariance=np.eye(SIZE),
        noise=np.eye(SIZE),
        functions=np.eye(SIZE),
        tasks=("lift",),
        channels=("GH_rz",),
        degrees=(4.0,),
    )


def expected(predicted: float, left: float) -> Share:
    """Of a task that a prediction of this size meets exactly; `left`: variance of its errors."""
    change = np.full(SIZE, predicted)
    return _expected(OBSERVED, [(task(change), change)], [left * np.eye(SIZE)], seed=1)


def test_shares_of_tasks_are_those_of_their_root_mean_square() -> None:
    assert removed_of_tasks([]) is None
    assert removed_of_tasks([(1.0, 0.5)]) is None
    assert removed_of_tasks([(3.0, 1.5)]) == pytest.approx(0.75)
    assert removed_of_tasks([(3.0, 4.0)]) == pytest.approx(-0.5)


def test_one_more_task_is_expected_to_show_less_than_tasks_that_the_prediction_met() -> None:
    # Root mean squares of one more task: sqrt(9 + left) before, sqrt(left) after.
    for left in (2.0, 4.0):
        share = expected(3.0, left)
        asymptotic = (np.sqrt(9.0 + left) - np.sqrt(left)) / (np.sqrt(9.0 + left) - 1.0)
        assert share.value == pytest.approx(asymptotic, abs=0.03)
        assert share.ci95 is not None
        assert share.ci95[0] < share.value < share.ci95[1] == OBSERVED.value
    assert expected(3.0, 4.0).value < expected(3.0, 2.0).value


def test_a_prediction_without_errors_beyond_noise_is_expected_to_remove_almost_all() -> None:
    assert expected(3.0, 1.0).value > 0.97
    assert expected(3.0, 1.0).n_trials == OBSERVED.n_trials
