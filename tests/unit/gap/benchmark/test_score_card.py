"""Metrics of the score card on cases whose scores are known beforehand."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import binom

from scapulohumeral.gap.benchmark.metrics import (
    area_under_curve,
    calibration_error_by_chance,
    family_probabilities,
    rate,
)
from scapulohumeral.gap.benchmark.noise_free.trial import noise_free_trial
from scapulohumeral.gap.benchmark.protocol import _with_hidden
from scapulohumeral.gap.benchmark.score_card import group_scores, rejection_threshold, score_card
from scapulohumeral.gap.benchmark.scored_case import HiddenGap, ScoredCase, size_of
from scapulohumeral.gap.effects.base import Setup
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE, matches
from scapulohumeral.gap.left_over import LeftOver, left_in_words
from simulated_persons.effects import LIBRARY_LIKE

pytestmark = pytest.mark.unit

TEAR = "body/strength_loss/infra"
GAIN = "measurement/emg_gain/EMG_infra"
REMOVED = HiddenGap(4.0, 1.0)


def key(label: str | None, shown: bool = True, amplitude: float = 0.5, number: int = 1) -> dict:
    effects = [{"label": label, "parameter": "f0_factor", "amplitude": amplitude}]
    change = np.zeros((101, 2))
    change[40:61, 1] = 5.0
    time, lifted = np.linspace(0.0, 2.0, 101), np.zeros((101, 10))
    lifted[:, 7] = -10.0 - 30.0 * time
    trial = {"time_s": time, "angles_deg": lifted, "emg": None}
    return {
        "case": f"c{number}",
        "plant": "P1",
        "mode": {"emg": True, "reference": True},
        "effects": effects if label else [],
        "shown": shown and label is not None,
        "channels": ["SC_rx", "EMG_infra"],
        "footprint": {"SC_rx": 0.1, "EMG_infra": 4.0},
        "change_sigma": {"frontal": change.tolist()},
        "noise_free": {"frontal": {"test": trial}},
    }


def answer(p: dict[str, float], value: float = 0.5, present: bool = True, **more) -> dict:
    """Answer with probabilities; none and no_gap share what is left."""
    parameters = [{"name": "f0_factor", "value": value, "ci95": [value - 0.1, value + 0.1]}]
    rest = 1.0 - sum(p.values())
    region = {"channel": "EMG_infra", "phase_percent": [40, 60], "share": 1.0}
    document = {
        "status": "ok",
        "gap": {"present": present, "smallest_detectable": []},
        "candidates": [{"label": k, "p": v, "parameters": parameters} for k, v in p.items()],
        "none_p": 0.5 * rest,
        "no_gap_p": 0.5 * rest,
        "set90": list(p),
        "classes": [],
        "regions": {"shows": [region]},
        "warnings": [],
        "shrinkage": {"new_task": {"value": 0.8, "ci95": [0.7, 0.9]}},
    }
    return {**document, **more}


def case(
    key_: dict, answer_: dict | None, folder: Path = Path("absent"), hidden: HiddenGap | None = None
) -> ScoredCase:
    return ScoredCase(folder, folder, key_, answer_, 10.0, hidden)


@pytest.fixture(autouse=True)
def no_baselines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cases here have no trials that a baseline could read."""
    monkeypatch.setattr(
        "scapulohumeral.gap.benchmark.scored_case.baseline_families",
        lambda *_: {"prior_only": "x/y"},
    )


def test_wilson_interval() -> None:
    """Newcombe 1998, table I: 81 of 263 gives 0.2553 to 0.3662."""
    found = rate([True] * 81 + [False] * 182)
    np.testing.assert_allclose(found["wilson95"], [0.2553, 0.3662], atol=1e-4)
    assert rate([])["value"] is None


