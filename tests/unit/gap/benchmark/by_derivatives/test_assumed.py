"""Persons who are just as assumed: what is drawn, and how often answers to them are right."""

from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
from made_up_evidence import SETTINGS, bare, supposed_residuals

from scapulohumeral.gap.benchmark.by_derivatives import assumed_persons
from scapulohumeral.gap.benchmark.by_derivatives.assumed_answers import AssumedRow
from scapulohumeral.gap.benchmark.by_derivatives.assumed_persons import (
    MOVEMENT,
    NOTHING,
    PAIR,
    SHOWN,
    SINGLE,
    UNKNOWN,
    draw_person,
)
from scapulohumeral.gap.benchmark.by_derivatives.assumed_rates import rates
from scapulohumeral.gap.isolation.priors import PAIRS
from scapulohumeral.gap.labels import JOIN, family

pytestmark = pytest.mark.unit

PERSONS = 300
# Half of the variance is known by eight degrees of freedom (Student's t), half exactly.
VARIANCE = 0.5 * 8.0 / 6.0 + 0.5
RESIDUALS = {
    size: replace(one, noise=0.5 * supposed_residuals()[0.0].noise)
    for size, one in supposed_residuals().items()
}
ROW = AssumedRow(
    case="a", number=0, kind=SINGLE, truth="body/hand_load", weight=1.0, moved_deg=0.0, cause=3.0,
    movement=0.0, shown=True, multiple=3.0, length=5.0, present=True, p_value=0.01, decided=True,
    first="body/hand_load", p=0.9, right=True, class_right=True, right_p=0.9, none_p=0.05,
    no_gap_p=0.0, covered=True, labels=2, left=False, off=0.1, exact_first="body/hand_load",
    exact_p=0.5, exact_right=True, exact_right_p=0.5,
)  # fmt: skip


@pytest.fixture(name="evidence")
def _evidence(monkeypatch):
    """Evidence whose residuals do not depend on what movements were solved."""
    monkeypatch.setattr(
        assumed_persons, "assumed", lambda known, _: replace(known, residuals=RESIDUALS)
    )
    return bare()


@pytest.fixture(name="quiet")
def _quiet(monkeypatch):
    """Persons who do not scatter."""
    monkeypatch.setattr(
        assumed_persons, "draws", lambda same, count, _: np.zeros((len(same.delta), count))
    )


def persons(evidence, kind):
    return [draw_person(evidence, kind, seed) for seed in range(PERSONS)]


def test_without_a_cause_differences_scatter_as_without_a_cause(evidence):
    every = persons(evidence, NOTHING)
    drawn = np.array([person.delta for person in every])
    assert np.mean(drawn**2) == pytest.approx(VARIANCE, rel=0.1)
    assert {person.moved_deg for person in every} == {0.0}
    assert {person.truth for person in every} == {""}


def test_another_movement_adds_what_is_supposed_of_it(evidence):
    same, other = RESIDUALS.values()
    added = np.diag(other.covariance - same.covariance)
    drawn = np.array([person.delta for person in persons(evidence, MOVEMENT)])
    halves = np.array_split(np.mean(drawn**2, axis=0) - VARIANCE, 2)
    for half, expected in zip(halves, np.array_split(added, 2), strict=True):
        assert np.mean(half) == pytest.approx(np.mean(expected), abs=0.08)


def test_causes_are_as_frequent_as_they_are_believed_to_be_and_inside_bounds(evidence):
    every = persons(evidence, SINGLE)
    labels = pd.Series([person.truth for person in every]).value_counts(normalize=True)
    believed = np.array([evidence.prior[label] for label in labels.index])
    np.testing.assert_allclose(labels, believed / believed.sum(), atol=0.1)
    for person in every:
        [cause], [x] = person.causes, person.x
        low, high = cause.bounds
        assert np.all((low <= x) & (x <= high))
        assert all(x[i] <= x[j] for i, j in cause.order)


