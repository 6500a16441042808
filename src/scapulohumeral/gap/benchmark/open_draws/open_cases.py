"""Answered cases whose keys are open, as weights of evidence are fitted to them.

A draw takes hours to answer, and its files are large. What is needed of an opened one is kept in
two small tables (``config/gap/opened``), so that weights can be fitted again, with further draws.
"""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import logsumexp

from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.protocol import BlindFiles, opened_cases
from scapulohumeral.gap.benchmark.scored_case import ScoredCase
from scapulohumeral.gap.curve_files import MISFIT, read_table
from scapulohumeral.gap.isolation.hypothesis import Direction
from scapulohumeral.gap.labels import JOIN, MOVED, NO_GAP, NONE, matches_any
from scapulohumeral.gap.verdict.detectability import silence_tells
from scapulohumeral.gap.verdict.posterior import (
    Circumstances,
    Posterior,
    Score,
    heard,
    probabilities,
    set90,
)
from scapulohumeral.gap.weighing import Weighing

CASES, HYPOTHESES = "cases.csv", "hypotheses.csv"
# A label is kept if its log probability is at most so many units below the first.
FAR = 4.0
# All other labels together, and all other pairs: each is improbable, but there are many.
ELSEWHERE = "elsewhere"
PAIRS_ELSEWHERE = JOIN.join([ELSEWHERE, ELSEWHERE])
BETWEEN = "|"


@dataclass(frozen=True, eq=False)
class OpenCase:
    """An answered case whose truth is known.

    Attributes
    ----------
    draw : that it belongs to; name : its own
    right, cause : labels that each are a right answer, as `ScoredCase` has them
    about : circumstances of the answer
    scores : by label
    """

    draw: str
    name: str
    right: tuple[str, ...]
    cause: tuple[str, ...]
    about: Circumstances
    scores: Mapping[str, Score]

    def probabilities(self, weighing: Weighing) -> Posterior:
        """Probabilities of all labels with some weights."""
        return probabilities(self.scores, weighing, self.about)

    def p_cause(self, weighing: Weighing) -> float:
        """Probability of the cause."""
        every = self.probabilities(weighing).every
        return sum(every[label] for label in self._causes)

    def p_best(self, weighing: Weighing) -> float:
        """Probability of the most probable right answer."""
        every = self.probabilities(weighing).every
        return max((p for label, p in every.items() if matches_any(label, self.right)), default=0.0)

    def held(self, weighing: Weighing) -> bool:
        """Whether the 90 % set holds a right answer."""
        labels = set90(self.probabilities(weighing), weighing, self.about.heard)
        return any(matches_any(label, self.right) for label in labels)

    @cached_property
    def _causes(self) -> tuple[str, ...]:
        """Answers that are the cause."""
        return tuple(label for label in self.scores if matches_any(label, self.cause))


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
        cases = opened_cases(files, Path(places["keys"]), "weights of evidence, or stages")
        found += [(name, case) for case in cases]
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
        str(row["label"]): _score(row, ways.get(str(row["label"]), ()))
        for row in table.to_dict("records")
    }
    channels = answer["inputs"]["channels"]
    return OpenCase(
        draw=draw,
        name=str(case.key["case"]),
        right=case.right,
        cause=case.cause,
        about=Circumstances(
            present=bool(answer["gap"]["present"]),
            referenced=answer["mode"] == "reference",
            told=bool(channels["emg"] or channels["contact_force"]),
            able=silence_tells(
                (one for one in scores if JOIN not in one and one not in (NONE, NO_GAP, MOVED)),
                (one["label"] for one in answer["gap"]["smallest_detectable"]),
            ),
            p_value=float(answer["gap"]["p_value"]),
            misfit=float(errors[MISFIT]),
        ),
        scores=scores,
    )


