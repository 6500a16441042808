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
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE, family, matches, matches_any
from scapulohumeral.gap.left_over import said_to_be_left

LARGE_MULTIPLE = 2.0
# What the model has wrong is wrong of the reference trials as well.
OF_THE_MODEL = ("body/thorax_surface",)
UNANSWERED = "unanswered"
# Who was simulated before keys said so.
YIELDS = "yields"


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
    def moved(self) -> bool:
        """Whether the test movement was done otherwise than the reference by as much as shows."""
        otherwise = self.key.get("otherwise")  # keys of earlier draws do not say
        return bool(self._referenced and otherwise is not None and otherwise["shown"])

    @property
    def _referenced(self) -> bool:
        return bool(self.key["mode"]["reference"])

    def _outside(self, label: str) -> bool:
        """Whether no label of an answer is right: earlier draws gave bodies another thorax."""
        return label.startswith("unknown/") or (self._referenced and label in OF_THE_MODEL)

    @property
    def status(self) -> str:
        """null, hidden (does not show), moved (the movement alone), single, pair or unknown."""
        if not self.truth or (self.truth == (MOVED,) and not self._referenced):
            return "null"
        if self.truth == (MOVED,):
            return "moved" if self.key["shown"] else "hidden"
        if not self.key["shown"]:
            return "moved" if self.moved else "hidden"
        if any(map(self._outside, self.truth)):
            return "unknown"
        return "single" if len(self.truth) == 1 else "pair"

    @property
    def right(self) -> tuple[str, ...]:
        """Labels that each are a right answer: the cause, another movement that shows, or both."""
        movement = (MOVED,) if self.moved or self.status == "moved" else ()
        if self.status in ("null", "hidden"):
            return (NO_GAP, *self.truth)
        if self.status == "moved":
            return tuple(dict.fromkeys((*movement, *self.truth)))
        cause = (NONE,) if self.status == "unknown" else self.truth
        return (*cause, *movement)

    @property
    def cause(self) -> tuple[str, ...]:
        """The same, but without another movement beside a cause that shows.

        Who moves otherwise because something acts is asked what acts.
        """
        if self.status in ("null", "hidden", "moved"):
            return self.right
        return tuple(label for label in self.right if label != MOVED)

    @property
    def person(self) -> str:
        """How the person met the effect: yields, keeps or changes the movement."""
        return str(self.key.get("person", YIELDS))

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
        """Whether one effect was injected and its own family is the most probable."""
        return self.status == "single" and top_family(self) == family(self.truth[0])

    @property
    def large(self) -> bool:
        """Whether one effect was injected, several times the smallest that would be found."""
        if self.status != "single" or self.without_size:
            return False
        [effect] = self.key["effects"]
        if self.answer is None or self.answer["gap"] is None:
            return True
        names = {
            param["name"]
            for candidate in self.answer["candidates"]
            for param in candidate["parameters"]
            if candidate["label"] == effect["label"]
        }
        if effect["parameter"] not in names:
            return True
        listed = self.answer["gap"]["smallest_detectable"]
        shown = (effect["label"], effect["parameter"])
        smallest = [d["value"] for d in listed if (d["label"], d["parameter"]) == shown]
        size = size_of(effect["parameter"], effect["amplitude"])
        return any(
            size >= LARGE_MULTIPLE * size_of(effect["parameter"], value) for value in smallest
        )

    @property
    def without_size(self) -> bool:
        """Whether one effect was injected that plant and library measure in different terms."""
        return self.status == "single" and self.key["effects"][0]["parameter"] is None

    @property
    def true_candidate(self) -> Mapping[str, Any] | None:
        """The candidate of the injected effect; None without an answer or if it is none.

        Of several that name it, such as one of all members, the one with its very label.
        """
        candidates = () if self.verdict is None else self.verdict["candidates"]
        named = [c for c in candidates if matches(c["label"], self.truth[0])]
        return max(named, key=lambda c: c["label"] == self.truth[0], default=None)

    @cached_property
    def baselines(self) -> dict[str, str]:
        """Family that each simple method names; read once, a case belongs to several groups."""
        return baseline_families(self.folder, self.answer_folder)

    @property
    def says_more(self) -> bool:
        """Whether the answer says that its first cause leaves something."""
        return self.verdict is not None and said_to_be_left(self.verdict["warnings"]) is not None

    @property
    def claims_gap(self) -> bool:
        """Whether the answer says that there is a gap, be its cause named or not."""
        answer = self.verdict_or_abstained
        return answer is not None and bool(answer["gap"]["present"])