@pytest.mark.parametrize(
    ("label", "truth", "same"),
    [
        (TEAR, TEAR, True),
        ("body/strength_loss", TEAR, True),
        ("body/strength_loss/all", TEAR, True),
        ("body/strength_loss/delt_scap", TEAR, False),
        (GAIN, TEAR, False),
        ("none", TEAR, False),
    ],
)
def test_labels_match_by_family_and_member(label: str, truth: str, same: bool) -> None:
    assert matches(label, truth) is same


def test_members_of_a_family_add_up() -> None:
    split = answer({TEAR: 0.3, "body/strength_loss/supra": 0.25, GAIN: 0.4})
    assert next(iter(family_probabilities(split))) == "body/strength_loss"


def test_right_and_wrong_singles() -> None:
    right = case(key(TEAR), answer({TEAR: 0.8, GAIN: 0.1}, value=0.6))
    wrong = case(key(TEAR, number=2), answer({GAIN: 0.7, TEAR: 0.2}, value=0.5))
    scores = group_scores([right, wrong])
    assert scores["family_top1"]["value"] == 0.5
    assert scores["family_top3"]["value"] == 1.0
    assert scores["side_top1"]["value"] == 0.5
    assert scores["mean_family_p"] == pytest.approx(0.5)
    assert scores["set90"]["coverage"]["value"] == 1.0
    # Amplitudes 0.6 and 0.5 for 0.5, over the change from 1: errors 0.2 and 0.
    assert scores["amplitude"]["relative_error"]["median"] == pytest.approx(0.1)
    assert scores["regions"]["f1"]["median"] == 1.0
    assert scores["regions"]["largest_channel"]["value"] == 1.0
    assert scores["confusion"]["body/strength_loss"] == {
        "body/strength_loss": 1,
        "measurement/emg_gain": 1,
    }
    assert scores["baselines"]["prior_only"]["value"] == 0.0


def test_regions_are_those_of_the_movement_and_not_of_the_recording() -> None:
    """The arm rests in the first and last quarter: 40 to 60 % of the recording are 30 to 70."""
    resting = key(TEAR)
    curves = resting["noise_free"]["frontal"]["test"]
    curves["angles_deg"][:, 7] = -10.0 - 60.0 * np.clip(curves["time_s"] - 0.5, 0.0, 1.0)
    start, end = noise_free_trial(curves, resting["channels"], "frontal", "test").window_s
    assert (start, end) == pytest.approx((0.5, 1.5), abs=0.1)

    def f1(first: float, last: float) -> float:
        region = {"channel": "EMG_infra", "phase_percent": [first, last], "share": 1.0}
        named = case(resting, answer({TEAR: 0.9}, regions={"shows": [region]}))
        return group_scores([named])["regions"]["f1"]["median"]

    assert f1(31, 69) > 0.95 > f1(40, 60)
    # Keys of earlier draws hold no trial without noise.
    del resting["noise_free"]
    early = group_scores([case(resting, answer({TEAR: 0.9}))])["regions"]
    assert (early["f1"]["n"], early["largest_channel"]["n"]) == (0, 1)


def test_a_class_that_holds_the_truth_is_right() -> None:
    both = {"labels": [TEAR, GAIN], "p": 0.9}
    answered = answer({GAIN: 0.5, TEAR: 0.4}, classes=[both])
    scores = group_scores([case(key(TEAR), answered)])
    assert scores["family_top1"]["value"] == 0.0
    assert scores["class_top1"]["value"] == 1.0


