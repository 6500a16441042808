"""Weights of evidence, fitted to cases whose keys are open.

Every answer keeps what its probabilities were made of (``curves/hypotheses.csv``). With other
weights the same evidence gives other probabilities: those are taken that give the cause the largest
mean log probability. Another movement beside a cause is no cause, though it is a right answer. How
good weights are on cases that they were not fitted to is told by leaving out one draw at a time, or
one fifth of the cases of a single draw.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from scapulohumeral.gap.benchmark.metrics import calibration_error, of_families, reliability
from scapulohumeral.gap.benchmark.open_draws.open_cases import OpenCase
from scapulohumeral.gap.labels import NO_GAP, family
from scapulohumeral.gap.verdict.posterior import COVERAGE, no_gap_range
from scapulohumeral.gap.weighing import BEFORE, SCHEMA, WEIGHTS, Weighing, read_weighing

# Fitted to answers with a gap.
FITTED = ("evidence", "held_out", "unknown", "misled", "foreign", "moved", "moving", "fading")
# Beyond these, all evidence or none would count: no number of cases speaks for that.
LEAST, MOST = 0.01, 0.99
# Log odds by which fitted weights are expected to differ from those in use: earlier draws chose
# these, and few cases must not move them far.
SPREAD = 1.0
FOLDS = 5
BINS = 5
# A simplex stalls in eight weights, by 0.018 units of log probability on 70 gaps, and derivatives
# stall where a case comes down to the floor, by 0.002 on 117.
METHOD: Final = "Powell"
# A tenth of a number of cases falls short of it by less.
ROUNDING = 1e-9
# Probability below which a truth counts no less: one case must not decide alone.
FLOOR = 1e-3


def fitted(cases: Sequence[OpenCase], start: Weighing) -> Weighing:
    """Weights that give the cause the largest probability, given those in use.

    They are the mode of a posterior whose prior is normal in the log odds of the weights in use.
    """
    gaps = [case for case in cases if case.about.present]
    found = start
    if gaps:

        def of_odds(x: np.ndarray) -> float:
            return loss(gaps, _with_odds(start, FITTED, x), start)

        solved = minimize(of_odds, _log_odds(start, FITTED), method=METHOD)
        found = _with_odds(start, FITTED, solved.x)
    return _with_silences(found, cases)


def loss(gaps: Sequence[OpenCase], weighing: Weighing, start: Weighing) -> float:
    """Negative log posterior of weights, per answer with a gap, given those in use."""
    departure = _departure(_log_odds(weighing, FITTED), _log_odds(start, FITTED))
    return departure / len(gaps) - log_score(gaps, weighing)


def _log_odds(weighing: Weighing, names: Sequence[str]) -> np.ndarray:
    """Log odds of some weights."""
    return logit(np.clip([getattr(weighing, name) for name in names], LEAST, MOST))


def _departure(log_odds: np.ndarray, first: np.ndarray) -> float:
    """Negative log prior of log odds of weights, given those in use."""
    return float(np.sum((log_odds - first) ** 2)) / (2.0 * SPREAD**2)


def _with_odds(weighing: Weighing, names: Sequence[str], log_odds: np.ndarray) -> Weighing:
    """Weights of which some have these log odds, but for those that no number of cases proves."""
    values = np.clip(expit(log_odds), LEAST, MOST)
    return replace(weighing, **dict(zip(names, values.tolist(), strict=True)))


def _with_silences(weighing: Weighing, cases: Sequence[OpenCase]) -> Weighing:
    """Weights with which answers without a gap are as probable as they were right.

    Given those in use, as for :func:`fitted`.
    """
    silent = (case for case in cases if not (case.about.present or case.about.unable))
    seen = [(case.about, NO_GAP in case.right) for case in silent]
    names = ("silent", "silent_motion", "silent_alone", "silent_power")
    first = _log_odds(weighing, names)

    def of_odds(x: np.ndarray) -> float:
        tried = _with_odds(weighing, names, x)
        least = [(no_gap_range(tried, about)[0], right) for about, right in seen]
        return _departure(x, first) - sum(np.log(p if right else 1.0 - p) for p, right in least)

    solved = minimize(of_odds, first, method=METHOD)
    return _with_odds(weighing, names, solved.x)


def least_of_truths(judged: Sequence[tuple[OpenCase, Weighing]]) -> float:
    """Probability from which on answers belong to the 90 % set, so that nine in ten hold the truth.

    The quantile of a finite sample (Sadinle et al. 2019, J Am Stat Assoc 114: 223-234), each case
    with weights that were fitted without it. Of sets that do not go by it, because no evidence is
    heard, those that miss the truth are among the one in ten. Zero for too few cases.
    """
    truths = sorted(case.p_best(w) for case, w in judged if case.about.heard)
    missed = sum(not case.held(w) for case, w in judged if not case.about.heard)
    below = int((1.0 - COVERAGE) * (len(judged) + 1) + ROUNDING) - missed
    return float(truths[min(below, len(truths)) - 1]) if truths and below > 0 else 0.0


def log_score(cases: Sequence[OpenCase], weighing: Weighing) -> float:
    """Mean log probability of the cause."""
    return float(np.mean([_log_cause(case, weighing) for case in cases]))


def _log_cause(case: OpenCase, weighing: Weighing) -> float:
    """Log probability of the cause of a case."""
    return float(np.log(max(case.p_cause(weighing), FLOOR)))


def left_out(cases: Sequence[OpenCase], start: Weighing) -> list[tuple[OpenCase, Weighing]]:
    """Each case with weights that were fitted without its draw, or its fifth of a single draw."""
    draws = [case.draw for case in cases]
    groups: list[Any] = draws
    if len(set(draws)) < 2:
        groups = [i % FOLDS for i in range(len(cases))]
    found = []
    for group in dict.fromkeys(groups):
        rest = [case for case, own in zip(cases, groups, strict=True) if own != group]
        weighing = fitted(rest, start) if rest else start
        found += [(case, weighing) for case, own in zip(cases, groups, strict=True) if own == group]
    return found


def first_families(judged: Sequence[tuple[OpenCase, Weighing]]) -> list[tuple[float, bool]]:
    """Probability of the first family of each case, and whether it is that of the cause."""
    pairs = []
    for case, weighing in judged:
        every = case.probabilities(weighing).every
        first, p = next(iter(of_families(every).items()))
        pairs.append((p, first in map(family, case.cause)))
    return pairs


def weights_before(path: Path, cases: Sequence[OpenCase], start: Weighing) -> Weighing:
    """Weights that cases have not been used for.

    Those in use, or if these were fitted to some of the cases those before them: what a case says
    must not count twice.

    Parameters
    ----------
    path : file of the weights in use
    cases : that are fitted to
    start : weights in use
    """
    used = json.loads(path.read_text(encoding="utf-8"))["cases"]
    seen = set(used) & {case.draw for case in cases}
    return read_weighing(path, BEFORE) if seen else start


def calibrate(cases: Sequence[OpenCase], start: Weighing, out: Path) -> Weighing:
    """Fit weights to opened draws and write them, with how good they are on cases left out.

    Parameters
    ----------
    cases : of one draw or several
    start : weights in use, see :func:`weights_before`, with which the new ones are compared
    out : file to write, see `weighing.read_weighing`
    """
    judged = left_out(cases, start)
    found = replace(fitted(cases, start), least=least_of_truths(judged))
    bins = reliability(first_families(judged), BINS)
    scores = [_log_cause(case, weighing) for case, weighing in judged]
    draws = list(dict.fromkeys(case.draw for case in cases))
    document = {
        "schema": SCHEMA,
        WEIGHTS: {f.name: round(getattr(found, f.name), 4) for f in fields(Weighing)},
        "cases": {name: sum(case.draw == name for case in cases) for name in draws},
        "left_out": {
            "by": "draw" if len(draws) > 1 else "fifth",
            "log_score": round(float(np.mean(scores)), 4),
            "log_score_with_weights_before": round(log_score(cases, start), 4),
            "calibration_error": calibration_error(bins),
            "reliability": bins,
        },
        BEFORE: asdict(start),
    }
    out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return found
