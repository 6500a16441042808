"""Probabilities: weights of evidence, limits, and what is kept back in case evidence misleads."""

from dataclasses import replace

import numpy as np
import pytest

from scapulohumeral.gap.isolation.hypothesis import Direction
from scapulohumeral.gap.labels import MOVED
from scapulohumeral.gap.verdict.posterior import (
    COVERAGE,
    UNDECIDED,
    UNPROVEN,
    Circumstances,
    Posterior,
    Score,
    heard,
    no_gap_range,
    posterior,
    probabilities,
    set90,
    unknown_is_likelier,
)
from scapulohumeral.gap.weighing import Weighing

pytestmark = pytest.mark.unit

PLAIN = Weighing(
    evidence=1.0,
    held_out=0.0,
    unknown=1.0,
    misled=0.0,
    foreign=0.0,
    moved=0.0,
    moving=0.5,
    fading=0.0,
    silent=0.8,
    silent_motion=0.6,
    silent_alone=0.7,
    silent_power=0.5,
    least=0.02,
)
FREE = (0.0, 1.0)
WITH_GAP = Circumstances(
    present=True, referenced=True, told=True, able=True, p_value=1.0, misfit=1.0
)
SILENT = replace(WITH_GAP, present=False)
# Where evidence counts as it is.
HEARD = (replace(WITH_GAP, told=False), SILENT, WITH_GAP)
AGAINST = {"no_gap": 50.0}
PRIOR = {"a": 0.3, "b": 0.4, "a + b": 0.01, "none": 0.1, "no_gap": 0.2}


def scores(predictive=None, **evidence):
    """Of the labels in `PRIOR`, with log evidence 0 unless told."""
    logs = {**dict.fromkeys(PRIOR, 0.0), **evidence}
    told = (
        dict.fromkeys(PRIOR) if predictive is None else {**dict.fromkeys(PRIOR, 0.0), **predictive}
    )
    return {name: Score(float(np.log(p)), logs[name], told[name]) for name, p in PRIOR.items()}


def moving(answers, odds):
    """The same answers with log odds that the movement was another one as well."""
    return {name: replace(score, moves=odds) for name, score in answers.items()}


def total(found):
    return sum(found.labels.values()) + found.none + found.no_gap


def test_without_evidence_all_is_as_before():
    found = posterior(scores(), PLAIN, FREE)
    whole = sum(PRIOR.values())
    for label in ("a", "b", "a + b"):
        assert found.labels[label] == pytest.approx(PRIOR[label] / whole)
    assert found.no_gap == pytest.approx(PRIOR["no_gap"] / whole)
    assert found.none == pytest.approx(PRIOR["none"] / whole)
    assert found.first == "b"


@pytest.mark.parametrize("weight", [1.0, 0.3])
def test_evidence_counts_by_its_weight(weight):
    found = posterior(scores(a=7.0, b=2.0), replace(PLAIN, evidence=weight), FREE)
    odds = np.log(found.labels["a"] / found.labels["b"])
    assert odds == pytest.approx(np.log(0.3 / 0.4) + weight * 5.0)


def test_parameters_cost_as_much_as_evidence_of_some_weight_narrows_them():
    """With full weight they have been paid for; with a quarter four times the noise is left."""
    ways = (Direction(8.0, 1.0), Direction(3.0, 0.0))
    free, costly = Score(0.0, 5.0, None), Score(0.0, 5.0, None, directions=ways)
    assert costly.log_weight(PLAIN) == pytest.approx(free.log_weight(PLAIN))
    quarter = replace(PLAIN, evidence=0.25)
    paid = 0.5 * (np.log((1.0 + 8.0) * (1.0 + 3.0)) + 8.0 / 9.0)
    asked = 0.5 * (np.log((1.0 + 2.0) * (1.0 + 0.75)) + 2.0 / 3.0)
    assert costly.log_weight(quarter) == pytest.approx(0.25 * (5.0 + paid) - asked)


def test_more_evidence_counts_on_all_tasks_and_on_those_left_out():
    assert Score(0.0, 5.0, 2.0).with_more(1.5) == Score(0.0, 6.5, 3.5)
    assert Score(0.0, 5.0, None).with_more(1.5) == Score(0.0, 6.5, None)


def test_tasks_that_were_left_out_count_by_a_weight_of_their_own():
    weighing = replace(PLAIN, evidence=0.2, held_out=0.5)
    told = scores({"a": -3.0, "b": 1.0}, a=7.0, b=2.0)
    found = posterior(told, weighing, FREE)
    odds = np.log(found.labels["a"] / found.labels["b"])
    assert odds == pytest.approx(np.log(0.3 / 0.4) + 0.2 * 5.0 - 0.5 * 4.0)


