"""Other arrangements of the same trials: an exact level whatever the noise, and no more power lost
than the number of trials costs."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, small_record

from scapulohumeral.gap.detection import permutation
from scapulohumeral.gap.detection.permutation import exchangeable, strongest
from scapulohumeral.gap.detection.presence import Presence
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
FUNCTIONS = phase_functions(NODES, 2)
FOUND = Presence(True, 0.0, "max_t", 9.0, 4.0, {})
ALPHA = 0.05
HEAVY = 2.0  # degrees of freedom of Student's t: not even a variance


def trial(rng, shift):
    """A record whose elbow and EMG are off by heavy-tailed amounts, the same at all phases."""
    record = small_record()
    pose = record.pose.copy()
    elbow, *emg = rng.standard_t(HEAVY, size=3) + shift
    pose[:, 12] += 0.01 * elbow
    return replace(record, pose=pose, emg=record.emg + 0.01 * np.array(emg))


def records(rng, counts, shift=0.0):
    """Trials of both sides of each task; `counts` (test, reference) by task."""
    test, reference = (
        {task: [trial(rng, off) for _ in range(both[side])] for task, both in counts.items()}
        for side, off in enumerate((shift, 0.0))
    )
    mean_records = {
        task: mean(trials) for task, trials in (reference if reference else test).items()
    }
    return Records(
        test, reference, mean_records, SensorSetup(CHANNELS, np.eye(2), False), NAMES, True
    )


def residual(tasks):
    """A comparison that knows the scale of the channels, and nothing of tails."""
    scale = np.repeat([0.6] * 10 + [0.01] * 2, FUNCTIONS.shape[1])
    covariance = np.diag(np.tile(scale**2, len(tasks)))
    nothing = np.zeros(len(covariance))
    return Residual(
        nothing, covariance, covariance, FUNCTIONS, tuple(tasks), NAMES, (5.0,) * len(tasks)
    )


def judged(recorded, seed=1):
    return exchangeable(FOUND, recorded, residual(recorded.test), (), ALPHA, seed)


@pytest.mark.parametrize(
    "counts",
    [{"a": (3, 3), "b": (3, 3)}, {"a": (2, 3), "b": (3, 4)}, {"a": (5, 5)}],
    ids=str,
)
def test_trials_that_might_change_places_are_called_a_gap_as_often_as_allowed(counts):
    """Of 200 draws ten are expected; 22 or one would come once in two thousand times."""
    rng = np.random.default_rng(1)
    found = [judged(records(rng, counts)) for _ in range(200)]
    assert 2 <= sum(one.present for one in found) <= 21
    p_values = np.array([one.p_value for one in found])
    assert 0.42 < np.mean(p_values) < 0.6
    absent = [one for one in found if not one.present]
    assert {one.statistic for one in absent} == {"permutation"}
    assert all(one.value < one.threshold * (1.0 + 1e-9) for one in absent)


def test_a_large_effect_survives():
    rng = np.random.default_rng(2)
    for _ in range(10):
        found = judged(records(rng, {"a": (3, 3), "b": (3, 3)}, shift=100.0))
        # Nothing is rarer than both sides changing places, in either of two unrelated tasks.
        assert found == replace(FOUND, p_value=4.0 / 400.0)


def test_a_large_effect_survives_though_sessions_might_change_as_much():
    """Alike in both tasks, it resembles a change of session more than the opposite in each does."""
    rng = np.random.default_rng(8)
    for _ in range(5):
        some = records(rng, {"a": (3, 3), "b": (3, 3)}, shift=100.0)
        there = residual(some.test)
        scale = np.sqrt(np.diag(there.covariance))
        session = scale[:, None] * np.tile(np.eye(len(scale) // 2), (2, 1))
        covariance = there.covariance + 100.0 * session @ session.T
        found = exchangeable(FOUND, some, replace(there, covariance=covariance), (), ALPHA, 1)
        assert found == replace(FOUND, p_value=4.0 / 400.0)


def test_a_simulated_p_value_is_never_made_smaller():
    rng = np.random.default_rng(3)
    some = records(rng, {"a": (3, 3), "b": (3, 3)}, shift=100.0)
    weak = replace(FOUND, p_value=0.04)
    assert exchangeable(weak, some, residual(some.test), (), ALPHA, 1) == weak


@pytest.mark.parametrize(
    "counts", [{"a": (1, 1)}, {"a": (3, 3)}, {"a": (1, 2), "b": (2, 1)}], ids=str
)
def test_so_few_trials_leave_a_finding_alone(counts):
    """Their most extreme arrangement is no rarer than the false alarms that are allowed."""
    rng = np.random.default_rng(4)
    for shift in (0.0, 100.0):
        assert judged(records(rng, counts, shift)) is FOUND


def test_without_reference_or_finding_nothing_is_asked():
    rng = np.random.default_rng(5)
    some = records(rng, {"a": (4, 4)})
    alone = replace(some, reference={})
    assert exchangeable(FOUND, alone, residual("a"), (), ALPHA, 1) is FOUND
    absent = replace(FOUND, present=False)
    assert exchangeable(absent, some, residual("a"), (), ALPHA, 1) is absent


def test_a_finding_by_shape_is_asked_for_its_shape():
    """One repeat against two in three tasks: a turn of the elbow stands out from the arrangements,
    though the whole difference, mostly scatter of EMG, does not."""
    rng = np.random.default_rng(9)
    some = records(rng, dict.fromkeys("abc", (1, 2)))
    there = residual(some.test)
    elbow = NAMES.index("EL_rx")
    turned = {
        task: [replace(one, pose=one.pose + 0.2 * (np.arange(13) == 12)) for one in trials]
        for task, trials in some.test.items()
    }
    some = replace(some, test=turned)
    shape = np.zeros((NODES, len(NAMES)))
    shape[:, elbow] = 1.0
    slope = there.compress([shape] * 3)[:, None]
    by_shape = replace(FOUND, statistic="on_record")
    loud = {
        task: [replace(one, emg=one.emg + rng.normal(size=2)) for one in trials]
        for task, trials in some.reference.items()
    }
    some = replace(some, reference=loud)
    there = replace(there, delta=permutation._arranged(some, there, 1)[:, 0])
    assert not exchangeable(FOUND, some, there, (), ALPHA, 1).present
    found = exchangeable(by_shape, some, there, (slope,), ALPHA, 1)
    assert found == replace(by_shape, p_value=1.0 / 27.0)
    best = strongest((FOUND, by_shape), some, there, {"on_record": (slope,)}, ALPHA, 1)
    assert best == found


def test_a_task_that_the_effect_does_not_change_contradicts_nothing():
    """A turn in two of three tasks: of nine arrangements that differ in it none is rare enough."""
    rng = np.random.default_rng(11)
    some = records(rng, dict.fromkeys("abc", (1, 2)))
    there = residual(some.test)
    shape = np.zeros((NODES, len(NAMES)))
    shape[:, NAMES.index("EL_rx")] = 1.0
    by_shape = replace(FOUND, statistic="on_record")
    for changed, stands in (((1.0, 1.0, 0.0), True), ((1.0, 1.0, 1.0), False)):
        slope = there.compress([size * shape for size in changed])[:, None]
        # By chance the largest difference is not the recorded one.
        delta = 8.0 * slope[:, 0] / np.linalg.norm(there.whiten(slope))
        found = exchangeable(by_shape, some, replace(there, delta=delta), (slope,), ALPHA, 1)
        assert found.present is stands


def test_a_sample_of_many_arrangements_says_what_all_say(monkeypatch):
    rng = np.random.default_rng(6)
    some = records(rng, {"a": (4, 4), "b": (4, 4)}, shift=1.0)
    sampled = judged(some)
    assert judged(some) == sampled
    monkeypatch.setattr(permutation, "ARRANGEMENTS", 5000)
    every = judged(some)
    assert sampled.p_value == pytest.approx(every.p_value, abs=0.03)
    assert every.p_value * 4900 == pytest.approx(round(every.p_value * 4900))


def test_many_repeats_are_sampled_and_the_recorded_choice_is_the_first():
    rng = np.random.default_rng(8)
    signs = permutation._signs(24, 12, seed=1)
    assert signs.shape == (permutation.ARRANGEMENTS, 24)
    np.testing.assert_allclose(signs[0], np.repeat([1.0, -1.0], 12) / 12)
    np.testing.assert_allclose(signs.sum(axis=1), 0.0, atol=1e-12)
    assert np.all(np.sum(signs > 0.0, axis=1) == 12)
    assert judged(records(rng, {"a": (12, 12)}, shift=6.0)).present


def test_the_first_arrangement_is_the_recorded_one():
    """Its length is that of the mean difference, whitened."""
    rng = np.random.default_rng(7)
    some = records(rng, {"a": (2, 3), "b": (3, 2)}, shift=2.0)
    there = residual(some.test)
    expected = there.compress(
        [
            np.mean([difference(one, some.mean_records[task]) for one in some.test[task]], 0)
            - np.mean([difference(one, some.mean_records[task]) for one in some.reference[task]], 0)
            for task in ("a", "b")
        ]
    )
    lengths = permutation._lengths(there, permutation._arranged(some, there, 1))
    assert len(lengths) == 100
    assert lengths[0] == pytest.approx(np.linalg.norm(there.whiten(expected)))
