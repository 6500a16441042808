"""Another movement is estimated from a difference as Gaussian conditioning has it."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_movement import (
    FUNCTIONS,
    TASKS,
    same_movement,
    simulated_movements,
    supposed_movements,
)

from scapulohumeral.gap.isolation.empirical_bayes import others_of
from scapulohumeral.gap.isolation.movement import (
    expected_movement_left,
    most_probable_size,
    movement_fit,
    predicted_movement,
)
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS

pytestmark = pytest.mark.unit


def moved(size_deg, seed=1, **how):
    """A smooth change of this size, and what is supposed of the difference it makes."""
    rng = np.random.default_rng(seed)
    same = same_movement(**how)
    change = size_deg * simulated_movements(rng, 1, relative_error=0.1)[:, 0]
    noise = np.linalg.cholesky(same.covariance) @ rng.normal(size=len(change))
    return change, supposed_movements(same, change + noise)


def root_mean_square(change):
    """Of all joint rotations [deg], over tasks and nodes."""
    rows = same_movement().channel_rows(KINEMATIC_CHANNELS)
    samples = len(FUNCTIONS) * len(KINEMATIC_CHANNELS) * len(TASKS)
    return np.sqrt(np.sum(change[rows] ** 2) / samples)


@pytest.mark.parametrize("size", [2.0, 6.0, 18.0])
def test_the_size_of_a_smooth_change_is_found(size):
    change, residuals = moved(size)
    assert most_probable_size(residuals) == size
    found = movement_fit(residuals, -1.0)
    assert (found.label, found.moved_deg, found.log_evidence) == (MOVED, size, -1.0)
    assert found.x[0] == pytest.approx(root_mean_square(change), rel=0.05)
    assert np.linalg.norm(found.predicted - change) < 0.35 * np.linalg.norm(change)


def test_the_interval_holds_the_size_as_often_as_it_says():
    """Of sizes between persons who moved as supposed; noise is as large as the movement."""
    misses = []
    for seed in range(60):
        change, residuals = moved(2.0, seed, noise=2.0)
        found = movement_fit({0.0: residuals[0.0], 2.0: residuals[2.0]}, 0.0)
        along = found.predicted / np.linalg.norm(found.predicted[rows()])
        length = change[rows()] @ along[rows()] / np.sqrt(len(FUNCTIONS) * 10 * len(TASKS))
        misses.append((found.x[0] - length) / np.sqrt(found.covariance[0, 0]))
    assert np.std(misses) == pytest.approx(1.0, abs=0.25)
    assert abs(np.mean(misses)) < 0.4


def rows():
    return same_movement().channel_rows(KINEMATIC_CHANNELS)


def test_another_movement_is_preferred_where_emg_goes_with_the_motion():
    _, residuals = moved(6.0)
    nothing = np.zeros((len(residuals[0.0].delta), 1))
    logs = others_of(residuals, nothing)
    assert logs[MOVED] > logs["no_gap"] + 20.0
    # EMG that the motion does not ask for is no other movement.
    same = residuals[0.0]
    emg = same.channel_rows(same.channels[10:])
    delta = same.delta.copy()
    delta[emg] = -delta[emg]
    turned = {size: replace(one, delta=delta) for size, one in residuals.items()}
    assert others_of(turned, nothing)[MOVED] < logs[MOVED] - 20.0


def conditioned(residuals, size, task):
    """By brute force: mean and covariance of what is left of a task, given the others.

    From the joint distribution of (movement, difference) of all tasks, an inverse each.
    """
    same, other = residuals[0.0], residuals[size]
    movement = other.covariance - same.covariance
    rest = same.rows([task])
    trained = np.setdiff1d(np.arange(len(same.delta)), rest)
    gain = movement[np.ix_(rest, trained)] @ np.linalg.inv(
        other.covariance[np.ix_(trained, trained)]
    )
    left = np.eye(len(same.delta))[rest]
    left[:, trained] -= gain
    return gain @ same.delta[trained], left @ other.covariance @ left.T


@pytest.mark.parametrize("session", [0.0, 0.5])
@pytest.mark.parametrize("task", TASKS)
def test_a_task_that_was_left_out_is_predicted_by_conditioning(task, session):
    change, residuals = moved(6.0, session=session)
    same, other = residuals[0.0], residuals[6.0]
    training = same.part([one for one in TASKS if one != task])
    own = same.rows([task])
    found = predicted_movement(same, other, training)[own]
    mean, covariance = conditioned(residuals, 6.0, task)
    np.testing.assert_allclose(found, mean, atol=1e-8)
    np.testing.assert_allclose(expected_movement_left(same, other, training), covariance, atol=1e-8)
    assert np.linalg.norm(found - change[own]) < np.linalg.norm(change[own])


def test_what_is_left_of_a_task_is_as_large_as_expected():
    squares = []
    for seed in range(40):
        _, residuals = moved(6.0, seed, session=0.5)
        same, other = residuals[0.0], residuals[6.0]
        training, own = same.part(["a", "b"]), same.rows(["c"])
        left = (same.delta - predicted_movement(same, other, training))[own]
        covariance = expected_movement_left(same, other, training)
        squares.append(left @ np.linalg.solve(covariance, left) / len(own))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.1)
