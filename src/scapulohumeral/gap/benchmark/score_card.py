"""Score card of the blind benchmark: answers against keys, with intervals.

A case with effects that hardly show (key `shown` false) counts for abstention and coverage only.
Where the person also did the movement otherwise, by as much as shows, another movement is a right
answer as well: the two differ in that, whatever else is wrong.
An answer that is missing, failed or abstained is wrong wherever a cause was asked for.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from scapulohumeral.gap.benchmark.metrics import (
    area_under_curve,
    calibration_error,
    calibration_error_by_chance,
    mean,
    rate,
    reliability,
    spread,
)
from scapulohumeral.gap.benchmark.noise_free.key_change import change_over_movement
from scapulohumeral.gap.benchmark.rules_of_thumb import control_shares
from scapulohumeral.gap.benchmark.scored_case import (
    LARGE_MULTIPLE,
    ScoredCase,
    absent_value,
    claimed_share,
    first_family,
    found_amplitude,
    hidden_share,
    is_class_right,
    is_covered,
    is_side_right,
    none_p,
    rank_of_right,
    right_family_p,
    top_family,
)
from scapulohumeral.gap.labels import JOIN, MOVED, NO_GAP, family, matches

CALIBRATION_BINS = 5

FALSE_REJECTION = 0.1
# Answers with a larger probability may be wrong in one case out of ten.
SURE = 0.8

KEPT_SHARE = 0.7

REGION_SIGMA = 2.0

STATUSES = ("null", "single", "pair", "unknown", "moved")

# Fixed before keys are drawn, and published with their hashes.
REGISTERED = {
    "shown": "an effect counts if its noise-free change is at least footprint_multiple standard "
    "errors (root mean square over the movement) in one channel of a visible task; without "
    "reference trials the error of a model counts too (4 deg, 0.08 of maximal EMG)",
    "large": "a single effect at least large_multiple times the smallest detectable amplitude that "
    "the answer publishes for its parameter, both as distance from off, of factors as logarithm; "
    "one that is not listed is smaller; one whose parameter the answer does not know, or without "
    "answer, counts as large",
    "without_size": "single effects that plant and library measure in different terms: whatever "
    "their size, they are not large, and have scores of their own",
    "moved": "where the test movement was done otherwise by as much as an effect has to show, "
    "control/movement_strategy is a right answer too, beside the injected effect; where nothing "
    "else shows it is the right one, and the case counts as moved, not as a single",
    "claims_gap": "false alarms, detection and abstention of hidden cases count every answer that "
    "finds a gap, be a cause named or not",
    "family_top1": "family with the largest summed probability, among none and no_gap",
    "effect_top1": "the same, but only the injected effect is right",
    "class_top1": "the most probable class, or candidate without one, holds the right family",
    "set90": "holds the right label (member may be left out), no_gap for nulls, none for unknowns; "
    "an effect that hardly shows is also covered by no_gap; of all cases but pairs, and of single "
    "effects and all others apart",
    "both_or_one_and_more": "pairs whose first answer is both families, or one of them with the "
    "remark that something is left",
    "says_more": "singles whose family is right and that have this remark",
    "amplitude": "abs(answer - truth) / abs(truth - off), candidate with the right label; _named: "
    "where the injected effect is the most probable family",
    "shrinkage": "new_task of singles whose family is right, against the share of the reducible "
    "gap on the hidden task that the same parameters and factors remove: noise-free root mean "
    "squares, the floor added to both in quadrature, as a recording would have it, then subtracted",
    "sure_and_wrong": "answers whose first family has more than `sure` and is no right one; of a "
    "pair one member is right",
    "cause_calibration": "calibration of the first family as the cause, which probabilities are "
    "fitted to: another movement beside one that shows is not right",
    "calibration_bins": CALIBRATION_BINS,
    "rejected": "answers to unknown causes whose none_p is larger than that of all singles with a "
    "verdict but false_rejection of them (a value that one of them has), and answers without "
    "verdict; how many singles are without verdict stands beside",
    "false_rejection": FALSE_REJECTION,
    "sure": SURE,
    "kept_share": KEPT_SHARE,
    "large_multiple": LARGE_MULTIPLE,
    "regions": "channels and phases of the movement at which the change of the key is at least "
    "region_sigma standard errors; a key holds recordings with rest before and after, of which the "
    "movement of the test trial without noise is taken",
    "region_sigma": REGION_SIGMA,
}


def score_card(cases: Sequence[ScoredCase]) -> dict[str, Any]:
    """Scores by plant, mode and person; "all" for all cases together."""
    plants: dict[str, Any] = {}
    for plant in sorted({case.key["plant"] for case in cases}):
        own = [case for case in cases if case.key["plant"] == plant]
        modes = sorted({case.mode for case in own})
        persons = sorted({case.person for case in own})
        groups = {"all": own}
        groups |= {mode: [c for c in own if c.mode == mode] for mode in modes}
        groups |= {f"who {p}": [c for c in own if c.person == p] for p in persons}
        # One for all groups: whether a case is rejected does not depend on the column it stands in.
        limit = rejection_threshold(own)
        plants[plant] = {name: group_scores(group, limit) for name, group in groups.items()}
    return {"rules": REGISTERED, "plants": plants, "cases": [_line(case) for case in cases]}


def rejection_threshold(cases: Sequence[ScoredCase]) -> float:
    """Probability of "none" above which a cause counts as unknown: few single effects have it.

    Singles without a verdict have none, and are counted on their own: with them nothing could be
    above where more than a few abstain. Between two singles nothing is made up.
    """
    answered = [case for case in cases if case.status == "single" and case.verdict is not None]
    known = [none_p(case) for case in answered]
    return float(np.quantile(known, 1.0 - FALSE_REJECTION, method="higher")) if known else 1.0


def group_scores(cases: Sequence[ScoredCase], threshold: float | None = None) -> dict[str, Any]:
    """All metrics of a group of cases.

    `threshold` is that of :func:`rejection_threshold` of all cases; None where these are all.
    """
    if threshold is None:
        threshold = rejection_threshold(cases)
    by = {s: [c for c in cases if c.status == s] for s in STATUSES}
    single = by["single"]
    return {
        "cases": dict(Counter(case.status for case in cases)),
        "false_alarms": rate([case.claims_gap for case in by["null"]]),
        **_single_scores(single),
        "mean_family_p": mean([right_family_p(case) for case in single]),
        "set90": _set_scores(cases),
        "calibration": _calibration(cases, lambda case: case.right),
        "cause_calibration": _calibration(cases, lambda case: case.cause),
        "sure_and_wrong": rate(_sure_and_wrong(cases)),
        "unknown": _unknown_scores(by["unknown"], single, threshold),
        "pairs": _pair_scores(by["pair"]),
        "moved": _moved_scores(by["moved"]),
        "abstention": rate([case.verdict is None for case in cases]),
        "abstention_hidden": rate(
            [not case.claims_gap for case in cases if case.status == "hidden"]
        ),
        "regions": _region_scores(single),
        "seconds": spread([case.seconds for case in cases]),
        "confusion": _confusion(cases),
        "large": _single_scores([case for case in single if case.large]),
        "without_size": _single_scores([case for case in single if case.without_size]),
    }


def _single_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    """Whether gaps are seen, their causes named and sized, beside what simple methods say."""
    return {
        "detection": rate([case.claims_gap for case in single]),
        "family_top1": rate([rank_of_right(case) == 1 for case in single]),
        "effect_top1": rate([case.right_single for case in single]),
        "family_top3": rate([rank_of_right(case) <= 3 for case in single]),
        "side_top1": rate([is_side_right(case) for case in single]),
        "class_top1": rate([is_class_right(case) for case in single]),
        "says_more": rate([case.says_more for case in single if case.right_single]),
        "amplitude": _amplitude_scores(single),
        "shrinkage": _shrinkage_scores(single),
        "baselines": _baseline_scores(single),
    }


def _set_scores(cases: Sequence[ScoredCase]) -> dict[str, Any]:
    covered = [(is_covered(case), case) for case in cases]
    counted = [(hit, case) for hit, case in covered if hit is not None]
    sizes = [len(case.answer["set90"]) for _, case in counted if case.answer is not None]
    single, other = (
        [hit for hit, case in counted if (case.status == "single") is asked]
        for asked in (True, False)
    )
    return {
        "coverage": rate([hit for hit, _ in counted]),
        # No effect, and what hardly shows or is unknown, is held nearly by how sets are made.
        "coverage_by_kind": {"single effects": rate(single), "others": rate(other)},
        "mean_size": mean(sizes),
    }


def _calibration(
    cases: Sequence[ScoredCase], right: Callable[[ScoredCase], Sequence[str]]
) -> dict[str, Any]:
    """Expected calibration error of the most probable family, in bins of equal count."""
    pairs = []
    for case in cases:
        name, p = first_family(case)
        if p is not None and case.status not in ("pair", "hidden"):
            pairs.append((p, name in map(family, right(case))))
    if not pairs:
        return {"ece": None, "by_chance": None, "n": 0, "bins": []}
    bins = reliability(pairs, CALIBRATION_BINS)
    return {
        "ece": calibration_error(bins),
        "by_chance": calibration_error_by_chance([p for p, _ in pairs], CALIBRATION_BINS),
        "n": len(pairs),
        "bins": bins,
    }


def _sure_and_wrong(cases: Sequence[ScoredCase]) -> list[bool]:
    """Whether each answer that is nearly certain of its first family is wrong."""
    found = []
    for case in cases:
        name, p = first_family(case)
        if p is not None and p > SURE:
            parts = set(map(family, name.split(JOIN)))
            found.append(not parts <= set(map(family, case.right)))
    return found


def _unknown_scores(
    unknown: Sequence[ScoredCase], known: Sequence[ScoredCase], threshold: float
) -> dict[str, Any]:
    high = [none_p(case) for case in unknown]
    low = [none_p(case) for case in known]
    distance = {
        name: rate([_is_rejected(c, threshold) for c in unknown if f"/{name}/" in c.truth[0]])
        for name in ("far", "near")
    }
    return {
        "auroc": area_under_curve(high, low),
        "rejected": distance,
        "singles_without_verdict": rate([case.verdict is None for case in known]),
    }


def _is_rejected(case: ScoredCase, threshold: float) -> bool:
    """Whether an answer says that the cause is none that it knows, or names none."""
    return case.verdict is None or none_p(case) > threshold


def _moved_scores(moved: Sequence[ScoredCase]) -> dict[str, Any]:
    """Whether another movement is seen, named, and at least in the 90 % set."""
    return {
        "detection": rate([case.claims_gap for case in moved]),
        "named": rate([rank_of_right(case) == 1 for case in moved]),
        "in_set": rate([bool(is_covered(case)) for case in moved]),
    }


def _pair_scores(pairs: Sequence[ScoredCase]) -> dict[str, Any]:
    both, exact, more = [], [], []
    for case in pairs:
        chosen = [] if case.verdict is None else list(case.verdict["set90"])
        parts = [part for label in chosen for part in label.split(JOIN)]
        both.append(all(any(matches(p, t) for p in parts) for t in case.truth))
        top = top_family(case).split(JOIN)
        exact.append(sorted(map(family, top)) == sorted(map(family, case.truth)))
        one = any(name in map(family, case.truth) for name in map(family, top))
        more.append(exact[-1] or (one and case.says_more))
    return {"both_in_set": rate(both), "exact": rate(exact), "both_or_one_and_more": rate(more)}


def _amplitude_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    errors, named, covered = [], [], []
    for case in single:
        [effect] = case.key["effects"]
        found = found_amplitude(case, effect["parameter"])
        if found is None:
            continue
        truth = float(effect["amplitude"])
        error = abs(found["value"] - truth) / abs(truth - absent_value(effect["parameter"]))
        errors.append(error)
        if case.right_single:
            named.append(error)
        if found["ci95"] is not None:
            covered.append(found["ci95"][0] <= truth <= found["ci95"][1])
    return {
        "relative_error": spread(errors),
        "relative_error_named": spread(named),
        "ci_coverage": rate(covered),
    }


def _shrinkage_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    right = [case for case in single if case.right_single]
    controls = [control_shares(case.answer_folder) for case in right]
    claimed = {id(case): claimed_share(case, "new_task") for case in right}
    values = [value for value in claimed.values() if value is not None]
    errors, covered = [], []
    for case in right:
        value = claimed[id(case)]
        truth = hidden_share(case.hidden)
        if truth is None or value is None or case.verdict is None:
            continue
        errors.append(abs(value - truth))
        interval = case.verdict["shrinkage"]["new_task"]["ci95"]
        if interval is not None:
            covered.append(interval[0] <= truth <= interval[1])
    return {
        "new_task": spread(values),
        "keeps": rate([value >= KEPT_SHARE for value in values]),
        "true_on_hidden_task": spread([hidden_share(case.hidden) for case in right]),
        # What the injected effect would remove, whatever was answered.
        "oracle_on_hidden_task": spread([hidden_share(case.oracle) for case in single]),
        # Of the gap itself, without a floor.
        "removed_without_noise": spread([case.hidden.removed for case in right if case.hidden]),
        "held_out_trial": spread([claimed_share(case, "held_out_trial") for case in right]),
        "black_box_on_held_out_trial": spread([box for box, _ in controls]),
        "best_placebo_on_held_out_trial": spread([placebo for _, placebo in controls]),
        "error": spread(errors),
        "ci_coverage": rate(covered),
    }


def _region_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    """F1 of channel x phase points of the first map, and whether its largest share is right."""
    scores, largest = [], []
    for case in single:
        if case.verdict is None:
            continue
        shows, footprint = case.verdict["regions"]["shows"], case.key["footprint"]
        scores.append(_region_f1(case.key, shows))
        if shows:
            top = max(shows, key=lambda region: region["share"])["channel"]
            largest.append(top == max(footprint, key=lambda name: footprint[name]))
    return {"f1": spread(scores), "largest_channel": rate(largest)}


def _region_f1(key: Mapping[str, Any], shows: Sequence[Mapping[str, Any]]) -> float | None:
    """F1 of the points of regions; None for keys that do not tell phases by curves."""
    change = change_over_movement(key)
    if change is None:
        return None
    channels = list(key["channels"])
    truth, found = change >= REGION_SIGMA, np.zeros(change.shape, dtype=bool)
    for region in shows:
        start, end = region["phase_percent"]
        if region["channel"] in channels:
            found[round(start) : round(end) + 1, channels.index(region["channel"])] = True
    both, either = np.sum(truth & found), np.sum(truth) + np.sum(found)
    return float(2 * both / either) if either else 1.0


def _confusion(cases: Sequence[ScoredCase]) -> dict[str, dict[str, int]]:
    """Answered families by true family; pairs by their joined families."""
    table: dict[str, Counter[str]] = {}
    for case in cases:
        names = {"null": NO_GAP, "hidden": "hardly shows", "moved": MOVED}
        truth = names.get(case.status) or JOIN.join(family(label) for label in case.truth)
        table.setdefault(truth, Counter())[top_family(case)] += 1
    return {truth: dict(row) for truth, row in sorted(table.items())}


def _baseline_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    """Family top-1 of simple methods on the same cases."""
    hits: dict[str, list[bool]] = {}
    for case in single:
        for method, name in case.baselines.items():
            hits.setdefault(method, []).append(name == family(case.truth[0]))
    return {method: rate(values) for method, values in sorted(hits.items())}


def _line(case: ScoredCase) -> dict[str, Any]:
    """One case for the table of all cases."""
    return {
        "case": case.key["case"],
        "plant": case.key["plant"],
        "mode": case.mode,
        "status": case.status,
        "person": case.person,
        "truth": JOIN.join(case.truth) or NO_GAP,
        "moved": case.moved,
        "answer": top_family(case),
        "p": first_family(case)[1],
        "footprint": max(case.key["footprint"].values()),
        "large": case.large,
        "covered": is_covered(case),
    }  # fmt: skip