def test_the_two_of_a_pair_are_of_different_families(evidence):
    for person in persons(evidence, PAIR):
        first, second = person.truth.split(JOIN)
        assert family(first) != family(second)
        assert person.shown == (min(person.cause_shows) >= SHOWN)


@pytest.mark.usefixtures("quiet")
def test_a_person_answers_as_far_otherwise_as_predictions_may_be_off(evidence):
    exact = replace(evidence, settings=replace(SETTINGS, signature_error=0.0))
    for known, alike in ((exact, True), (evidence, False)):
        for person in persons(known, SINGLE)[:20]:
            [cause], [x] = person.causes, person.x
            if person.moved_deg == 0.0:
                assert np.allclose(person.delta, cause.predict(x)) == alike


@pytest.mark.usefixtures("quiet")
def test_smooth_inputs_change_what_they_can(evidence):
    columns = evidence.unknown_inputs.columns
    for person in persons(evidence, UNKNOWN)[:20]:
        if person.moved_deg == 0.0:
            amounts, *_ = np.linalg.lstsq(columns, person.delta, rcond=None)
            np.testing.assert_allclose(columns @ amounts, person.delta, atol=1e-9)
            assert person.causes == ()


def test_one_seed_is_one_person(evidence):
    first, again, other = (draw_person(evidence, SINGLE, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.delta, again.delta)
    assert not np.allclose(first.delta, other.delta)


def table(*rows):
    return pd.DataFrame([asdict(replace(ROW, number=i, **row)) for i, row in enumerate(rows)])


def test_rates_count_what_shows():
    """Of four single effects one does not show, one is no gap, one is large and not named."""
    found = rates(
        table({}, {"shown": False}, {"present": False}, {"multiple": 2.5, "right": False}), SETTINGS
    )
    assert (found["family"]["hits"], found["family"]["n"]) == (1, 3)
    assert (found["large_family"]["hits"], found["large_family"]["n"]) == (1, 3)
    assert found["gap_found"]["hits"] == 2


def test_a_pair_is_told_by_both_or_by_one_and_that_something_is_left():
    pair = {"kind": PAIR, "truth": "body/hand_load + body/segment_mass/forearm", "right": False}
    found = rates(
        table(
            {},
            {**pair, "left": True},
            {**pair, "left": False},
            {**pair, "left": True, "first": "body/joint_damping"},
            {**pair, "right": True},
        ),
        SETTINGS,
    )
    assert (found["pairs"]["hits"], found["pairs"]["n"]) == (2, 4)


def test_an_unknown_cause_is_rejected_by_what_hardly_any_effect_reaches():
    singles = [{"none_p": p} for p in np.linspace(0.0, 0.2, 11)]
    unknown = [{"kind": UNKNOWN, "truth": "", "none_p": p} for p in (0.17, 0.19, 0.5)]
    assert rates(table(*singles, *unknown), SETTINGS)["unknown_rejected"]["hits"] == 2


@pytest.mark.parametrize(("right", "error"), [(5, 0.0), (10, 0.5), (0, 0.5)])
def test_evidence_that_is_right_as_often_as_it_says_has_no_error(right, error):
    rows = [{"exact_right": i % 10 < right} for i in range(100)]
    found = rates(table(*rows), SETTINGS)["exact_calibration"]
    assert found["error"] == pytest.approx(error, abs=1e-9)
    assert found["mean_log_p"] == pytest.approx(np.log(0.5), abs=1e-4)


def test_kinds_count_as_they_are_believed_to_be():
    """However many were drawn: a single effect is more probable than no gap."""
    few = [{"kind": NOTHING, "truth": "", "exact_right": False}] * 50
    found = rates(table({"exact_p": 1.0}, *[{**row, "exact_p": 1.0} for row in few]), SETTINGS)
    believed = SETTINGS.prior_no_gap
    single = 1.0 - sum((believed, SETTINGS.prior_none, SETTINGS.prior_moved, PAIRS))
    assert found["exact_calibration"]["error"] == pytest.approx(
        believed / (believed + single), abs=1e-3
    )