def test_with_one_task_all_weight_is_that_of_its_evidence():
    weighing = replace(PLAIN, evidence=0.2, held_out=0.5)
    found = posterior(scores(a=7.0, b=2.0), weighing, FREE)
    odds = np.log(found.labels["a"] / found.labels["b"])
    assert odds == pytest.approx(np.log(0.3 / 0.4) + 0.7 * 5.0)
    assert weighing.temperature == pytest.approx(1.0 / 0.7)


@pytest.mark.parametrize("better", [90.0, 9000.0])
def test_smooth_forces_alone_do_not_outweigh_a_cause(better):
    """They follow any gap, also one whose cause the model predicts poorly."""
    weighing = replace(PLAIN, unknown=0.33)
    found = posterior(scores(a=50.0, none=50.0 + better), weighing, (0.0, UNDECIDED))
    assert found.none == pytest.approx(0.33)
    assert found.labels["a"] == pytest.approx(0.67)
    assert total(found) == pytest.approx(1.0)
    less = posterior(scores(a=50.0, none=48.0), weighing, (0.0, UNDECIDED))
    assert less.none == pytest.approx(0.1 / (0.1 + 0.3 * np.exp(2.0)), rel=1e-6)


@pytest.mark.parametrize("evidence", [-300.0, -3.0, 3.0, 300.0])
def test_no_gap_stays_inside_of_its_range(evidence):
    told = scores(no_gap=evidence)
    free = posterior(told, PLAIN, FREE).no_gap
    for low, high in ((0.0, UNDECIDED), (0.6, 0.9)):
        found = posterior(told, PLAIN, (low, high))
        assert found.no_gap == pytest.approx(min(max(free, low), high))
        assert total(found) == pytest.approx(1.0)
        # The test for a gap says nothing of which cause it is.
        assert found.labels["a"] / found.labels["b"] == pytest.approx(0.3 / 0.4)


@pytest.mark.parametrize(
    ("present", "referenced", "told", "expected"),
    [
        (True, True, True, (0.0, UNDECIDED)),
        (True, False, False, (0.0, UNDECIDED)),
        (False, True, True, (0.8, 1.0)),
        (False, True, False, (0.6, 1.0)),
        (False, False, True, (0.7, 1.0)),
        (False, False, False, (0.7, 1.0)),
    ],
)
def test_where_no_gap_is_found_there_is_as_probably_none_as_was_seen(
    present, referenced, told, expected
):
    case = Circumstances(present, referenced, told, able=True, p_value=1.0, misfit=1.0)
    assert no_gap_range(PLAIN, case) == pytest.approx(expected)


def test_no_gap_in_trials_that_could_show_little_excludes_no_cause():
    """Causes stay as probable as before any data, and so does no gap, or it is more probable."""
    weak = replace(SILENT, told=True, able=False)
    assert weak.unable
    assert not weak.heard
    assert not replace(weak, able=True).unable
    assert not replace(weak, referenced=False).unable
    assert not replace(weak, present=True).unable
    assert no_gap_range(PLAIN, weak) == (0.0, 1.0)
    for_a_gap, against = (probabilities(scores(**e), PLAIN, weak) for e in ({"a": 50.0}, AGAINST))
    assert for_a_gap.labels["a"] / for_a_gap.labels["b"] == pytest.approx(PRIOR["a"] / PRIOR["b"])
    assert for_a_gap.no_gap == pytest.approx(PRIOR["no_gap"] / sum(PRIOR.values()))
    assert against.no_gap > 0.9
    assert probabilities(scores(a=50.0), PLAIN, replace(weak, present=True)).no_gap < 1e-9


def test_no_gap_is_less_probable_where_a_gap_was_nearly_found():
    """Its odds fall with the power of the p value."""
    least = {p: no_gap_range(PLAIN, replace(SILENT, p_value=p))[0] for p in (1.0, 0.3, 0.06)}
    odds = {p: one / (1.0 - one) for p, one in least.items()}
    for p in (0.3, 0.06):
        assert odds[p] / odds[1.0] == pytest.approx(np.sqrt(p))
    sure = replace(PLAIN, silent=1.0)
    assert no_gap_range(sure, replace(SILENT, p_value=0.06))[0] == 1.0
    assert no_gap_range(PLAIN, replace(WITH_GAP, p_value=0.04))[0] == 0.0