def write_opened(cases: Sequence[OpenCase], folder: Path, weighing: Weighing) -> None:
    """Write the two tables that :func:`read_opened` reads.

    `weighing` tells which labels are improbable enough to be written as one.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = [
        {
            "draw": case.draw,
            "case": case.name,
            "right": BETWEEN.join(case.right),
            "cause": BETWEEN.join(case.cause),
            "present": int(case.about.present),
            "referenced": int(case.about.referenced),
            "told": int(case.about.told),
            "able": int(case.about.able),
            "p_value": case.about.p_value,
            "misfit": round(case.about.misfit, 4),
        }
        for case in cases
    ]
    pd.DataFrame(rows).to_csv(folder / CASES, index=False, lineterminator="\n")
    rows = [
        {"draw": case.draw, "case": case.name, "label": label, **_written(score)}
        for case in cases
        for label, score in near(case, weighing).items()
    ]
    pd.DataFrame(rows).to_csv(folder / HYPOTHESES, index=False, lineterminator="\n")


def read_opened(folder: Path) -> list[OpenCase]:
    """Cases of draws that were opened earlier.

    Raises
    ------
    DataError                        a table is missing, lacks a column or holds what is no number
    """
    try:
        cases = pd.read_csv(folder / CASES, dtype={"case": str, "draw": str})
        table = pd.read_csv(folder / HYPOTHESES, dtype={"case": str, "draw": str})
        by_case = {key: rows.to_dict("records") for key, rows in table.groupby(["draw", "case"])}
        return [
            OpenCase(
                draw=row["draw"],
                name=row["case"],
                right=tuple(row["right"].split(BETWEEN)),
                cause=tuple(row["cause"].split(BETWEEN)),
                about=Circumstances(
                    present=bool(row["present"]),
                    referenced=bool(row["referenced"]),
                    told=bool(row["told"]),
                    able=bool(row["able"]),
                    p_value=float(row["p_value"]),
                    misfit=float(row["misfit"]),
                ),
                scores={
                    str(one["label"]): _score(one, _read_directions(one["directions"]))
                    for one in by_case[row["draw"], row["case"]]
                },
            )
            for row in cases.to_dict("records")
        ]
    except (OSError, KeyError, ValueError, AttributeError) as error:
        raise DataError(
            f"{folder}: {error}; expected {CASES} and {HYPOTHESES} as "
            "`scapulohumeral gap calibrate --keep` writes them. Restore the folder."
        ) from error


def near(case: OpenCase, weighing: Weighing) -> dict[str, Score]:
    """Scores of labels that decide what is probable, all others as one, and all other pairs.

    Where no gap was found, evidence for one cause or another decides nothing; where none is heard
    either, priors decide what belongs to the 90 % set, so that each label counts.
    """
    if not case.about.heard:
        # Without evidence parameters cost nothing either.
        return {label: replace(score, directions=()) for label, score in case.scores.items()}
    counting = heard(weighing, case.about)
    logs = {label: score.log_weight(counting) for label, score in case.scores.items()}
    together = (ELSEWHERE, PAIRS_ELSEWHERE)
    first = max(log for label, log in logs.items() if label not in (NO_GAP, *together))
    least = first - FAR if case.about.present else np.inf
    kept: dict[str, Score] = {}
    rest: dict[str, list[str]] = {}
    for label, score in case.scores.items():
        answer = label in (NONE, NO_GAP, MOVED) or matches_any(label, case.right)
        if answer or (logs[label] > least and label not in together):
            kept[label] = score
        else:
            rest.setdefault(PAIRS_ELSEWHERE if JOIN in label else ELSEWHERE, []).append(label)
    for name, labels in rest.items():
        log_prior = float(logsumexp([case.scores[label].log_prior for label in labels]))
        of_data = float(logsumexp([logs[label] for label in labels])) - log_prior
        log = of_data / counting.whole
        likeliest = case.scores[max(labels, key=lambda label: logs[label])]
        kept[name] = Score(log_prior, log, log, moves=likeliest.moves)
    return kept


def _written(score: Score) -> dict[str, Any]:
    """A score as a row of the table."""
    ways = " ".join(f"{way.told:.4g}:{way.asked:.4g}" for way in score.directions)
    predictive = score.log_predictive
    return {
        "log_prior": round(score.log_prior, 4),
        "log_evidence": round(score.log_evidence, 2),
        "log_predictive": None if predictive is None else round(predictive, 2),
        "moves": round(score.moves, 3),
        "directions": ways,
    }


def _read_directions(text: Any) -> tuple[Direction, ...]:
    """Directions as :func:`_written` joins them; an empty cell is read as no number."""
    pairs = (pair.split(":") for pair in text.split()) if isinstance(text, str) else ()
    return tuple(Direction(float(told), float(asked)) for told, asked in pairs)


def _score(row: Mapping[Hashable, Any], directions: tuple[Direction, ...]) -> Score:
    """A score of a row of a table."""
    predictive = row["log_predictive"]
    return Score(
        log_prior=float(row["log_prior"]),
        log_evidence=float(row["log_evidence"]),
        log_predictive=None if np.isnan(predictive) else float(predictive),
        moves=float(row["moves"]),
        directions=directions,
    )