def test_bars_ask_for_effects_twice_the_smallest_detectable() -> None:
    """Half the strength is large where 0.8 would be seen, a fifth lost is not."""
    smallest = [{"label": TEAR, "parameter": "f0_factor", "value": 0.8}]
    seen = {"gap": {"present": True, "smallest_detectable": smallest}}
    large = case(key(TEAR, amplitude=0.5), answer({TEAR: 0.9}, **seen))
    both = {TEAR: 0.05, GAIN: 0.9}
    small = case(key(TEAR, amplitude=0.7), answer(both, **seen))
    other = [{"label": TEAR, "parameter": "slack_factor", "value": 0.9}]
    by_another = {"gap": {"present": True, "smallest_detectable": other}}
    unlisted = case(key(TEAR, amplitude=0.1), answer(both, **by_another))
    in_other_units = key(TEAR, amplitude=0.7)
    in_other_units["effects"][0]["parameter"] = "torn_mm"
    assert case(in_other_units, answer({TEAR: 0.9}, **by_another)).large
    unanswered = case(key(TEAR), None)
    assert [c.large for c in (large, small, unlisted, unanswered)] == [True, False, False, True]
    scores = group_scores([large, small, unlisted, unanswered])
    assert scores["family_top1"]["n"] == 4
    assert (scores["large"]["family_top1"]["hits"], scores["large"]["family_top1"]["n"]) == (1, 2)
    assert scores["large"]["baselines"]["prior_only"]["n"] == 2


def test_effects_without_a_size_to_compare_are_counted_apart() -> None:
    stiff = key("body/passive_gh", amplitude=0.1)
    stiff["effects"][0]["parameter"] = None
    found = case(stiff, answer({"body/passive_gh": 0.9}))
    assert not found.large
    scores = group_scores([found, case(stiff, None), case(key(TEAR), None)])
    assert scores["large"]["family_top1"]["n"] == 1
    apart = scores["without_size"]["family_top1"]
    assert (apart["hits"], apart["n"]) == (1, 2)


@pytest.mark.parametrize("factor", [0.4, 1.0 / 0.4])
def test_a_factor_and_its_inverse_are_equally_large(factor: float) -> None:
    """The smallest that would be found is published above one: 1.5 stands for 1 / 1.5 as well."""
    gain = key(GAIN, amplitude=factor)
    gain["effects"][0]["parameter"] = "gain_factor"

    def promised(value: float) -> ScoredCase:
        smallest = [{"label": GAIN, "parameter": "gain_factor", "value": value}]
        parameters = [{"name": "gain_factor", "value": factor, "ci95": None}]
        return case(
            gain,
            answer(
                {},
                candidates=[{"label": GAIN, "p": 0.9, "parameters": parameters}],
                gap={"present": True, "smallest_detectable": smallest},
            ),
        )

    # Twice the logarithm of 1.5 is that of 2.25, below 2.5; that of 1.6 is above.
    assert promised(1.5).large
    assert not promised(1.6).large


def test_sizes_are_on_the_scale_that_is_fitted() -> None:
    channels = ("EMG_infra", "EMG_serr")
    effects = library(Setup(("infra", "serr_ant"), channels, (channels,), True))
    injected = [draw(np.random.default_rng(1)) for draw in LIBRARY_LIKE]
    kinds = {(i.label.split("/")[1], i.parameter): i.amplitude for i in injected if i.parameter}
    seen = {
        (effect.family, param.name): param
        for effect in effects
        for param in effect.params
        if (effect.family, param.name) in kinds
    }
    assert set(seen) == set(kinds)
    for kind, param in seen.items():
        assert size_of(kind[1], kinds[kind]) == pytest.approx(abs(param.internal(kinds[kind])))


def test_nulls_count_for_false_alarms_only() -> None:
    quiet = case(key(None), answer({}, present=False, no_gap_p=0.9, none_p=0.1, set90=["no_gap"]))
    alarm = case(key(None, number=2), answer({TEAR: 0.9}))
    scores = group_scores([quiet, alarm])
    assert scores["false_alarms"]["value"] == 0.5
    assert scores["detection"]["n"] == 0
    assert scores["set90"]["coverage"]["value"] == 0.5


def test_sets_are_judged_of_single_effects_apart_from_all_others() -> None:
    quiet = answer({}, present=False, no_gap_p=0.9, none_p=0.1, set90=["no_gap"])
    held, missed = answer({TEAR: 0.9}), answer({GAIN: 0.9})
    cases = [case(key(TEAR), held), case(key(TEAR), missed), case(key(TEAR), missed)]
    cases += [case(key(None), quiet), case(key(TEAR, shown=False), quiet), case(key(None), None)]
    found = group_scores(cases)["set90"]["coverage_by_kind"]
    told = {kind: (share["hits"], share["n"]) for kind, share in found.items()}
    assert told == {"single effects": (1, 3), "others": (2, 2)}


