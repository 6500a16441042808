"""One answered case beside its key: what was right, what was covered."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from scapulohumeral.gap.benchmark.metrics import family_probabilities, probabilities
from scapulohumeral.gap.benchmark.rules_of_thumb import baseline_families
from scapulohumeral.gap.explained import reducible_share
from scapulohumeral.gap.labels import NO_GAP, NONE, family, matches

LARGE_MULTIPLE = 2.0


UNANSWERED = "unanswered"


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
    def verdict_or_abstained(self) -> Mapping[str, Any] | None:
        """The answer, unless a solve failed: one that abstains has probabilities as well."""
        answered = self.answer is not None and self.answer["status"] != "failed"
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


def _none_p(case: ScoredCase) -> float:
    """Probability of none of these; an answer that abstains rejects what it was shown."""
    if case.verdict is None:
        return 1.0
    return float(case.verdict["none_p"])


def _off(parameter: str) -> float:
    """Value at which an effect is absent."""
    return 1.0 if parameter.endswith("_factor") else 0.0


def _amplitude(case: ScoredCase, name: str | None) -> Mapping[str, Any] | None:
    candidate = case.true_candidate
    parameters = () if candidate is None or name is None else candidate["parameters"]
    return next((p for p in parameters if p["name"] == name), None)


def _claimed(case: ScoredCase, split: str) -> float | None:
    """Share of the gap that the answer says to remove."""
    shrinkage = None if case.verdict is None else case.verdict["shrinkage"]
    if shrinkage is None or shrinkage.get(split) is None:
        return None
    return float(shrinkage[split]["value"])


def _reducible(gap: HiddenGap | None) -> float | None:
    return None if gap is None else gap.reducible
