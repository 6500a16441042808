"""Weights of evidence, fitted to cases whose keys are open.

Every answer keeps what its probabilities were made of (``curves/hypotheses.csv``). With other
weights the same evidence gives other probabilities: those are taken that give the truth the largest
mean log probability. How good they are on cases that they were not fitted to is told by leaving out
one draw at a time, or one fifth of the cases of a single draw.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit, logit

from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.metrics import calibration_error, of_families, reliability
from scapulohumeral.gap.benchmark.protocol import BlindFiles, opened_cases
from scapulohumeral.gap.benchmark.scored_case import ScoredCase
from scapulohumeral.gap.curve_files import MISFIT, read_table
from scapulohumeral.gap.isolation.hypothesis import Direction
from scapulohumeral.gap.labels import NO_GAP, NONE, family, matches
from scapulohumeral.gap.verdict.posterior import (
    Circumstances,
    Posterior,
    Score,
    no_gap_range,
    probabilities,
)
from scapulohumeral.gap.weighing import SCHEMA, Weighing

# Fitted to answers with a gap.
FITTED = ("evidence", "held_out", "unknown", "misled", "foreign", "moved", "fading")
# Beyond these, all evidence or none would count: no number of cases speaks for that.
LEAST, MOST = 0.01, 0.99
# Log odds by which fitted weights are expected to differ from those in use: earlier draws chose
# these, and few cases must not move them far.
SPREAD = 1.0
FOLDS = 5
BINS = 5
# Probability below which a truth counts no less: one case must not decide alone.
FLOOR = 1e-3


@dataclass(frozen=True, eq=False)
class OpenCase:
    """An answered case whose truth is known.

    Attributes
    ----------
    draw : that it belongs to
    right : labels that each are a right answer, as `ScoredCase.right` has them
    about : circumstances of the answer
    scores : by label
    """

    draw: str
    right: tuple[str, ...]
    about: Circumstances
    scores: Mapping[str, Score]

    def probabilities(self, weighing: Weighing) -> Posterior:
        """Probabilities of all labels with some weights."""
        return probabilities(self.scores, weighing, self.about)

    def p_truth(self, weighing: Weighing) -> float:
        """Probability of what is right."""
        found = self.probabilities(weighing)
        every = {**found.labels, NONE: found.none, NO_GAP: found.no_gap}
        return sum(p for label, p in every.items() if any(matches(label, r) for r in self.right))


def read_open_cases(draws: Mapping[str, Mapping[str, str]]) -> list[OpenCase]:
    """Cases of opened draws.

    Parameters
    ----------
    draws : name -> folders `cases`, `answers`, `keys` and the file `published`

    Raises
    ------
    DataError                        a file is missing or does not fit its hash, or no case counts
    """
    return [
        open_case(name, case)
        for name, case in read_scored_cases(draws)
        if case.verdict_or_abstained is not None and case.status != "pair"
    ]


def read_scored_cases(draws: Mapping[str, Mapping[str, str]]) -> list[tuple[str, ScoredCase]]:
    """All cases of opened draws with the name of their draw, see :func:`read_open_cases`."""
    found = []
    for name, places in draws.items():
        files = BlindFiles(*(Path(places[key]) for key in ("cases", "published", "answers")))
        found += [(name, case) for case in opened_cases(files, Path(places["keys"]))]
    if all(case.verdict_or_abstained is None for _, case in found):
        raise DataError(f"{', '.join(draws)}: no answered case; answer and score a draw first.")
    return found


def open_case(draw: str, case: ScoredCase) -> OpenCase:
    """A case as it is calibrated with; its answer must not have failed."""
    answer = case.verdict_or_abstained
    assert answer is not None
    table = read_table(case.answer_folder, "hypotheses")
    directions = read_table(case.answer_folder, "directions").groupby("label")
    ways = {
        str(label): tuple(map(Direction, rows["told"], rows["asked"])) for label, rows in directions
    }
    errors = read_table(case.answer_folder, "errors").set_index("error")["value"]
    scores = {
        str(row["label"]): Score(
            row["log_prior"],
            row["log_evidence"],
            None if np.isnan(row["log_predictive"]) else row["log_predictive"],
            row["useless"],
            ways.get(str(row["label"]), ()),
        )
        for row in table.to_dict("records")
    }
    channels = answer["inputs"]["channels"]
    return OpenCase(
        draw=draw,
        right=case.right,
        about=Circumstances(
            present=bool(answer["gap"]["present"]),
            referenced=answer["mode"] == "reference",
            told=bool(channels["emg"] or channels["contact_force"]),
            p_value=float(answer["gap"]["p_value"]),
            misfit=float(errors[MISFIT]),
        ),
        scores=scores,
    )


def fitted(cases: Sequence[OpenCase], start: Weighing) -> Weighing:
    """Weights that give what is right the largest probability, given those in use.

    They are the mode of a posterior whose prior is normal in the log odds of the weights in use.
    """
    gaps = [case for case in cases if case.about.present]
    found = start
    if gaps:
        first = _log_odds(start, FITTED)

        def loss(x: np.ndarray) -> float:
            of_cases = log_score(gaps, _with_odds(start, FITTED, x))
            return _departure(x, first) / len(gaps) - of_cases

        options: Any = {"maxiter": 1500, "xatol": 0.02, "fatol": 1e-4}
        solved = minimize(loss, first, method="Nelder-Mead", options=options)
        found = _with_odds(start, FITTED, solved.x)
    return _with_silences(found, cases)


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
    seen = [(case.about, NO_GAP in case.right) for case in cases if not case.about.present]
    names = ("silent", "silent_motion", "silent_alone", "silent_power")
    first = _log_odds(weighing, names)

    def loss(x: np.ndarray) -> float:
        tried = _with_odds(weighing, names, x)
        least = [(no_gap_range(tried, about)[0], right) for about, right in seen]
        return _departure(x, first) - sum(np.log(p if right else 1.0 - p) for p, right in least)

    options: Any = {"maxiter": 4000, "xatol": 1e-4, "fatol": 1e-6}
    solved = minimize(loss, first, method="Nelder-Mead", options=options)
    return _with_odds(weighing, names, solved.x)


def log_score(cases: Sequence[OpenCase], weighing: Weighing) -> float:
    """Mean log probability of what is right."""
    return float(np.mean([np.log(max(case.p_truth(weighing), FLOOR)) for case in cases]))


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
    """Probability of the first family of each case, and whether it is right."""
    pairs = []
    for case, weighing in judged:
        found = case.probabilities(weighing)
        by_label = {**found.labels, NONE: found.none, NO_GAP: found.no_gap}
        first, p = next(iter(of_families(by_label).items()))
        pairs.append((p, first in map(family, case.right)))
    return pairs


def calibrate(draws: Mapping[str, Mapping[str, str]], start: Weighing, out: Path) -> Weighing:
    """Fit weights to opened draws and write them, with how good they are on cases left out.

    Parameters
    ----------
    draws : as for :func:`read_open_cases`
    start : weights in use, with which the new ones are compared
    out : file to write, see `weighing.read_weighing`
    """
    cases = read_open_cases(draws)
    judged = left_out(cases, start)
    found = fitted(cases, start)
    bins = reliability(first_families(judged), BINS)
    scores = [np.log(max(case.p_truth(weighing), FLOOR)) for case, weighing in judged]
    document = {
        "schema": SCHEMA,
        "weights": {f.name: round(getattr(found, f.name), 4) for f in fields(Weighing)},
        "cases": {name: sum(case.draw == name for case in cases) for name in draws},
        "left_out": {
            "by": "draw" if len(draws) > 1 else "fifth",
            "log_score": round(float(np.mean(scores)), 4),
            "log_score_with_weights_before": round(log_score(cases, start), 4),
            "calibration_error": calibration_error(bins),
            "reliability": bins,
        },
        "before": asdict(start),
    }
    out.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    return found