def test_an_alarm_is_one_whether_a_cause_is_named_or_not() -> None:
    abstained = case(key(None), answer({TEAR: 0.4}, status="abstained"))
    failed = case(key(None, number=2), answer({}, status="failed", gap=None))
    scores = group_scores([abstained, failed])
    assert scores["false_alarms"]["value"] == 0.5
    assert scores["abstention"]["value"] == 1.0
    found = group_scores([case(key(TEAR), answer({TEAR: 0.4}, status="abstained"))])
    assert found["detection"]["value"] == 1.0
    assert found["family_top1"]["value"] == 0.0


def test_effects_that_hardly_show_are_not_asked_for() -> None:
    silent = answer({}, present=False, no_gap_p=0.9, none_p=0.1, set90=["no_gap"])
    scores = group_scores([case(key(TEAR, shown=False), silent)])
    assert scores["family_top1"]["n"] == 0
    assert scores["abstention_hidden"]["value"] == 1.0
    assert scores["set90"]["coverage"]["value"] == 1.0


def test_missing_answers_are_wrong() -> None:
    scores = group_scores([case(key(TEAR), None), case(key(TEAR), answer({}, status="abstained"))])
    assert scores["family_top1"]["value"] == 0.0
    assert scores["abstention"]["value"] == 1.0


def test_unknowns_are_told_from_knowns_by_none() -> None:
    known = [case(key(TEAR), answer({TEAR: 0.9})) for _ in range(5)]
    far = case(key("unknown/far/friction"), answer({TEAR: 0.1}, none_p=0.8, no_gap_p=0.1))
    near = case(key("unknown/near/uneven_tear"), answer({TEAR: 0.98}, none_p=0.01, no_gap_p=0.01))
    scores = group_scores([*known, far, near])["unknown"]
    assert scores["auroc"] == pytest.approx(0.5)
    assert scores["rejected"]["far"]["value"] == 1.0
    assert scores["rejected"]["near"]["value"] == 0.0


def test_a_case_is_rejected_in_every_column_or_in_none() -> None:
    known = [case(key(TEAR), answer({TEAR: 0.3}, none_p=0.7)) for _ in range(5)]
    far = case(key("unknown/far/friction"), answer({TEAR: 0.4}, none_p=0.6, no_gap_p=0.0))
    limit = rejection_threshold([*known, far])
    alone, together = group_scores([far], limit), group_scores([*known, far])
    rejected = [scores["unknown"]["rejected"]["far"]["value"] for scores in (alone, together)]
    assert rejected == [0.0, 0.0]


def test_singles_that_abstain_do_not_decide_what_is_rejected() -> None:
    """With them the threshold was 1 where more than a tenth abstains: nothing is above."""
    known = [case(key(TEAR), answer({}, none_p=0.1 * k, no_gap_p=0.0)) for k in range(1, 9)]
    silent = [case(key(TEAR), answer({}, status="abstained")), case(key(TEAR), None)]
    sure = answer({}, none_p=0.85, no_gap_p=0.0)
    like_singles = answer({}, none_p=0.75, no_gap_p=0.0)
    far = [
        case(key("unknown/far/friction"), one)
        for one in (sure, like_singles, answer({}, status="abstained"))
    ]
    # Of eight singles the ninth tenth is the largest: 0.73 would lie between two of them.
    assert rejection_threshold([*known, *silent]) == pytest.approx(0.8)
    scores = group_scores([*known, *silent, *far])["unknown"]
    assert scores["rejected"]["far"]["hits"] == 2
    beside = scores["singles_without_verdict"]
    assert (beside["hits"], beside["n"]) == (2, 10)


