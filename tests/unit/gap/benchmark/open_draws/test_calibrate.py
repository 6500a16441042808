"""Weights of evidence follow from cases whose truth is known, and are judged on cases left out."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from open_cases import GAIN, START, TEAR, open_case
from places import REPOSITORY
from scipy.special import expit, logit

from scapulohumeral.gap.benchmark.open_draws.calibrate import (
    FITTED,
    calibrate,
    fitted,
    least_of_truths,
    left_out,
    log_score,
    loss,
    weights_before,
)
from scapulohumeral.gap.benchmark.open_draws.open_cases import read_opened
from scapulohumeral.gap.cli import main
from scapulohumeral.gap.labels import NO_GAP, NONE
from scapulohumeral.gap.verdict.posterior import Circumstances
from scapulohumeral.gap.weighing import BEFORE, read_weighing

pytestmark = pytest.mark.unit
CONFIG = REPOSITORY / "config/gap"


def test_evidence_that_misleads_gets_less_weight() -> None:
    """With 20 units for the tear it is the cause in three of four cases, or in all."""
    start = replace(START, foreign=0.01, moved=0.01)
    trusted = fitted([open_case(20.0)] * 80, start)
    misleading = [open_case(20.0, (GAIN,))] * 20 + [open_case(20.0)] * 60
    doubted = fitted(misleading, start)
    p = [open_case(20.0).p_cause(w) for w in (trusted, doubted)]
    assert p[0] > 0.95
    assert p[1] == pytest.approx(0.75, abs=0.06)
    assert log_score(misleading, doubted) > log_score(misleading, start)


def test_few_cases_do_not_move_weights_far() -> None:
    """Those in use are what earlier draws said."""
    few, many = (fitted([open_case(20.0, (NONE,))] * n, START) for n in (1, 100))
    assert START.foreign < few.foreign < 0.2
    assert many.foreign > 0.8


@pytest.mark.parametrize("count", [8, 9, 40, 200])
def test_nine_in_ten_further_truths_are_as_probable_as_the_least_of_a_set(count: int) -> None:
    """Whatever the cases are: of as many and one more any may be the further one."""
    rng = np.random.default_rng(count)
    evidence = rng.normal(0.0, 8.0, count + 1)
    cases = [open_case(x, (TEAR, GAIN), draw=str(i)) for i, x in enumerate(evidence)]
    judged = [(case, START) for case in cases]
    held = [
        case.p_best(START) >= least_of_truths([*judged[:i], *judged[i + 1 :]])
        for i, (case, _) in enumerate(judged)
    ]
    assert 0.9 <= np.mean(held) <= 0.9 + 1.0 / (count + 1) + 1e-9 or count < 9 and all(held)


def test_sets_that_go_by_no_evidence_count_as_they_hold_the_truth() -> None:
    """Sets of the other cases may miss as many truths more as these miss fewer than one in ten."""
    about = Circumstances(False, referenced=True, told=False, able=True, p_value=0.5, misfit=1.0)
    heard = [(open_case(float(x)), START) for x in range(39)]
    truths = sorted(case.p_best(START) for case, _ in heard)
    assert least_of_truths(heard) == truths[3]
    # All of these sets hold "no gap", and none this cause.
    still, wrong = (
        [(replace(open_case(-40.0, right, False), about=about), START)] * 10
        for right in ((NO_GAP,), ("body/x/1",))
    )
    assert least_of_truths([*heard, *still]) == truths[4]
    assert least_of_truths([*heard, *wrong]) == least_of_truths(still) == 0.0
    both = open_case(0.0, (TEAR, GAIN))
    assert both.p_best(START) == pytest.approx(0.5 * both.p_cause(START))


def test_both_right_answers_count() -> None:
    alone = open_case(0.0, (TEAR,)).p_cause(START)
    both = open_case(0.0, (TEAR, GAIN)).p_cause(START)
    assert both == pytest.approx(2.0 * alone)


def test_silence_is_as_probable_as_it_was_right() -> None:
    quiet, missed = (open_case(0.0, right, present=False) for right in ((NO_GAP,), (TEAR,)))
    found = fitted([quiet] * 90 + [missed] * 60, START)
    assert found.silent == pytest.approx(0.6, abs=0.02)
    # One answer hardly counts against those that the weights in use were fitted to.
    assert fitted([missed], START).silent == pytest.approx(START.silent, abs=0.15)
    # Nothing was seen of the other modes.
    assert found.silent_motion == pytest.approx(START.silent_motion, abs=1e-3)
    assert found.silent_alone == pytest.approx(START.silent_alone, abs=1e-3)
    assert found.evidence == START.evidence


@pytest.mark.parametrize("p_value", [0.06, 0.03])
def test_silence_with_a_small_p_value_is_as_probable_as_that_was_right(p_value: float) -> None:
    """Of silences of one small p value half were right: odds of nine to one without."""
    quiet, missed = (open_case(0.0, right, present=False) for right in ((NO_GAP,), (TEAR,)))
    both = ((NO_GAP,), (TEAR,))
    even = [open_case(0.0, right, False, p_value=p_value) for right in both]
    found = fitted([quiet] * 450 + [missed] * 50 + even * 50, START)
    assert found.silent == pytest.approx(0.9, abs=0.01)
    power = np.log(9.0) / -np.log(p_value)
    assert found.silent_power == pytest.approx(power, abs=0.05)


def test_each_case_is_judged_by_weights_that_have_not_seen_its_draw() -> None:
    cases = [open_case(20.0, draw="one")] * 4 + [open_case(20.0, (GAIN,), draw="two")] * 4
    judged = left_out(cases, START)
    p = {draw: [c.p_cause(w) for c, w in judged if c.draw == draw] for draw in ("one", "two")}
    # Each draw teaches the opposite of the other.
    assert max(p["one"]) < 0.7
    assert max(p["two"]) < 0.2
    assert len(left_out(cases[:4], START)) == 4


def test_the_file_is_read_as_written(tmp_path) -> None:
    cases = [open_case(20.0) for _ in range(5)]
    out = tmp_path / "calibration.json"
    found = calibrate(cases, START, out)
    assert asdict(read_weighing(out)) == pytest.approx(asdict(found), abs=1e-4)
    assert read_weighing(out, BEFORE) == START
    document = json.loads(out.read_text())
    assert document["cases"] == {"one": 5}
    assert document["left_out"]["by"] == "fifth"
    assert document["left_out"]["log_score_with_weights_before"] == pytest.approx(
        log_score(cases, START), abs=1e-4
    )
    # What these cases say is in the weights now: with them again, those before count.
    now = replace(START, evidence=0.9)
    assert weights_before(out, cases, now) == START
    assert weights_before(out, [open_case(20.0, draw="two")], now) == now


def test_without_any_opened_draw_there_is_nothing_to_fit(tmp_path, capsys) -> None:
    assert main(["gap", "calibrate", "--opened", str(tmp_path / "none")]) == 2
    assert "no DRAWS" in capsys.readouterr().err


def test_weights_in_use_are_what_their_draws_ask_for() -> None:
    """Any of them half a unit of log odds away, or more, is worse."""
    draws = json.loads((CONFIG / "calibration.json").read_text(encoding="utf-8"))["cases"]
    cases = [case for case in read_opened(CONFIG / "opened") if case.draw in draws]
    assert {draw: sum(case.draw == draw for case in cases) for draw in draws} == draws
    gaps = [case for case in cases if case.about.present]
    used = read_weighing(CONFIG / "calibration.json")
    before = read_weighing(CONFIG / "calibration.json", BEFORE)
    least = loss(gaps, used, before)
    assert least < loss(gaps, before, before)
    for name in FITTED:
        odds = logit(getattr(used, name))
        for step in (-0.5, 0.5):
            other = replace(used, **{name: float(expit(odds + step))})
            assert least < loss(gaps, other, before) + 1e-3
