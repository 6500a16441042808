"""Score card of the blind benchmark: answers against keys, with intervals.

A case with effects that hardly show (key `shown` false) counts for abstention and coverage only.
An answer that is missing, failed or abstained is wrong wherever a cause was asked for.

Rates carry Wilson 95 % intervals. Labels are ``side/family[/member]``, pairs joined by " + ".
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.gap.blind_baselines import baseline_families, control_shares
from scapulohumeral.gap.result import JOIN, NO_GAP, NONE
from scapulohumeral.gap.shrinkage import reducible_share

Z95 = 1.959964
CALIBRATION_BINS = 5
FALSE_REJECTION = 0.1
KEPT_SHARE = 0.7
LARGE_MULTIPLE = 2.0
REGION_SIGMA = 2.0
UNANSWERED = "unanswered"
# Fixed before keys are drawn, and published with their hashes.
REGISTERED = {
    "shown": "an effect counts if its noise-free change is at least footprint_multiple standard "
    "errors (root mean square over the movement) in one channel of a visible task; without "
    "reference trials the error of a model counts too (4 deg, 0.08 of maximal EMG)",
    "large": "a single effect at least large_multiple times the smallest detectable amplitude that "
    "the answer publishes for its label, both as distance from off; one whose label is not listed "
    "is smaller; one that has no such amplitude, or no answer, counts as large if it shows",
    "family_top1": "family with the largest summed probability, among none and no_gap",
    "class_top1": "the most probable class, or candidate without one, holds the right family",
    "set90": "holds the right label (member may be left out), no_gap for nulls, none for unknowns; "
    "an effect that hardly shows is also covered by no_gap",
    "amplitude": "abs(answer - truth) / abs(truth - off), candidate with the right label",
    "shrinkage": "new_task of singles whose family is right, against the share of the reducible "
    "gap on the hidden task that the same parameters and factors remove: noise-free root mean "
    "squares, the floor added to both in quadrature, as a recording would have it, then subtracted",
    "calibration_bins": CALIBRATION_BINS,
    "false_rejection": FALSE_REJECTION,
    "kept_share": KEPT_SHARE,
    "large_multiple": LARGE_MULTIPLE,
    "region_sigma": REGION_SIGMA,
}


@dataclass(frozen=True)
class HiddenGap:
    """Gap on the hidden task before and after an answer, free of noise.

    Root mean squares in units of what two recordings of one person differ by without a cause.
    """

    before: float
    after: float

    @property
    def removed(self) -> float:
        """Share of the gap itself that is removed."""
        return 1.0 - self.after / self.before

    @property
    def reducible(self) -> float | None:
        """Share of what a recording would show above the floor, as diagnoses claim it."""
        return reducible_share(math.hypot(self.before, 1.0), math.hypot(self.after, 1.0))


@dataclass(frozen=True, eq=False)
class ScoredCase:
    """A case with opened key.

    Attributes
    ----------
    folder : trials; answer_folder : what the diagnosis wrote
    key : truth; answer : ``result.json``, None if there is none
    seconds : time of the diagnosis
    hidden : gap on the hidden task with the answer, if known
    oracle : the same with the injected effect and the parameters that the diagnosis fitted
    """

    folder: Path
    answer_folder: Path
    key: Mapping[str, Any]
    answer: Mapping[str, Any] | None
    seconds: float
    hidden: HiddenGap | None = None
    oracle: HiddenGap | None = None

    @property
    def truth(self) -> tuple[str, ...]:
        """Labels of the injected effects."""
        return tuple(effect["label"] for effect in self.key["effects"])

    @property
    def status(self) -> str:
        """null, hidden (does not show), single, pair or unknown."""
        if not self.truth:
            return "null"
        if not self.key["shown"]:
            return "hidden"
        if any(label.startswith("unknown/") for label in self.truth):
            return "unknown"
        return "single" if len(self.truth) == 1 else "pair"

    @property
    def mode(self) -> str:
        """What the case contains."""
        mode = self.key["mode"]
        parts = ["emg" if mode["emg"] else "motion"]
        if mode.get("contact"):  # keys of earlier draws do not say
            parts.append("force")
        return "_".join([*parts, "reference" if mode["reference"] else "no_reference"])

    @property
    def verdict(self) -> Mapping[str, Any] | None:
        """The answer, if it is one."""
        answered = self.answer is not None and self.answer["status"] == "ok"
        return self.answer if answered else None

    @property
    def right_single(self) -> bool:
        """Whether one effect was injected and its family is the most probable."""
        return self.status == "single" and _rank(self) == 1

    @property
    def large(self) -> bool:
        """Whether one effect was injected, several times the smallest that would be found."""
        if self.status != "single":
            return False
        [effect] = self.key["effects"]
        if self.answer is None or self.answer["gap"] is None or effect["parameter"] is None:
            return True
        off, listed = _off(effect["parameter"]), self.answer["gap"]["smallest_detectable"]
        smallest = {d["parameter"]: d["value"] for d in listed if d["label"] == effect["label"]}
        if effect["parameter"] not in smallest:
            return bool(smallest)
        least = abs(smallest[effect["parameter"]] - off)
        return abs(effect["amplitude"] - off) >= LARGE_MULTIPLE * least

    @property
    def true_candidate(self) -> Mapping[str, Any] | None:
        """The candidate of the injected effect; None without an answer or if it is none."""
        candidates = () if self.verdict is None else self.verdict["candidates"]
        return next((c for c in candidates if matches(c["label"], self.truth[0])), None)

    @cached_property
    def baselines(self) -> dict[str, str]:
        """Family that each simple method names; read once, a case belongs to several groups."""
        return baseline_families(self.folder, self.answer_folder)

    @property
    def claims_gap(self) -> bool:
        """Whether the answer says that there is a gap."""
        return self.verdict is not None and bool(self.verdict["gap"]["present"])


def score_card(cases: Sequence[ScoredCase]) -> dict[str, Any]:
    """Scores by plant and mode; "all" for all modes together."""
    plants: dict[str, Any] = {}
    for plant in sorted({case.key["plant"] for case in cases}):
        own = [case for case in cases if case.key["plant"] == plant]
        modes = sorted({case.mode for case in own})
        plants[plant] = {
            "all": group_scores(own),
            **{mode: group_scores([c for c in own if c.mode == mode]) for mode in modes},
        }
    return {"rules": REGISTERED, "plants": plants, "cases": [_line(case) for case in cases]}


def group_scores(cases: Sequence[ScoredCase]) -> dict[str, Any]:
    """All metrics of a group of cases."""
    by = {s: [c for c in cases if c.status == s] for s in ("null", "single", "pair", "unknown")}
    single = by["single"]
    return {
        "cases": dict(Counter(case.status for case in cases)),
        "false_alarms": rate([case.claims_gap for case in by["null"]]),
        **_single_scores(single),
        "mean_family_p": _mean([_family_p(case) for case in single]),
        "set90": _set_scores(cases),
        "calibration": _calibration(cases),
        "unknown": _unknown_scores(by["unknown"], single),
        "pairs": _pair_scores(by["pair"]),
        "abstention": rate([case.verdict is None for case in cases]),
        "abstention_hidden": rate(
            [not case.claims_gap for case in cases if case.status == "hidden"]
        ),
        "regions": _region_scores(single),
        "seconds": _spread([case.seconds for case in cases]),
        "confusion": _confusion(cases),
        "large": _single_scores([case for case in single if case.large]),
    }


def _single_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    """Whether gaps are seen, their causes named and sized, beside what simple methods say."""
    return {
        "detection": rate([case.claims_gap for case in single]),
        "family_top1": rate([_rank(case) == 1 for case in single]),
        "family_top3": rate([_rank(case) <= 3 for case in single]),
        "side_top1": rate([_side_right(case) for case in single]),
        "class_top1": rate([_class_right(case) for case in single]),
        "amplitude": _amplitude_scores(single),
        "shrinkage": _shrinkage_scores(single),
        "baselines": _baseline_scores(single),
    }


def rate(hits: Sequence[bool]) -> dict[str, Any]:
    """Share of hits with Wilson 95 % interval; None without cases."""
    n, k = len(hits), sum(bool(hit) for hit in hits)
    if n == 0:
        return {"value": None, "hits": 0, "n": 0, "wilson95": None}
    centre = (k + Z95**2 / 2) / (n + Z95**2)
    half = Z95 * math.sqrt(k * (n - k) / n + Z95**2 / 4) / (n + Z95**2)
    low, high = max(centre - half, 0.0), min(centre + half, 1.0)
    return {"value": k / n, "hits": k, "n": n, "wilson95": [round(low, 4), round(high, 4)]}


def family(label: str) -> str:
    """``side/family`` of a label; pairs, none and no_gap stay as they are."""
    return label if JOIN in label else "/".join(label.split("/")[:2])


def matches(label: str, truth: str) -> bool:
    """Whether a label names the truth; a member that is left out, or all, is no contradiction."""
    if family(label) != family(truth):
        return False
    members = [name.split("/")[2] for name in (label, truth) if name.count("/") >= 2]
    return len(members) < 2 or members[0] == members[1] or "all" in members


def probabilities(answer: Mapping[str, Any]) -> dict[str, float]:
    """Probability of each label, none and no_gap included."""
    found = {c["label"]: float(c["p"]) for c in answer["candidates"]}
    return {**found, NONE: float(answer["none_p"]), NO_GAP: float(answer["no_gap_p"])}


def family_probabilities(answer: Mapping[str, Any]) -> dict[str, float]:
    """The same summed over members, largest first."""
    total: dict[str, float] = {}
    for label, p in probabilities(answer).items():
        total[family(label)] = total.get(family(label), 0.0) + p
    return dict(sorted(total.items(), key=lambda item: -item[1]))


def area_under_curve(high: Sequence[float], low: Sequence[float]) -> float | None:
    """Probability that a member of `high` exceeds one of `low` (ties count half)."""
    if not high or not low:
        return None
    gap = np.subtract.outer(np.array(high), np.array(low))
    return float(np.mean((gap > 0) + 0.5 * (gap == 0)))


def _rank(case: ScoredCase) -> int:
    """Place of the right family, beyond all places if it is missing."""
    if case.verdict is None:
        return 10**6
    order = list(family_probabilities(case.verdict))
    right = family(case.truth[0])
    return order.index(right) + 1 if right in order else 10**6


def _family_p(case: ScoredCase) -> float:
    return (
        0.0
        if case.verdict is None
        else family_probabilities(case.verdict).get(family(case.truth[0]), 0.0)
    )


def _side_right(case: ScoredCase) -> bool:
    return _top_family(case).split("/")[0] == case.truth[0].split("/")[0]


def _top_family(case: ScoredCase) -> str:
    return UNANSWERED if case.verdict is None else next(iter(family_probabilities(case.verdict)))


def _class_right(case: ScoredCase) -> bool:
    if case.verdict is None:
        return False
    groups = {tuple(c["labels"]): float(c["p"]) for c in case.verdict["classes"]}
    grouped = {label for labels in groups for label in labels}
    groups |= {(k,): p for k, p in probabilities(case.verdict).items() if k not in grouped}
    top = max(groups, key=lambda labels: groups[labels])
    return any(family(label) == family(case.truth[0]) for label in top)


def _covered(case: ScoredCase) -> bool | None:
    """Whether the 90 % set holds the truth; None for pairs, which have a score of their own."""
    if case.status == "pair" or case.answer is None or case.answer["status"] == "failed":
        return None
    chosen = case.answer["set90"]
    if case.status == "null":
        return NO_GAP in chosen
    if case.status == "unknown":
        return NONE in chosen
    named = any(matches(label, case.truth[0]) for label in chosen)
    return named or (case.status == "hidden" and NO_GAP in chosen)


def _set_scores(cases: Sequence[ScoredCase]) -> dict[str, Any]:
    covered = [(_covered(case), case) for case in cases]
    counted = [(hit, case) for hit, case in covered if hit is not None]
    sizes = [len(case.answer["set90"]) for _, case in counted if case.answer is not None]
    return {"coverage": rate([bool(hit) for hit, _ in counted]), "mean_size": _mean(sizes)}


def _calibration(cases: Sequence[ScoredCase]) -> dict[str, Any]:
    """Expected calibration error of the most probable family, in bins of equal count."""
    pairs = []
    for case in cases:
        if case.verdict is None or case.status in ("pair", "hidden"):
            continue
        name, p = next(iter(family_probabilities(case.verdict).items()))
        right = {"null": NO_GAP, "unknown": NONE}.get(case.status) or family(case.truth[0])
        pairs.append((p, name == right))
    if not pairs:
        return {"ece": None, "n": 0, "bins": []}
    parts = np.array_split(np.array(sorted(pairs), dtype=float), CALIBRATION_BINS)
    bins = [
        {"p": round(float(part[:, 0].mean()), 4), "right": round(float(part[:, 1].mean()), 4),
         "n": len(part)}
        for part in parts
        if len(part)
    ]  # fmt: skip
    error = sum(b["n"] * abs(b["p"] - b["right"]) for b in bins) / len(pairs)
    return {"ece": round(float(error), 4), "n": len(pairs), "bins": bins}


def _unknown_scores(unknown: Sequence[ScoredCase], known: Sequence[ScoredCase]) -> dict[str, Any]:
    high = [_none_p(case) for case in unknown]
    low = [_none_p(case) for case in known]
    threshold = float(np.quantile(low, 1.0 - FALSE_REJECTION)) if low else 1.0
    distance = {
        name: rate([_none_p(c) > threshold for c in unknown if f"/{name}/" in c.truth[0]])
        for name in ("far", "near")
    }
    return {"auroc": area_under_curve(high, low), "rejected": distance}


def _none_p(case: ScoredCase) -> float:
    """Probability of none of these; an answer that abstains rejects what it was shown."""
    if case.verdict is None:
        return 1.0
    return float(case.verdict["none_p"])


def _pair_scores(pairs: Sequence[ScoredCase]) -> dict[str, Any]:
    both, exact = [], []
    for case in pairs:
        chosen = [] if case.verdict is None else list(case.verdict["set90"])
        parts = [part for label in chosen for part in label.split(JOIN)]
        both.append(all(any(matches(p, t) for p in parts) for t in case.truth))
        top = _top_family(case).split(JOIN)
        exact.append(sorted(map(family, top)) == sorted(map(family, case.truth)))
    return {"both_in_set": rate(both), "exact": rate(exact)}


def _amplitude_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    errors, covered = [], []
    for case in single:
        [effect] = case.key["effects"]
        found = _amplitude(case, effect["parameter"])
        if found is None:
            continue
        truth = float(effect["amplitude"])
        errors.append(abs(found["value"] - truth) / abs(truth - _off(effect["parameter"])))
        if found["ci95"] is not None:
            covered.append(found["ci95"][0] <= truth <= found["ci95"][1])
    return {"relative_error": _spread(errors), "ci_coverage": rate(covered)}


def _off(parameter: str) -> float:
    """Value at which an effect is absent."""
    return 1.0 if parameter.endswith("_factor") else 0.0


def _amplitude(case: ScoredCase, name: str | None) -> Mapping[str, Any] | None:
    candidate = case.true_candidate
    parameters = () if candidate is None or name is None else candidate["parameters"]
    return next((p for p in parameters if p["name"] == name), None)


def _shrinkage_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    right = [case for case in single if case.right_single]
    controls = [control_shares(case.answer_folder) for case in right]
    claimed = {id(case): _claimed(case, "new_task") for case in right}
    values = [value for value in claimed.values() if value is not None]
    errors, covered = [], []
    for case in right:
        value = claimed[id(case)]
        truth = _reducible(case.hidden)
        if truth is None or value is None or case.verdict is None:
            continue
        errors.append(abs(value - truth))
        interval = case.verdict["shrinkage"]["new_task"]["ci95"]
        if interval is not None:
            covered.append(interval[0] <= truth <= interval[1])
    return {
        "new_task": _spread(values),
        "keeps": rate([value >= KEPT_SHARE for value in values]),
        "true_on_hidden_task": _spread([_reducible(case.hidden) for case in right]),
        # What the injected effect would remove, whatever was answered.
        "oracle_on_hidden_task": _spread([_reducible(case.oracle) for case in single]),
        # Of the gap itself, without a floor.
        "removed_without_noise": _spread([case.hidden.removed for case in right if case.hidden]),
        "held_out_trial": _spread([_claimed(case, "held_out_trial") for case in right]),
        "black_box_on_held_out_trial": _spread([box for box, _ in controls]),
        "best_placebo_on_held_out_trial": _spread([placebo for _, placebo in controls]),
        "error": _spread(errors),
        "ci_coverage": rate(covered),
    }


def _claimed(case: ScoredCase, split: str) -> float | None:
    """Share of the gap that the answer says to remove."""
    shrinkage = None if case.verdict is None else case.verdict["shrinkage"]
    if shrinkage is None or shrinkage.get(split) is None:
        return None
    return float(shrinkage[split]["value"])


def _reducible(gap: HiddenGap | None) -> float | None:
    return None if gap is None else gap.reducible


def _region_scores(single: Sequence[ScoredCase]) -> dict[str, Any]:
    """F1 of channel x phase points of the first map, and whether its largest share is right."""
    scores, largest = [], []
    for case in single:
        if case.verdict is None:
            continue
        channels = list(case.key["channels"])
        change = np.max([np.abs(np.array(t)) for t in case.key["change_sigma"].values()], axis=0)
        truth, found = change >= REGION_SIGMA, np.zeros(change.shape, dtype=bool)
        shows = case.verdict["regions"]["shows"]
        for region in shows:
            start, end = region["phase_percent"]
            if region["channel"] in channels:
                found[round(start) : round(end) + 1, channels.index(region["channel"])] = True
        both, either = np.sum(truth & found), np.sum(truth) + np.sum(found)
        scores.append(float(2 * both / either) if either else 1.0)
        if shows:
            top = max(shows, key=lambda region: region["share"])["channel"]
            footprint = case.key["footprint"]
            largest.append(top == max(footprint, key=lambda name: footprint[name]))
    return {"f1": _spread(scores), "largest_channel": rate(largest)}


def _confusion(cases: Sequence[ScoredCase]) -> dict[str, dict[str, int]]:
    """Answered families by true family; pairs by their joined families."""
    table: dict[str, Counter[str]] = {}
    for case in cases:
        names = {"null": NO_GAP, "hidden": "hardly shows"}
        truth = names.get(case.status) or JOIN.join(family(label) for label in case.truth)
        table.setdefault(truth, Counter())[_top_family(case)] += 1
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
        "truth": JOIN.join(case.truth) or NO_GAP,
        "answer": _top_family(case),
        "p": None if case.verdict is None else next(
            iter(family_probabilities(case.verdict).values())
        ),
        "footprint": max(case.key["footprint"].values()),
        "large": case.large,
        "covered": _covered(case),
    }  # fmt: skip


def _mean(values: Sequence[float]) -> float | None:
    return float(np.mean(values)) if len(values) else None


def _spread(values: Sequence[float | None]) -> dict[str, Any]:
    known = [value for value in values if value is not None]
    if not known:
        return {"median": None, "quartiles": None, "largest": None, "n": 0}
    low, mid, high = np.quantile(known, [0.25, 0.5, 0.75])
    return {
        "median": round(float(mid), 4),
        "quartiles": [round(float(low), 4), round(float(high), 4)],
        "largest": round(float(max(known)), 4),
        "n": len(known),
    }
