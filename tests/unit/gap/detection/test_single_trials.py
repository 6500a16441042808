"""A gap has to show without any one trial, and the trial that it rests on is named."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, SETTINGS, small_record

from scapulohumeral.gap.detection.presence import DRAWS, SHARES, Presence
from scapulohumeral.gap.detection.single_trials import (
    alone,
    as_sure_as_two,
    contradicted,
    few_in_words,
    in_words,
    level,
    rests_on_one,
)
from scapulohumeral.gap.labels import GLR, LOAD, MAX_T, ON_RECORD
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    SensorSetup,
    mean,
    phase_functions,
)
from scapulohumeral.gap.residual.differences import (
    OneTrial,
    Records,
    mean_difference,
    repeat_noise,
)
from scapulohumeral.gap.result import Detectable

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 2)
TASKS = ("lift", "reach")
COUNTS = {"test": 3, "reference": 3}
SEED = 1


class Differentiated(NamedTuple):
    """What of a task's signatures a comparison with reference trials reads."""

    task: str


def trial(rng, elbow_deg):
    """A record whose elbow is off by an amount, and by what repeats scatter."""
    record = small_record()
    pose = record.pose.copy()
    pose[:, 12] += np.radians(elbow_deg + rng.normal())
    return replace(record, pose=pose, emg=record.emg * np.exp(0.02 * rng.normal(size=2)))


def recorded(off, tasks=TASKS, counts=COUNTS, seed=SEED):
    """Records whose trials are off by ``off[side, task, index]`` degrees of the elbow."""
    rng = np.random.default_rng(seed)
    test, reference = (
        {
            task: [trial(rng, off.get((side, task, i), 0.0)) for i in range(counts[side])]
            for task in tasks
        }
        for side in ("test", "reference")
    )
    means = {
        task: mean(trials) for task, trials in (reference if counts["reference"] else test).items()
    }
    sensors = SensorSetup(CHANNELS, np.eye(2), False)
    return Records(test, reference if counts["reference"] else {}, means, sensors, NAMES, True)


def compared(records):
    """The mean difference of all trials; what sessions change is as large as the scatter."""
    tasks = [Differentiated(task) for task in records.mean_records]
    noise = repeat_noise(records, FUNCTIONS, SETTINGS)
    whole = mean_difference(records, tasks, noise, FUNCTIONS)
    return tasks, replace(whole, covariance=2.0 * whole.noise)


def odd_one(records):
    tasks, whole = compared(records)
    shapes = {ON_RECORD: [], GLR: [np.eye(len(whole.delta))[:, :1]]}
    return rests_on_one(records, tasks, whole, shapes, SETTINGS, 1.0, SEED)


def test_a_gap_that_one_trial_makes_is_that_trial():
    odd = odd_one(recorded({("test", "reach", 0): 60.0}, counts={"test": 1, "reference": 3}))
    assert odd.trial == OneTrial("test", "reach", 0)
    assert odd.p_value > level(SETTINGS.alpha)


def test_so_is_one_of_an_odd_reference_trial():
    odd = odd_one(recorded({("reference", "lift", 0): 60.0}, counts={"test": 3, "reference": 1}))
    assert odd.trial == OneTrial("reference", "lift", 0)


def test_a_gap_that_all_test_trials_make_stands():
    off = {("test", task, i): 60.0 for task in TASKS for i in range(3)}
    assert odd_one(recorded(off)) is None


def test_a_task_goes_with_its_only_trial_and_a_single_one_stays():
    counts = {"test": 1, "reference": 2}
    places = dict(recorded({}, counts=counts).thinned())
    assert len(places) == 6
    assert set(places[OneTrial("test", "lift", 0)].mean_records) == {"reach"}
    assert set(places[OneTrial("reference", "lift", 0)].mean_records) == set(TASKS)
    left = dict(recorded({}, tasks=("lift",), counts=counts).thinned())
    assert set(left) == {OneTrial("reference", "lift", 0), OneTrial("reference", "lift", 1)}


