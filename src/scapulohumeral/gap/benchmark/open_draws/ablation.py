"""What each stage of the diagnosis adds: the same cases by simple methods, by parts of it, by all.

Stages after screening use the evidence that answers keep (``curves/hypotheses.csv``), weighed as if
what comes later did not exist. The answer itself is last.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.gap.benchmark.metrics import of_families, probabilities, rate
from scapulohumeral.gap.benchmark.open_draws.calibrate import FLOOR
from scapulohumeral.gap.benchmark.open_draws.open_cases import open_case, read_scored_cases
from scapulohumeral.gap.benchmark.scored_case import ScoredCase
from scapulohumeral.gap.labels import family, matches_any
from scapulohumeral.gap.verdict.posterior import set90
from scapulohumeral.gap.weighing import Weighing

METHODS = ("prior_only", "rule_based", "cosine", "per_sample_bic", "screening")
ASKED = ("single", "moved", "unknown")
Judge = Callable[[ScoredCase], tuple[Mapping[str, float], Sequence[str]]]


def stages(weighing: Weighing) -> dict[str, Weighing]:
    """Weights of each stage: evidence in full, then one more thing taken into account at a time."""
    evidence = replace(
        weighing, evidence=1.0, held_out=0.0, unknown=1.0, misled=0.0, foreign=0.0, moved=0.0
    )
    held_out = replace(evidence, evidence=0.5, held_out=0.5)
    return {
        "evidence of refitted effects": evidence,
        "and tasks left out": held_out,
        "calibrated weights": weighing,
    }


def write_ablation(
    draws: Mapping[str, Mapping[str, str]], weighing: Weighing, out: Path
) -> list[dict[str, Any]]:
    """Write a table with one row per stage, over all cases whose gap has a cause but pairs.

    Parameters
    ----------
    draws : as for :func:`open_cases.read_open_cases`
    weighing : weights in use
    out : CSV file: right answers (family first) with Wilson interval, mean log probability of what
        is right, how often the 90 % set holds it, and its mean size; the latter three where a stage
        gives probabilities
    """
    cases = [
        case
        for _, case in read_scored_cases(draws)
        if case.status in ASKED and case.verdict_or_abstained is not None
    ]
    rows = [_method_row(name, cases) for name in METHODS]
    for name, weights in stages(weighing).items():
        rows.append(_row(name, cases, partial(_by_evidence, weighing=weights)))
    rows.append(_row("the answer", cases, _by_answer))
    with out.open("w", encoding="utf-8", newline="") as stream:
        table = csv.DictWriter(stream, list(rows[-1]), lineterminator="\n")
        table.writeheader()
        table.writerows(rows)
    return rows


def _method_row(method: str, cases: Sequence[ScoredCase]) -> dict[str, Any]:
    """A method that names one family."""
    named = [case.baselines.get(method, "") in map(family, case.right) for case in cases]
    return {"stage": method, **_hits(named)}


def _row(stage: str, cases: Sequence[ScoredCase], judge: Judge) -> dict[str, Any]:
    """A stage that gives probabilities by label, and a set."""
    named, logs, held, sizes = [], [], [], []
    for case in cases:
        p, chosen = judge(case)
        named.append(next(iter(of_families(p))) in map(family, case.right))
        right = sum(x for label, x in p.items() if matches_any(label, case.right))
        logs.append(np.log(max(right, FLOOR)))
        held.append(any(matches_any(label, case.right) for label in chosen))
        sizes.append(len(chosen))
    return {
        "stage": stage,
        **_hits(named),
        "log_score": round(float(np.mean(logs)), 3),
        "set_holds": round(float(np.mean(held)), 3),
        "set_size": round(float(np.mean(sizes)), 1),
    }


def _hits(named: Sequence[bool]) -> dict[str, Any]:
    found = rate(named)
    low, high = found["wilson95"] or (None, None)
    return {"right": found["hits"], "cases": found["n"], "low": low, "high": high}


def _by_evidence(case: ScoredCase, weighing: Weighing) -> tuple[dict[str, float], tuple[str, ...]]:
    opened = open_case("", case)
    found = opened.probabilities(weighing)
    return found.every, set90(found, weighing, opened.about.heard)


def _by_answer(case: ScoredCase) -> tuple[dict[str, float], Sequence[str]]:
    answer = case.verdict_or_abstained
    assert answer is not None
    return probabilities(answer), answer["set90"]