def test_evidence_may_mislead():
    """A share of all but no gap goes back to what was believed: nothing of it to pairs."""
    told, weighing = scores(a=50.0), replace(PLAIN, misled=0.2)
    sure, found = (posterior(told, w, (0.1, 0.1)) for w in (PLAIN, weighing))
    believed = PRIOR["a"] + PRIOR["b"] + PRIOR["none"]
    assert sure.labels["a"] == pytest.approx(0.9)
    assert found.no_gap == pytest.approx(0.1)
    assert found.labels["a"] == pytest.approx(0.9 * (0.8 + 0.2 * PRIOR["a"] / believed))
    assert found.labels["b"] == pytest.approx(0.9 * 0.2 * PRIOR["b"] / believed)
    assert found.none == pytest.approx(0.9 * 0.2 * PRIOR["none"] / believed)
    assert found.labels["a + b"] == pytest.approx(0.0, abs=1e-12)
    assert total(found) == pytest.approx(1.0)


def test_a_cause_that_is_not_in_the_library_may_look_like_one_that_is():
    """A share of all but no gap is of none of these, and no evidence takes it away."""
    told = scores(a=50.0)
    sure, found = (posterior(told, w, (0.1, 0.1)) for w in (PLAIN, replace(PLAIN, foreign=0.3)))
    assert found.no_gap == pytest.approx(0.1)
    assert found.none == pytest.approx(0.9 * 0.3 + 0.7 * sure.none)
    for label, p in sure.labels.items():
        assert found.labels[label] == pytest.approx(0.7 * p)
    assert total(found) == pytest.approx(1.0)


def test_people_may_have_moved_otherwise_whatever_evidence_says():
    weighing = replace(PLAIN, foreign=0.3, moved=0.5)
    told = moving({**scores(a=50.0), MOVED: Score(np.log(0.1), -50.0, None)}, 100.0)
    found = posterior(told, weighing, (0.1, 0.1))
    assert found.labels[MOVED] == pytest.approx(0.9 * 0.7 * 0.5)
    assert found.labels["a"] == pytest.approx(0.9 * 0.7 * 0.5)
    assert found.none == pytest.approx(0.9 * 0.3)
    # Without it among the answers nothing is kept for it.
    assert posterior(scores(a=50.0), weighing, (0.1, 0.1)).labels["a"] == pytest.approx(0.9 * 0.7)


@pytest.mark.parametrize("odds", [-8.0, 0.0, 3.0])
def test_another_movement_is_an_answer_as_far_as_the_first_cause_needs_one_beside_it(odds: float):
    """Odds count by a weight of their own, those of other causes do not."""
    weighing = replace(PLAIN, moved=0.8, moving=0.25)
    told = {**scores(a=50.0), MOVED: Score(np.log(0.1), -500.0, None)}
    told |= {"a": replace(told["a"], moves=odds), "b": replace(told["b"], moves=30.0)}
    found = posterior(told, weighing, FREE)
    assert found.labels[MOVED] == pytest.approx(0.8 / (1.0 + np.exp(-0.25 * odds)))
    assert total(found) == pytest.approx(1.0)


@pytest.mark.parametrize("lead", [-5.0, 0.0, 8.0])
def test_shares_that_are_kept_fade_with_the_odds_of_the_first_cause(lead: float):
    """By their power, and not where evidence is against that cause."""
    weighing = replace(PLAIN, foreign=0.3, moved=0.5)
    answers = {**scores(a=50.0 + lead, none=50.0), MOVED: Score(np.log(0.3), 50.0, None)}
    told = moving(answers, 100.0)
    fades = posterior(told, replace(weighing, fading=0.25), FREE)
    bare = posterior(told, PLAIN, FREE)
    odds = {"none": np.exp(lead) * PRIOR["a"] / PRIOR["none"], MOVED: np.exp(lead)}
    none, moved = (
        share * max(odds[name], 1.0) ** -0.25 for name, share in (("none", 0.3), (MOVED, 0.5))
    )
    kept = (1.0 - none) * (moved + (1.0 - moved) * bare.labels[MOVED])
    assert fades.labels[MOVED] == pytest.approx(kept)
    assert fades.none == pytest.approx(none + (1.0 - none) * (1.0 - moved) * bare.none)
    assert total(fades) == pytest.approx(1.0)