def rank_of_right(case: ScoredCase) -> int:
    """Place of the first right family, beyond all places if none is there."""
    if case.verdict is None:
        return 10**6
    order = list(family_probabilities(case.verdict))
    places = [order.index(name) + 1 for name in _right_families(case) if name in order]
    return min(places, default=10**6)


def _right_families(case: ScoredCase) -> tuple[str, ...]:
    return tuple(dict.fromkeys(family(label) for label in case.right))


def right_family_p(case: ScoredCase) -> float:
    """Probability of all right families."""
    if case.verdict is None:
        return 0.0
    p = family_probabilities(case.verdict)
    return sum(p.get(name, 0.0) for name in _right_families(case))


def is_side_right(case: ScoredCase) -> bool:
    """Whether body, control, input or measurement is right."""
    return top_family(case).split("/")[0] in {label.split("/")[0] for label in case.right}


def first_family(case: ScoredCase) -> tuple[str, float | None]:
    """The most probable family with its probability; None without a verdict."""
    if case.verdict is None:
        return UNANSWERED, None
    return next(iter(family_probabilities(case.verdict).items()))


def top_family(case: ScoredCase) -> str:
    """The most probable family."""
    return first_family(case)[0]


def is_class_right(case: ScoredCase) -> bool:
    """Whether the most probable class, or candidate without one, holds a right family."""
    if case.verdict is None:
        return False
    groups = {tuple(c["labels"]): float(c["p"]) for c in case.verdict["classes"]}
    grouped = {label for labels in groups for label in labels}
    groups |= {(k,): p for k, p in probabilities(case.verdict).items() if k not in grouped}
    top = max(groups, key=lambda labels: groups[labels])
    return any(family(label) in _right_families(case) for label in top)


def is_covered(case: ScoredCase) -> bool | None:
    """Whether the 90 % set holds the truth; None for pairs, which have a score of their own."""
    if case.status == "pair" or case.answer is None or case.answer["status"] == "failed":
        return None
    chosen = case.answer["set90"]
    return any(matches_any(label, case.right) for label in chosen)


def none_p(case: ScoredCase) -> float:
    """Probability of none of these; an answer that abstains rejects what it was shown."""
    if case.verdict is None:
        return 1.0
    return float(case.verdict["none_p"])


def absent_value(parameter: str) -> float:
    """Value at which an effect is absent."""
    return 1.0 if parameter.endswith("_factor") else 0.0


def size_of(parameter: str, value: float) -> float:
    """Distance from an absent effect on the scale that is fitted: logarithms of factors.

    The smallest that would be found is published to one side of it, and holds for both.
    """
    off = absent_value(parameter)
    return abs(math.log(value / off) if parameter.endswith("_factor") else value - off)


def found_amplitude(case: ScoredCase, name: str | None) -> Mapping[str, Any] | None:
    """What the answer says of a parameter of the injected effect; None if nothing."""
    candidate = case.true_candidate
    parameters = () if candidate is None or name is None else candidate["parameters"]
    return next((p for p in parameters if p["name"] == name), None)


def claimed_share(case: ScoredCase, split: str) -> float | None:
    """Share of the gap that the answer says to remove."""
    shrinkage = None if case.verdict is None else case.verdict["shrinkage"]
    if shrinkage is None or shrinkage.get(split) is None:
        return None
    return float(shrinkage[split]["value"])


def hidden_share(gap: HiddenGap | None) -> float | None:
    """Share of the reducible gap on the hidden task that a cause removes; None if unknown."""
    return None if gap is None else gap.reducible