def test_area_under_curve_counts_ties_half() -> None:
    assert area_under_curve([0.5, 0.9], [0.5, 0.1]) == pytest.approx(0.875)
    assert area_under_curve([], [0.1]) is None


def test_pairs_need_both_members() -> None:
    pair = key(TEAR)
    pair["effects"].append({"label": GAIN, "parameter": "gain_factor", "amplitude": 2.0})
    exact = case(pair, answer({f"{TEAR} + {GAIN}": 0.9}))
    half = case(pair, answer({TEAR: 0.9}))
    scores = group_scores([exact, half])["pairs"]
    assert scores["both_in_set"]["value"] == 0.5
    assert scores["exact"]["value"] == 0.5
    assert scores["both_or_one_and_more"]["value"] == 0.5


def test_sure_answers_are_counted_and_those_that_are_wrong() -> None:
    pair = key(TEAR)
    pair["effects"].append({"label": GAIN, "parameter": "gain_factor", "amplitude": 2.0})
    cases = [
        case(key(TEAR), answer({TEAR: 0.9})),
        case(key(TEAR), answer({TEAR: 0.7, GAIN: 0.2})),
        case(key(TEAR), answer({GAIN: 0.85})),
        case(key(TEAR), answer({f"{TEAR} + {GAIN}": 0.9})),
        case(key(None), answer({}, present=False, no_gap_p=0.9, none_p=0.1)),
        case(pair, answer({TEAR: 0.9})),
        case(pair, answer({f"{TEAR} + {GAIN}": 0.9})),
    ]
    found = group_scores(cases)["sure_and_wrong"]
    assert (found["hits"], found["n"]) == (2, 6)


def test_one_of_a_pair_is_enough_where_the_answer_says_that_something_is_left() -> None:
    pair = key(TEAR)
    pair["effects"].append({"label": GAIN, "parameter": "gain_factor", "amplitude": 2.0})
    remark = left_in_words(TEAR, LeftOver(SimpleNamespace(p_value=0.01), (), GAIN))
    named = answer({TEAR: 0.9}, warnings=["another remark", remark])
    wrong = answer({"body/passive_gh": 0.9}, warnings=[remark])
    scores = group_scores([case(pair, named), case(pair, wrong)])["pairs"]
    assert scores["both_or_one_and_more"]["hits"] == 1
    # Of a single effect the remark is a false one.
    assert group_scores([case(key(TEAR), named)])["says_more"]["value"] == 1.0


def test_shrinkage_is_compared_with_the_truth_where_it_is_known() -> None:
    # Root mean squares of 4 and 1.5 that a recording with a floor of 1 would show, and 4 and 2.5.
    gaps = [HiddenGap(np.sqrt(15.0), np.sqrt(after**2 - 1.0)) for after in (1.5, 2.5)]
    assert [gap.reducible for gap in gaps] == pytest.approx([5 / 6, 0.5])
    scored = [case(key(TEAR), answer({TEAR: 0.9}), hidden=hidden) for hidden in (*gaps, None)]
    found = group_scores(scored)["shrinkage"]
    assert found["keeps"]["value"] == 1.0
    assert found["error"]["n"] == 2
    assert found["error"]["median"] == pytest.approx((0.3 + 1 / 30) / 2, abs=1e-4)
    assert found["ci_coverage"]["value"] == 0.5


def otherwise(key_: dict, shown: bool = True, person: str = "changes") -> dict:
    """A key whose test movement was done otherwise."""
    return {**key_, "person": person, "otherwise": {"deg": {"SC_rx": 6.0}, "shown": shown}}


def alone(key_: dict) -> dict:
    """A key of a case without reference trials."""
    return {**key_, "mode": {**key_["mode"], "reference": False}}


