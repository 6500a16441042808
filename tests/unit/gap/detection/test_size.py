"""The size of a gap and its interval, for differences and spreads that are known."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, small_record

from scapulohumeral.gap.detection.size import FEWEST_TRIALS, gap_size, sides
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    SensorSetup,
    difference,
    mean,
    phase_functions,
)
from scapulohumeral.gap.residual.differences import Records
from scapulohumeral.gap.residual.residual import Residual

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 4)
PER_TASK = len(NAMES) * 4


# Noise that is known exactly.
KNOWN = 1e6


def drawn(rng, true_size, trials, tasks=("a", "b"), reference=True, spread=0.7, degrees=KNOWN):
    """A comparison whose mean lies `true_size` standard errors off in every coefficient, and the
    trials behind it, each of which varies by `spread`."""
    error = spread * np.sqrt((2.0 if reference else 1.0) / trials)
    shape = (len(tasks), trials, PER_TASK)
    test = true_size * error + spread * rng.normal(size=shape)
    other = spread * rng.normal(size=shape) if reference else np.zeros(shape)
    covariance = error**2 * np.eye(len(tasks) * PER_TASK)
    there = Residual(
        delta=(test.mean(axis=1) - other.mean(axis=1)).ravel(),
        covariance=covariance,
        noise=0.99 * covariance,
        functions=FUNCTIONS,
        tasks=tasks,
        channels=NAMES,
        degrees=(degrees,) * len(tasks),
    )
    both = [dict(zip(tasks, side, strict=True)) for side in (test, other)]
    return there, both if reference else both[:1]


def test_size_is_that_of_the_difference_and_no_maximum():
    """The mean over draws is the true size, although the largest of 96 z values is 3 without any
    and 4 with a gap of one standard error."""
    for true_size in (1.0, 3.0):
        rng = np.random.default_rng(1)
        values = [gap_size(*drawn(rng, true_size, 3), 1).value for _ in range(40)]
        assert np.mean(values) == pytest.approx(true_size, rel=0.05)
    rng = np.random.default_rng(2)
    nothing = np.array([gap_size(*drawn(rng, 0.0, 3), 1).value for _ in range(100)])
    assert 0.35 < np.mean(nothing == 0.0) < 0.65
    assert nothing.max() < 0.75


def test_noise_that_few_repeats_tell_makes_no_size():
    """The scale of each task is off as five degrees of freedom have it: where nothing acts, half
    of the sizes are zero, and nine of ten intervals reach it."""
    degrees = 5.0
    rng = np.random.default_rng(11)
    found = []
    for seed in range(60):
        there, trials = drawn(rng, 0.0, 3, degrees=degrees)
        scales = np.sqrt(degrees / rng.chisquare(degrees, 2))
        louder = there.of(np.repeat(scales, PER_TASK) * there.delta)
        sides_of = [{t: k * side[t] for t, k in zip("ab", scales, strict=True)} for side in trials]
        found.append(gap_size(louder, sides_of, seed))
    assert 0.3 < np.mean([size.value == 0.0 for size in found]) < 0.8
    assert np.mean([size.ci95[0] > 0.0 for size in found]) <= 0.1


@pytest.mark.parametrize("trials", [FEWEST_TRIALS, 6])
@pytest.mark.parametrize("reference", [True, False])
def test_the_interval_holds_the_true_size_as_often_as_it_says(trials, reference):
    """Of 60 draws, 57 are expected; fewer than 52 are as improbable as 2 % at 95 %."""
    rng = np.random.default_rng(3)
    held = 0
    for seed in range(60):
        low, high = gap_size(*drawn(rng, 1.0, trials, reference=reference), seed).ci95
        held += low <= 1.0 <= high
    assert held >= 52


def test_the_interval_is_as_wide_as_sizes_vary():
    """Whatever the size: the width follows trials, not a constant."""
    rng = np.random.default_rng(4)
    sizes = [gap_size(*drawn(rng, 3.0, 6), seed) for seed in range(60)]
    widths = np.array([size.ci95[1] - size.ci95[0] for size in sizes])
    assert np.mean(widths) / 3.92 == pytest.approx(np.std([s.value for s in sizes]), rel=0.35)
    there, trials = drawn(np.random.default_rng(5), 3.0, 6)
    quiet = [
        {task: c.mean(axis=0) + 0.1 * (c - c.mean(axis=0)) for task, c in side.items()}
        for side in trials
    ]
    loud, still = gap_size(there, trials, 1), gap_size(there, quiet, 1)
    assert loud.value == still.value
    # A tenth, and what the mean of no more than these trials is off by itself.
    assert 0.1 < np.ptp(still.ci95) / np.ptp(loud.ci95) < 0.35


def test_too_few_trials_on_any_side_give_no_interval():
    there, trials = drawn(np.random.default_rng(6), 1.0, FEWEST_TRIALS)
    assert gap_size(there, trials, 1).ci95 is not None
    for side in (0, 1):
        fewer = [dict(one) for one in trials]
        fewer[side]["b"] = fewer[side]["b"][: FEWEST_TRIALS - 1]
        found = gap_size(there, fewer, 1)
        assert found.ci95 is None
        assert found.value == gap_size(there, trials, 1).value


def test_the_same_seed_gives_the_same_interval():
    there, trials = drawn(np.random.default_rng(7), 1.0, 4)
    one, again, other = (gap_size(there, trials, seed) for seed in (1, 1, 2))
    assert one == again
    assert one.ci95 != other.ci95


def test_sides_hold_the_trials_of_the_tasks_compared():
    """By task, relative to its mean record; a task that is not compared is left out."""
    peaks = {"a": (1.2, 1.3, 1.4), "b": (1.0, 1.1), "c": (1.0, 1.5)}
    test = {task: [small_record(peak) for peak in heights] for task, heights in peaks.items()}
    reference = {task: [small_record(1.0), small_record(1.05)] for task in peaks}
    mean_records = {task: mean(trials) for task, trials in reference.items()}
    records = Records(
        test, reference, mean_records, SensorSetup(CHANNELS, np.eye(2), False), NAMES, True
    )
    identity = np.eye(2 * PER_TASK)
    there = Residual(
        np.zeros(2 * PER_TASK), identity, identity, FUNCTIONS, ("a", "b"), NAMES, (5.0,) * 2
    )
    first, second = sides(there, records)
    assert {task: c.shape for task, c in first.items()} == {"a": (3, PER_TASK), "b": (2, PER_TASK)}
    assert set(second) == {"a", "b"}
    expected = there.compress([difference(test["a"][2], mean_records["a"])])
    np.testing.assert_allclose(first["a"][2], expected)
    # Reference trials are subtracted.
    expected = there.compress([difference(reference["b"][1], mean_records["b"])])
    np.testing.assert_allclose(second["b"][1], -expected)
    assert len(sides(there, replace(records, reference={}))) == 1