def test_only_a_single_task_has_trials_that_cannot_be_left_out():
    counts = {"test": 1, "reference": 2}
    assert alone(recorded({}, counts=counts)) == ()
    assert alone(recorded({}, tasks=("lift",), counts=counts)) == (OneTrial("test", "lift", 0),)


@pytest.mark.parametrize("side", ["test", "reference"])
def test_what_is_left_is_compared_as_if_it_were_all(side):
    """The difference without a trial is that of records which never had it."""
    records = recorded({("test", "lift", 0): 30.0})
    left = dict(records.thinned())[OneTrial(side, "lift", 0)]
    test, reference = (
        {**trials, "lift": trials["lift"][1:]} if side == own else trials
        for own, trials in (("test", records.test), ("reference", records.reference))
    )
    never = replace(
        records,
        test=test,
        reference=reference,
        mean_records={task: mean(trials) for task, trials in reference.items()},
    )
    np.testing.assert_array_equal(compared(left)[1].delta, compared(never)[1].delta)


def test_no_gap_of_one_trial_of_each_task_says_what_could_have_shown():
    load = Detectable(LOAD, "mass_kg", 4.153, "kg", 0.8)
    weak = Detectable("body/passive_gh", "stiffness_factor", 3.9, "1", 0.8)
    [both] = few_in_words(recorded({}, counts={"test": 1, "reference": 1}), [weak, load])
    assert "with one test and one reference trial of each task" in both
    assert "would hardly have shown below 4.2 kg" in both
    [one] = few_in_words(recorded({}, counts={"test": 2, "reference": 1}), [weak])
    assert "with one reference trial of each task: no load in the hand" in one
    repeated = recorded({}, counts={"test": 2, "reference": 3})
    assert few_in_words(repeated, [load]) == []
    [alone_] = few_in_words(recorded({}, counts={"test": 1, "reference": 0}), [load])
    assert "with one test trial" in alone_


def test_without_reference_the_trials_of_the_test_are_left_out():
    places = dict(recorded({}, counts={"test": 2, "reference": 0}).thinned())
    assert {place.side for place in places} == {"test"}
    assert all(not left.reference for left in places.values())


def test_a_contradicted_gap_is_none_and_says_by_what():
    found = Presence(True, 0.01, "max_t", 9.0, 4.0, {})
    odd = odd_one(recorded({("test", "reach", 0): 60.0}, counts={"test": 1, "reference": 3}))
    told = contradicted(found, odd, SETTINGS.alpha)
    assert not told.present
    assert told.p_value == odd.p_value
    assert np.isfinite(told.value)
    assert told.value < told.threshold
    words = in_words(odd, "reach_r5")
    assert "reach_r5" in words
    assert "look at it" in words


@pytest.mark.parametrize(("p_value", "stays"), [(0.002, True), (0.0025, True), (0.004, False)])
def test_a_trial_alone_has_to_be_as_sure_as_two(p_value, stays):
    found = Presence(True, p_value, GLR, 4.0, 3.0, {GLR: 3.0})
    told = as_sure_as_two(found, p_value, 0.05)
    assert told.present == stays
    assert told.p_value == pytest.approx(np.sqrt(p_value))
    assert (told.value >= told.threshold) == stays
    assert told.shape_thresholds == found.shape_thresholds
    # One trial against 24 others cannot be rarer than one in 25 by exchanging places.
    among_few = as_sure_as_two(replace(found, p_value=0.04), p_value, 0.05)
    assert among_few.present == stays
    assert among_few.p_value == pytest.approx(max(0.04, np.sqrt(p_value)))


def test_the_least_level_that_is_accepted_can_be_reached_by_a_trial_alone():
    """P values that are simulated end at one in all draws, over the share of a test."""
    least = 1.0 / (min(SHARES.values()) * (DRAWS + 1))
    for alpha, reached in ((0.045, True), (0.04, False)):
        found = Presence(True, least, MAX_T, 9.0, 4.0, {})
        assert as_sure_as_two(found, least, alpha).present == reached
