"""How far a gap shrinks: what was observed, and what one more task is expected to show."""

from dataclasses import replace

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


def expected(left: float, rest: float, predicted: float = 3.0, misfit: float = 1.0) -> Share:
    """Of two tasks that a prediction misses by `rest`; `left`: variance of its errors."""
    change = np.full(SIZE, predicted)
    sign = np.where(np.arange(SIZE) % 2, 1.0, -1.0)
    parts = [(task(change + rest * sign), change)] * 2
    return _expected(OBSERVED, parts, [left * np.eye(SIZE)] * 2, misfit, seed=1)


def test_shares_of_tasks_are_those_of_their_root_mean_square() -> None:
    assert removed_of_tasks([]) is None
    assert removed_of_tasks([(1.0, 0.5)]) is None
    assert removed_of_tasks([(3.0, 1.5)]) == pytest.approx(0.75)
    assert removed_of_tasks([(3.0, 4.0)]) == pytest.approx(-0.5)


@pytest.mark.parametrize("left", [2.0, 4.0])
def test_one_more_task_is_expected_to_show_as_much_as_errors_leave(left: float) -> None:
    """Root mean squares of one more task: sqrt(9 + left) before, sqrt(left) after."""
    share = expected(left, rest=np.sqrt(left))
    whole, after = np.sqrt(9.0 + left), np.sqrt(left)
    assert share.value == pytest.approx((whole - after) / (whole - 1.0), abs=0.04)
    assert share.ci95 is not None
    assert share.ci95[0] < share.value < share.ci95[1] == OBSERVED.value
    assert share.n_trials == OBSERVED.n_trials


def test_errors_that_tasks_left_out_do_not_show_count_less() -> None:
    assert expected(8.0, rest=1.0).value > 0.9 > 0.6 > expected(8.0, rest=3.0).value


def test_errors_may_be_as_much_larger_as_the_likeliest_explanation_misses() -> None:
    """Tasks that were missed by six times the variance are expected to go on as they are."""
    missed = float(np.sqrt(6.0 * 2.0))
    share = expected(2.0, rest=missed, misfit=6.0)
    before = np.sqrt(9.0 + missed**2)
    assert share.value == pytest.approx((before - missed) / (before - 1.0), abs=0.06)
    assert share.value < 0.5 * expected(2.0, rest=missed).value
    assert expected(2.0, rest=1.0, misfit=6.0).value > 0.9


def test_a_prediction_without_errors_beyond_noise_is_expected_to_remove_almost_all() -> None:
    assert expected(1.0, rest=1.0).value > 0.95


def test_a_channel_that_hardly_changes_takes_part_in_its_own_unit() -> None:
    """An electrode that is off beside a joint force: variances 14 decades apart are no failure."""
    unit = np.where(np.arange(SIZE) < SIZE // 2, 1e-5, 1e2)
    change = np.full(SIZE, 3.0)
    missed = change + 2.0 * np.where(np.arange(SIZE) % 2, 1.0, -1.0)
    covariance = np.diag(unit**2)
    part = replace(task(unit * missed), covariance=covariance, noise=covariance)
    left = [4.0 * covariance] * 2
    share = _expected(OBSERVED, [(part, unit * change)] * 2, left, 1.0, seed=1)
    plain = _expected(OBSERVED, [(task(missed), change)] * 2, [4.0 * np.eye(SIZE)] * 2, 1.0, seed=1)
    assert share.value == pytest.approx(plain.value, abs=0.03)