@pytest.mark.parametrize(
    ("key_", "status", "right"),
    [
        (otherwise(key(TEAR)), "single", (TEAR, MOVED)),
        (otherwise(key(TEAR), shown=False), "single", (TEAR,)),
        (otherwise(key(TEAR, shown=False)), "moved", (MOVED, TEAR)),
        (otherwise(key(TEAR, shown=False), shown=False), "hidden", (NO_GAP, TEAR)),
        (otherwise(key(MOVED), person="keeps"), "moved", (MOVED,)),
        (otherwise(key(MOVED, shown=False), shown=False), "hidden", (NO_GAP, MOVED)),
        (otherwise(key("unknown/far/splint")), "unknown", (NONE, MOVED)),
        (alone(otherwise(key(TEAR))), "single", (TEAR,)),
        (alone(otherwise(key(MOVED))), "null", (NO_GAP, MOVED)),
        (key("body/thorax_surface"), "unknown", (NONE,)),
        (alone(key("body/thorax_surface")), "single", ("body/thorax_surface",)),
        (alone(otherwise(key(TEAR, shown=False))), "hidden", (NO_GAP, TEAR)),
        (key("unknown/far/splint"), "unknown", (NONE,)),
        (key(None), "null", (NO_GAP,)),
    ],
)
def test_another_movement_that_shows_is_a_right_answer_too(key_, status, right) -> None:
    found = case(key_, None)
    assert found.status == status
    assert found.right == right
    beside = status in ("single", "unknown")
    assert found.cause == tuple(label for label in right if not (beside and label == MOVED))


def test_the_effect_and_the_movement_are_both_right_but_only_one_is_the_effect() -> None:
    both = otherwise(key(TEAR))
    named = [case(both, answer({TEAR: 0.9})), case(both, answer({MOVED: 0.9}))]
    wrong = case(both, answer({GAIN: 0.9}))
    scores = group_scores([*named, wrong])
    assert (scores["family_top1"]["hits"], scores["effect_top1"]["hits"]) == (2, 1)
    assert (scores["class_top1"]["hits"], scores["side_top1"]["hits"]) == (2, 2)
    assert scores["set90"]["coverage"]["hits"] == 2
    assert scores["calibration"]["bins"][-1]["right"] == 1.0
    assert sum(one["right"] * one["n"] for one in scores["cause_calibration"]["bins"]) == 1.0
    # What is removed of the hidden task is asked of the effect alone.
    assert [one.right_single for one in named] == [True, False]


def test_a_changed_movement_alone_is_no_single_effect() -> None:
    strategy = otherwise(key(MOVED), person="yields")
    silent = answer({}, present=False, no_gap_p=0.9, none_p=0.1, set90=["no_gap"])
    scores = group_scores([case(strategy, answer({MOVED: 0.9})), case(strategy, silent)])
    assert scores["detection"]["n"] == 0
    assert {name: scores["moved"][name]["hits"] for name in scores["moved"]} == {
        "detection": 1,
        "named": 1,
        "in_set": 1,
    }
    assert scores["confusion"][MOVED] == {MOVED: 1, NO_GAP: 1}


def test_scores_are_split_by_mode_and_person() -> None:
    keeps = {**key(TEAR), "person": "keeps"}
    cases = [case(keeps, answer({TEAR: 0.9})), case(key(TEAR, number=2), answer({GAIN: 0.9}))]
    plant = score_card(cases)["plants"]["P1"]
    assert list(plant) == ["all", "emg_reference", "who keeps", "who yields"]
    assert plant["who keeps"]["family_top1"]["value"] == 1.0
    assert plant["who yields"]["family_top1"]["value"] == 0.0


def test_calibration_of_answers_that_are_right_as_often_as_they_say() -> None:
    right = [case(key(TEAR), answer({TEAR: 0.8})) for _ in range(4)]
    wrong = [case(key(TEAR), answer({GAIN: 0.8}))]
    found = group_scores(right + wrong)["calibration"]
    assert found["n"] == 5
    overall = np.average(
        [b["right"] for b in found["bins"]], weights=[b["n"] for b in found["bins"]]
    )
    assert overall == pytest.approx(0.8)
    sure = [case(key(TEAR), answer({TEAR: 1.0})) for _ in range(5)]
    assert group_scores(sure)["calibration"]["ece"] == 0.0


