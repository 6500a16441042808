"""Whether there is a gap: as few false alarms as allowed, and small effects found in noise whose
scale few repeats hardly tell."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from scapulohumeral.gap.detection import presence
from scapulohumeral.gap.detection.presence import (
    DRAWS,
    Presence,
    shares,
    surest,
    threshold_of,
    z_values,
)
from scapulohumeral.gap.detection.shaped import closest, shaped, steadied
from scapulohumeral.gap.labels import GLR, MAX_T, ON_RECORD
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.noise import draws
from scapulohumeral.gap.residual.residual import Residual

pytestmark = pytest.mark.unit

FUNCTIONS = phase_functions(20, 4)
SIZE = len(KINEMATIC_CHANNELS) * FUNCTIONS.shape[1]
TASKS = ("a", "b", "c")
ALPHA = 0.05
# One repeat against two, beside prior knowledge that is worth three.
FEW = 4.0


def residual(degrees: float = FEW) -> Residual:
    size = len(TASKS) * SIZE
    covariance = np.eye(size)
    return Residual(
        np.zeros(size), covariance, 0.8 * covariance, FUNCTIONS, TASKS, KINEMATIC_CHANNELS,
        (degrees,) * len(TASKS),
    )  # fmt: skip


def shapes(others: int = 60) -> Mapping[str, list[np.ndarray]]:
    """A few effects on the record of motion among many others, all of random shape."""
    rng = np.random.default_rng(1)
    every = [rng.normal(size=(len(TASKS) * SIZE, 3)) for _ in range(4 + others)]
    return {ON_RECORD: every[:4], GLR: every}


def judged(there: Residual, looked_for: Mapping[str, list[np.ndarray]]) -> dict[str, Presence]:
    _, findings = presence.tested(there, looked_for, ALPHA, 1.0, 1)
    return {one.statistic: one for one in findings}


def test_all_tests_together_give_as_few_false_alarms_as_allowed():
    there, looked_for = residual(), shapes(10)
    limits = {name: one.threshold for name, one in judged(there, looked_for).items()}
    nothing = draws(there, 1000, 7)
    alarms = np.array([z_values(there, one)[1] > limits[MAX_T] for one in nothing.T])
    for name in (ON_RECORD, GLR):
        alarms |= shaped(there, nothing, looked_for[name]) > limits[name]
    # Three binomial deviations about 5 %; tests that agree give fewer.
    assert 0.02 <= alarms.mean() <= 0.07


@pytest.mark.parametrize("task", range(3))
def test_a_task_that_scatters_more_than_assumed_is_no_gap(task: int):
    there = residual()
    loud = draws(residual(1e6), 1, 3)[:, 0]
    loud[task * SIZE : (task + 1) * SIZE] *= 3.0
    findings = judged(replace(there, delta=loud), shapes())
    assert not any(one.present for one in findings.values())


def test_a_turned_frame_is_found_though_few_repeats_hardly_tell_the_scatter():
    """Five deviations in the direction of an effect: too little for the largest of all channels."""
    there, looked_for = residual(), shapes()
    direction = looked_for[ON_RECORD][2] @ np.array([1.0, 0.5, -0.5])
    turned = 5.0 * direction / np.linalg.norm(direction)
    found = [
        judged(replace(there, delta=turned + noise), looked_for) for noise in draws(there, 20, 5).T
    ]
    assert np.mean([one[ON_RECORD].present for one in found]) >= 0.8
    assert np.mean([one[MAX_T].present for one in found]) <= 0.2


def test_scatter_is_told_task_by_task_and_never_less_than_assumed():
    there = residual()
    calm = 0.5 * draws(residual(1e6), 4, 2)
    np.testing.assert_array_equal(steadied(there, calm), calm)
    loud = calm.copy()
    loud[:SIZE] *= 20.0
    found = steadied(there, loud)
    np.testing.assert_array_equal(found[SIZE:], calm[SIZE:])
    squares = np.sum(loud[:SIZE] ** 2, axis=0)
    np.testing.assert_allclose(
        found[:SIZE], loud[:SIZE] / np.sqrt((FEW + squares) / (FEW + SIZE)), rtol=1e-12
    )


def test_the_largest_shape_counts_and_effects_without_any_do_not():
    there = residual(1e6)
    one, other = np.eye(len(there.delta))[:2, :, None]
    vector = np.zeros((len(there.delta), 1))
    vector[:2, 0] = 1.0, 3.0
    np.testing.assert_allclose(
        shaped(there, vector, [one, other, 0.0 * one]), shaped(there, vector, [other])
    )


def test_tests_without_anything_to_look_for_leave_their_share_to_others():
    nothing = {ON_RECORD: [], GLR: [np.ones((3, 1))]}
    assert shares(nothing) == {MAX_T: 0.5, GLR: 0.5}
    assert set(judged(residual(), {**shapes(2), ON_RECORD: []})) == {MAX_T, GLR}


def test_a_shape_that_hardly_shows_has_a_finite_value():
    there = residual()
    one = np.eye(len(there.delta))[:, :1]
    assert np.isfinite(shaped(there, np.zeros((len(one), 2)), [one])).all()


def test_parameters_that_change_a_difference_alike_are_one_direction():
    """Strength of fibres and their number, where neither effort nor EMG shows."""
    there = residual()
    one = np.random.default_rng(3).normal(size=(len(TASKS) * SIZE, 1))
    twice, nothing = np.hstack([one, 2.0 * one]), 0.0 * one
    vector = draws(there, 4, 5) + 3.0 * one
    alone = shaped(there, vector, [one])
    for alike in (twice, np.hstack([one, nothing]), np.hstack([1e-6 * one, one])):
        assert shaped(there, vector, [alike]) == pytest.approx(alone)
    spoilt = replace(there, delta=3.0 * one[:, 0])
    (change, basis), (expected, _) = closest(spoilt, [twice]), closest(spoilt, [one])
    assert change == pytest.approx(expected)
    assert basis.shape[1] == 1


def test_of_findings_with_equal_p_values_the_one_nearest_to_its_threshold_counts():
    far = Presence(False, 1.0, MAX_T, 1.0, 4.0, {})
    near = Presence(False, 1.0, GLR, 2.5, 3.0, {})
    assert surest([far, near]) == surest([near, far]) == near
    likelier = replace(far, p_value=0.9)
    assert surest([near, likelier]) == likelier


@pytest.mark.parametrize("alpha", [0.0125, 0.05, 0.3, 1e-4])
def test_what_exceeds_a_threshold_has_a_small_p_value_and_nothing_else_has(alpha):
    null = np.random.default_rng(2).normal(size=DRAWS)
    threshold = threshold_of(null, alpha)
    for value in (*np.sort(null)[-700:], null.max() + 1.0):
        p_value = (1 + np.sum(null >= value)) / (1 + DRAWS)
        assert (value > threshold) == (p_value <= alpha)