def test_what_is_doubted_is_at_most_even_and_the_rest_is_of_an_unknown_cause():
    found = Posterior({"a": 0.8, "b": 0.1}, none=0.06, no_gap=0.04)
    doubted = found.doubted("a")
    assert doubted.labels == pytest.approx({"a": UNPROVEN, "b": 0.1})
    assert doubted.none == pytest.approx(0.06 + 0.8 - UNPROVEN)
    assert total(doubted) == pytest.approx(1.0)
    assert found.doubted("b") == found


def test_what_cannot_be_told_from_a_label_shares_what_is_doubted_as_it_is_probable():
    found = Posterior({"a": 0.7, "b": 0.1, "c": 0.05, "d": 0.05}, 0.06, 0.04)
    doubted = found.doubted("a", ["a", "b", "c"])
    grown = 1.0 + (0.7 - UNPROVEN) / 0.15
    expected = {"a": UNPROVEN, "b": 0.1 * grown, "c": 0.05 * grown, "d": 0.05}
    assert doubted.labels == pytest.approx(expected)
    assert doubted.none == found.none
    assert total(doubted) == pytest.approx(1.0)
    assert found.doubted("b", ["c"]) == found


def test_the_set_holds_what_is_as_probable_as_most_truths_were():
    found = Posterior({"a": 0.5, "b": 0.04, "c": 0.17}, none=0.25, no_gap=0.04)
    weighing = replace(PLAIN, least=0.17)
    assert set90(found, weighing, told=True) == ("a", "none", "c")
    assert set90(found, replace(weighing, least=0.18), told=True) == ("a", "none")
    assert set90(found, replace(weighing, least=0.9), told=True) == ("a",)


def test_where_causes_are_not_told_apart_the_set_is_the_smallest_that_reaches_its_coverage():
    weighing = replace(PLAIN, least=0.2)
    found = Posterior({"a": 0.5, "b": 0.04, "c": 0.17}, none=0.25, no_gap=0.04)
    assert set90(found, weighing, told=False) == ("a", "none", "c")
    assert 0.5 + 0.25 < COVERAGE < 0.5 + 0.25 + 0.17
    assert set90(Posterior({"a": 0.95}, none=0.05, no_gap=0.0), weighing, told=False) == ("a",)
    alone = Posterior({"a": 0.21, "b": 0.08}, none=0.0, no_gap=0.71)
    assert set90(alone, weighing, told=False) == ("no_gap", "a")


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("rounding", [0.0, 1e-15, -1e-15, 1e-9, -1e-9])
def test_equally_probable_answers_are_in_the_set_together(told: bool, rounding: float):
    tied = {"a": 0.85, "b": 0.03, "c": 0.03 + rounding, "d": 0.03 - rounding, "e": 0.02}
    found = Posterior(tied, none=0.04, no_gap=0.0)
    assert set(set90(found, replace(PLAIN, least=0.03), told)) == {"a", "none", "b", "c", "d"}


def test_motion_without_a_gap_names_no_cause():
    told = scores(a=50.0)
    silent = posterior(told, heard(PLAIN, replace(SILENT, told=False)), FREE)
    assert silent.labels["a"] / silent.labels["b"] == pytest.approx(PRIOR["a"] / PRIOR["b"])
    for case in HEARD:
        found = posterior(told, heard(PLAIN, case), FREE)
        assert found.labels["a"] > 0.99


def test_motion_without_a_gap_leaves_another_movement_as_probable_as_before():
    weighing = replace(PLAIN, foreign=0.3, moved=0.4)
    for case in HEARD:
        kept = heard(weighing, case)
        assert (kept.foreign, kept.moved) == (0.3, 0.4)
    silent = heard(weighing, replace(SILENT, told=False))
    assert (silent.foreign, silent.moved) == (0.0, 0.0)


def test_evidence_counts_less_where_the_likeliest_explanation_misses_the_difference():
    told = scores({"a": 4.0, "b": 0.0}, a=6.0, b=0.0)
    weighing = replace(PLAIN, evidence=0.5, held_out=0.5)
    for excess in (1.0, 2.5):
        found = posterior(told, heard(weighing, replace(WITH_GAP, misfit=excess)), FREE)
        odds = np.log(found.labels["a"] / found.labels["b"])
        assert odds == pytest.approx(np.log(0.3 / 0.4) + 5.0 / excess)


def test_none_of_these_is_likelier_by_evidence_whatever_its_limit():
    limited = replace(PLAIN, unknown=0.3)
    assert unknown_is_likelier(scores(none=50.0), limited)
    assert posterior(scores(none=50.0), limited, FREE).none <= 0.3
    assert not unknown_is_likelier(scores(a=50.0), limited)
    assert not unknown_is_likelier(scores(no_gap=50.0), limited)
