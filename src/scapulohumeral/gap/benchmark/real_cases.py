"""What diagnoses said of cases whose cause is known from elsewhere, as one table."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from scapulohumeral.configuration.real_cases import RealCases
from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.metrics import probabilities
from scapulohumeral.gap.curve_files import read_table
from scapulohumeral.gap.explained import removed_of_tasks
from scapulohumeral.gap.labels import JOIN, NO_GAP, NONE, matches_any
from scapulohumeral.gap.result import read_result

COLUMNS = (
    "case",
    "kind",
    "known",
    "source",
    "truth",
    "status",
    "present",
    "p_value",
    "first",
    "first_p",
    "right",
    "in_set90",
    "in_pair90",
    "set_size",
    "truth_p",
    "none_p",
    "no_gap_p",
    "unexplained",
    "held_out",
    "status_reason",
    "said",
    "seconds",
    "core_seconds",
    "code",
)
# Of the hash of the code that answered, to tell answers of different code apart.
SHOWN_OF_HASH = 8
# Between labels of a cell, of which one is right, and between sentences.
OR, AND = " or ", " | "


def case_table(
    cases: RealCases, names: Sequence[str], results: Sequence[Path], times: Sequence[Path]
) -> pd.DataFrame:
    """One row per case, `COLUMNS`.

    Parameters
    ----------
    cases : what is known; names : cases to show
    results : ``result.json`` of each; times : Snakemake's benchmark of each

    Raises
    ------
    DataError                        a file is missing, or is no answer
    """
    rows = []
    for name, result, spent in zip(names, results, times, strict=True):
        case = cases.cases[name]
        source = cases.people[case.person].source
        about = {"case": name, "kind": case.kind, "known": case.known, "source": source}
        answer = read_result(result)
        row = {**about, **judged(answer, case.truth), **_times(spent)}
        row["code"] = answer["hashes"]["code"][:SHOWN_OF_HASH]
        rows.append(row | {"held_out": held_out(answer, result.parent)})
    return pd.DataFrame(rows, columns=list(COLUMNS))


def judged(answer: Mapping[str, Any], truth: Sequence[str]) -> dict[str, Any]:
    """What an answer says, and whether it is right.

    Parameters
    ----------
    answer : ``result.json``
    truth : labels of which one is right; none if no effect of the library is

    Returns
    -------
    dict     columns from `truth` to `said`. `first`, the most probable answer, may be "none" or
             "no_gap"; `in_pair90` says whether a right label is half of a pair in the set;
             `truth_p` adds up the probabilities of right labels
    """
    right = truth or [NONE]
    row: dict[str, Any] = {
        "truth": OR.join(right),
        "status": answer["status"],
        "status_reason": answer["status_reason"],
        "said": AND.join(_said(answer)),
    }
    if answer["status"] == "failed":
        return row
    p = probabilities(answer)
    first = max(p, key=lambda label: p[label])
    unexplained = {c["label"]: c["unexplained_share"] for c in answer["candidates"]}
    return row | {
        "present": answer["gap"]["present"],
        "p_value": answer["gap"]["p_value"],
        "first": first,
        "first_p": p[first],
        "right": matches_any(first, right),
        "in_set90": any(matches_any(label, right) for label in answer["set90"]),
        "in_pair90": any(
            matches_any(member, right)
            for label in answer["set90"]
            if JOIN in label
            for member in label.split(JOIN)
        ),
        "set_size": len(answer["set90"]),
        "truth_p": sum(value for label, value in p.items() if matches_any(label, right)),
        "none_p": p[NONE],
        "no_gap_p": p[NO_GAP],
        "unexplained": unexplained.get(first),
    }


def held_out(answer: Mapping[str, Any], folder: Path) -> float | None:
    """Share of the gap that the first cause removed on tasks that were not fitted, else on trials.

    It is what these trials showed, not what one more task is expected to show.

    Parameters
    ----------
    answer : ``result.json``
    folder : where it is, with its tables
    """
    shares = answer["shrinkage"]
    if shares is None:
        return None
    left_out = read_table(folder, "left_out")
    of_tasks = removed_of_tasks(list(zip(left_out["before"], left_out["after"], strict=True)))
    of_trials = shares["held_out_trial"]
    if of_tasks is None and of_trials is not None:
        return of_trials["value"]
    return of_tasks


def _said(answer: Mapping[str, Any]) -> Iterator[str]:
    """What it said that it could not tell."""
    if answer["hint"]:
        yield answer["hint"]
    yield from (entry["text"] for entry in answer["classes"] if len(entry["labels"]) > 1)
    if answer["next_trial"]:
        splits = ", ".join(answer["next_trial"]["splits"])
        yield f"{splits}: told apart best by {answer['next_trial']['task']}"
    yield from answer["warnings"]


def _times(path: Path) -> dict[str, float]:
    """Seconds by the clock and of processors, of the last run."""
    try:
        spent = json.loads(path.read_text(encoding="utf-8").splitlines()[-1])
        return {"seconds": float(spent["s"]), "core_seconds": float(spent["cpu_time"])}
    except (OSError, ValueError, KeyError, IndexError) as error:
        raise DataError(f"{path}: {error}. Run the diagnosis again.") from error