def test_calibration_error_by_chance_is_that_of_binomial_counts() -> None:
    counts = np.arange(7)
    of_bin = np.abs(counts / 6 - 0.6)
    exact = float(np.sum(binom.pmf(counts, 6, 0.6) * of_bin))
    found = calibration_error_by_chance([0.6] * 18, bins=3)
    assert found["mean"] == pytest.approx(exact, abs=0.01)
    assert exact < found["p95"] < of_bin.max()
    certain = calibration_error_by_chance([0.0, 0.0, 1.0, 1.0], bins=2)
    assert certain == {"mean": 0.0, "p95": 0.0}


def test_oracle_is_the_injected_effect_whatever_was_answered() -> None:
    other = {"label": GAIN, "p": 0.8, "parameters": []}
    right = {"label": TEAR, "p": 0.1, "parameters": []}
    wrong = case(key(TEAR), answer({TEAR: 0.9}, candidates=[other, right]))
    assert wrong.true_candidate == right
    assert not wrong.right_single
    assert case(key(TEAR), None).true_candidate is None
    found = group_scores([replace(wrong, oracle=REMOVED), replace(wrong, oracle=None)])["shrinkage"]
    assert found["oracle_on_hidden_task"]["median"] == pytest.approx(REMOVED.reducible, abs=1e-4)
    assert found["true_on_hidden_task"]["n"] == found["removed_without_noise"]["n"] == 0


def test_sizes_are_of_the_very_effect_and_not_of_all_members() -> None:
    one, every = "control/co_contraction/EL", "control/co_contraction/all"
    floors = [{"name": "tonic_floor", "value": value, "ci95": None} for value in (0.02, 0.1)]
    found = [
        {"label": label, "p": 0.4, "parameters": [floor]}
        for label, floor in zip((every, one), floors, strict=True)
    ]
    truth = key(one, amplitude=0.1)
    truth["effects"][0]["parameter"] = "tonic_floor"
    named = case(truth, answer({every: 0.4}, candidates=found))
    assert group_scores([named])["amplitude"]["relative_error"]["median"] == 0.0
    # Where no answer has the very member, all of them are the next.
    alone = case(truth, answer({every: 0.4}, candidates=found[:1]))
    assert alone.true_candidate["label"] == every


def test_a_gap_that_no_recording_would_show_has_no_reducible_share() -> None:
    assert HiddenGap(0.1, 0.05).reducible is None
    assert HiddenGap(0.1, 0.05).removed == pytest.approx(0.5)
    found = group_scores(
        [replace(case(key(TEAR), answer({TEAR: 0.9})), hidden=HiddenGap(0.1, 0.05))]
    )
    assert found["shrinkage"]["error"]["n"] == 0
    assert found["shrinkage"]["removed_without_noise"]["median"] == pytest.approx(0.5)


def test_singles_are_asked_for_what_they_remove_of_the_hidden_task() -> None:
    asked = []

    def removed(one: ScoredCase, candidate: dict) -> HiddenGap:
        asked.append(candidate["label"])
        return REMOVED

    right = _with_hidden(case(key(TEAR), answer({TEAR: 0.9})), removed)
    assert (right.hidden, right.oracle, asked) == (REMOVED, REMOVED, [TEAR])
    wrong = _with_hidden(case(key(TEAR), answer({GAIN: 0.8, TEAR: 0.1})), removed)
    assert (wrong.hidden, wrong.oracle) == (None, REMOVED)
    family_only = answer({f"{TEAR} + {GAIN}": 0.4, TEAR: 0.3, GAIN: 0.2}, present=False)
    assert _with_hidden(case(key(TEAR), family_only), removed).hidden is None
    asked.clear()
    for other in (case(key(None), answer({GAIN: 0.5})), case(key(TEAR), None)):
        assert _with_hidden(other, removed) is other
    assert asked == []
