"""From evidence to probabilities, and the 90 % set.

Probabilities hold if the cause is in the library, and as far as their weights are calibrated.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.special import expit

from scapulohumeral.gap.isolation.hypothesis import Direction
from scapulohumeral.gap.labels import JOIN, MOVED, NO_GAP, NONE
from scapulohumeral.gap.weighing import Weighing

COVERAGE = 0.9
# With a gap above the noise, "no gap" is at most as probable.
UNDECIDED = 0.5
# A cause that is not named, whatever speaks against it, is at most as probable as not.
UNPROVEN = 0.5
# Probabilities nearer than this share of themselves are equal: solves do not tell them apart.
TIED = 1e-6


@dataclass(frozen=True)
class Score:
    """What is known of one answer.

    Attributes
    ----------
    log_prior : before any data
    log_evidence : of the whole difference
    log_predictive : of each task given the others; None with one task
    moves : log odds that the movement was done differently as well, if this is the cause
    directions : of its parameters, as the whole difference tells them
    """

    log_prior: float
    log_evidence: float
    log_predictive: float | None
    moves: float = 0.0
    directions: tuple[Direction, ...] = ()

    @cached_property
    def best(self) -> float:
        """Log density with the parameters that data ask for, which pay nothing."""
        return self.log_evidence - self._cost(1.0)

    def log_weight(self, weighing: Weighing) -> float:
        """Log probability up to a constant.

        Evidence of some weight is that of data with as much larger noise: it narrows parameters
        less, but each of them costs what it then costs, not its share of what it cost before.
        """
        held_out = self.best if self.log_predictive is None else self.log_predictive
        of_data = weighing.evidence * self.best + weighing.held_out * held_out
        return self.log_prior + of_data + self._cost(weighing.whole)

    def with_more(self, log_evidence: float) -> Score:
        """The same with so much more log evidence, on tasks left out as on all of them."""
        predictive = None if self.log_predictive is None else self.log_predictive + log_evidence
        return replace(
            self, log_evidence=self.log_evidence + log_evidence, log_predictive=predictive
        )

    def _cost(self, weight: float) -> float:
        """What parameters take off the log density of the best ones: zero or less.

        The log density of data of some weight, integrated over priors, less that of what the data
        ask for: the volume of the prior that is left, and how far from its middle that is.
        """
        # One to three numbers each, thousands of times where weights are fitted: no arrays.
        cost = 0.0
        for way in self.directions:
            told = weight * way.told
            cost += math.log1p(told) + way.asked**2 * told / (1.0 + told)
        return -0.5 * cost


@dataclass(frozen=True)
class Posterior:
    """Probabilities of all hypotheses: of labels, of none of these, and of no gap."""

    labels: Mapping[str, float]
    none: float
    no_gap: float

    @property
    def every(self) -> dict[str, float]:
        """Probability of each answer: of labels, "none" and "no_gap"."""
        return {**self.labels, NONE: self.none, NO_GAP: self.no_gap}

    @property
    def first(self) -> str:
        """The most probable label."""
        return max(self.labels, key=lambda label: self.labels[label])

    def doubted(self, label: str, rivals: Collection[str] = ()) -> Posterior:
        """The same with a label at most even: what is taken from it belongs to its rivals.

        These are labels that cannot be told from it, which share it as they are probable; without
        any it belongs to none of these.
        """
        taken = max(self.labels[label] - UNPROVEN, 0.0)
        labels = {**self.labels, label: self.labels[label] - taken}
        others = {rival: labels[rival] for rival in rivals if rival != label}
        if not others:
            return replace(self, labels=labels, none=self.none + taken)
        share = taken / sum(others.values())
        grown = {rival: p * (1.0 + share) for rival, p in others.items()}
        return replace(self, labels={**labels, **grown})


@dataclass(frozen=True)
class Circumstances:
    """What of a case decides how its evidence counts.

    Attributes
    ----------
    present : whether the difference exceeds the noise
    referenced : whether it is that to reference trials
    told : whether EMG or joint force is compared, beside the motion that people keep
    able : whether most causes would have shown (`detectability.silence_tells`)
    p_value : of the test for a gap
    misfit : how many times as much as assumed the likeliest explanation leaves (`misfit.misfit`)
    """

    present: bool
    referenced: bool
    told: bool
    able: bool
    p_value: float
    misfit: float

    @property
    def heard(self) -> bool:
        """Whether evidence is for or against causes: a gap, or none where most would show."""
        return self.present or (self.told and not self.unable)

    @property
    def unable(self) -> bool:
        """Whether no gap shows in muscles that would have shown few causes.

        Without reference trials that is usual, and opened draws say how probable no gap is then.
        """
        return self.referenced and self.told and not (self.present or self.able)


def probabilities(
    scores: Mapping[str, Score], weighing: Weighing, case: Circumstances
) -> Posterior:
    """Probabilities of all labels of a case, with weights that were fitted for all cases.

    What tells nothing for a cause tells nothing against no gap, which then is at least as probable
    as before any data.
    """
    least, most = no_gap_range(weighing, case)
    if case.unable:
        before = {name: np.exp(score.log_prior) for name, score in scores.items()}
        least = float(before[NO_GAP] / sum(before.values()))
    return posterior(scores, heard(weighing, case), (least, most))


def posterior(
    scores: Mapping[str, Score], weighing: Weighing, no_gap: tuple[float, float]
) -> Posterior:
    """Probabilities by Bayes' rule with weighed evidence.

    Parameters
    ----------
    scores : of all labels, of "none" and "no_gap"
    weighing : of evidence
    no_gap : least and largest probability of "no_gap", see :func:`no_gap_range`
    """
    logs = {name: score.log_weight(weighing) for name, score in scores.items()}
    labels = [name for name in scores if name not in (NONE, NO_GAP)]
    by_label = np.array([logs[name] for name in labels])
    of_known = np.logaddexp.reduce(by_label)
    of_gap = np.logaddexp(of_known, logs[NONE])
    nothing = float(np.clip(expit(logs[NO_GAP] - of_gap), *no_gap))
    # Smooth unknown inputs follow any gap, also where the model predicts its cause poorly.
    none = min(float(expit(logs[NONE] - of_known)), weighing.unknown)
    shares = (1.0 - none) * np.exp(by_label - of_known)
    found = {**dict(zip(labels, shares.tolist(), strict=True)), NONE: none}
    before = {
        name: 0.0 if JOIN in name else float(np.exp(scores[name].log_prior)) for name in found
    }
    believed = sum(before.values())
    mixed = {
        name: float((1.0 - weighing.misled) * p + weighing.misled * before[name] / believed)
        for name, p in found.items()
    }
    first = max((name for name in labels if name != MOVED), key=lambda name: logs[name])
    # Another movement is no answer where its likeliest rival explains the same movement.
    otherwise = float(expit(weighing.moving * scores[first].moves))
    for answer, share in ((MOVED, weighing.moved * otherwise), (NONE, weighing.foreign)):
        if answer in mixed:
            behind = min(logs[answer] - logs[first], 0.0)
            mixed = _kept_for(answer, share * float(np.exp(weighing.fading * behind)), mixed)
    whole = {name: (1.0 - nothing) * p for name, p in mixed.items()}
    return Posterior({name: whole[name] for name in labels}, whole[NONE], nothing)


def _kept_for(answer: str, share: float, found: Mapping[str, float]) -> dict[str, float]:
    """Probabilities of which a share belongs to one answer, beside what evidence says."""
    return {name: (1.0 - share) * p + share * (name == answer) for name, p in found.items()}


def unknown_is_likelier(scores: Mapping[str, Score], weighing: Weighing) -> bool:
    """Whether evidence, before its limit, is for "none of these" rather than for any label."""
    logs = {name: score.log_weight(weighing) for name, score in scores.items() if name != NO_GAP}
    return bool(logs.pop(NONE) > np.logaddexp.reduce(list(logs.values())))


def no_gap_range(weighing: Weighing, case: Circumstances) -> tuple[float, float]:
    """Least and largest probability of no gap.

    Where few causes would have shown, that none does makes no gap no more probable.

    Without any effect all p values are as probable; with one their density is taken to rise towards
    zero by a power, as Sellke, Bayarri and Berger 2001 (Am Stat 55: 62-71) take it.
    """
    if case.present:
        return 0.0, UNDECIDED
    if case.unable:
        return 0.0, 1.0
    share = weighing.silent_alone
    if case.referenced:
        share = weighing.silent if case.told else weighing.silent_motion
    against = (1.0 - share) * case.p_value**-weighing.silent_power
    return share / (share + against), 1.0


def heard(weighing: Weighing, case: Circumstances) -> Weighing:
    """Weights that hold for a case.

    Motion that differs no more than repeats do names no cause: what acts on the body hardly shows
    in it. Causes, another movement among them, then stay as probable as before any data. Evidence
    counts by so much less as the likeliest explanation leaves more than assumed.
    """
    if not case.heard:
        weighing = replace(weighing, misled=1.0, foreign=0.0, moved=0.0)
    evidence, held_out = weighing.evidence / case.misfit, weighing.held_out / case.misfit
    return replace(weighing, evidence=evidence, held_out=held_out)


def set90(found: Posterior, weighing: Weighing, told: bool) -> tuple[str, ...]:
    """Answers that are not excluded, the most probable first: nine in ten such sets hold the truth.

    These are all that are as probable as truths of nine in ten opened cases were: of sets that hold
    as many, those with the fewest answers (Sadinle et al. 2019, J Am Stat Assoc 114: 223-234).
    Where data do not tell causes apart, nothing excludes one: then these are the most probable ones
    that together reach 90 % of the probability. Answers as probable as the last one belong to it
    too: which of equals comes first is rounding.
    """
    every = found.every
    ordered = sorted(every, key=lambda label: -every[label])
    least = weighing.least
    if not told:
        total = np.cumsum([every[label] for label in ordered])
        least = every[ordered[int(np.searchsorted(total, COVERAGE))]]
    least = min(least, every[ordered[0]]) * (1.0 - TIED)
    return tuple(label for label in ordered if every[label] >= least)
