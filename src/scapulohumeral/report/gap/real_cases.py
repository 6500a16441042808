"""Cases of known cause: what the diagnosis answered, what was true, what it could not tell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

import pandas as pd

from scapulohumeral.quantities.proportion import percent, wilson95
from scapulohumeral.report.tables import Table

NO_EFFECT, ARTEFACT = "no_effect", "artefact"
MOVED = "control/movement_strategy"
# Answers that name no cause on body or record.
WORDS = {
    "none": "none of the known effects",
    "no_gap": "no gap",
    MOVED: "the movement was done differently",
}
# As in the table: between labels of which one is right, and between sentences.
OR, AND = " or ", " | "
# A wrong cause that is named with more is said with confidence.
CONFIDENT = 0.5
COLUMNS = (
    "case",
    "truth",
    "gap (p)",
    "most probable answer",
    "probability of the truth",
    "truth in the 90 % set (labels)",
    "gap removed where not fitted",
)


def real_content(table: pd.DataFrame) -> dict[str, Any] | None:
    """Tables and counts of the chapter, None if no case was run.

    Parameters
    ----------
    table : ``reports/real_cases.csv``, one row per case; empty if there is none
    """
    if table.empty:
        return None
    known = table.astype(object).where(table.notna(), None)
    rows = [dict(zip(table.columns, row, strict=True)) for row in known.itertuples(index=False)]
    caused = [row for row in rows if row["kind"] != NO_EFFECT]
    nulls = [row for row in rows if row["kind"] == NO_EFFECT]
    spoilt = [row for row in caused if row["kind"] == ARTEFACT]
    return {
        "cases": _table([row for row in caused if row["kind"] != ARTEFACT]),
        "spoilt": _table(spoilt),
        "spoilt_right": _share([bool(row["present"]) and row["right"] for row in spoilt]),
        "nulls": _table(nulls),
        "alarms": _share([bool(row["present"]) for row in nulls if row["status"] != "failed"]),
        "failed": sum(row["status"] == "failed" for row in rows),
        "confident_and_wrong": [
            row["case"] for row in rows if _misleads(row) and row["first"] != MOVED
        ],
        "moved_and_wrong": [
            f"{row['case']} ({percent(row['first_p'])})"
            for row in rows
            if _misleads(row) and row["first"] == MOVED
        ],
        "doubts": [
            {"case": row["case"], "texts": row["said"].split(AND)} for row in caused if row["said"]
        ],
        "sources": list(dict.fromkeys(row["source"] for row in rows)),
        "codes": _codes(rows),
        "slowest_s": f"{max(row['seconds'] for row in rows):.0f}",
    }


def _codes(rows: list[dict[str, Any]]) -> list[str]:
    """How many rows are by which code, most first; nothing of a table that does not say."""
    counted = Counter(row["code"] for row in rows if row.get("code"))
    return [f"{count} by {code[:12]}" for code, count in counted.most_common()]


def _table(rows: list[dict[str, Any]]) -> Table:
    flagged = frozenset(i for i, row in enumerate(rows) if _misleads(row))
    return Table(COLUMNS, [_cells(row) for row in rows], flagged)


def _cells(row: Mapping[str, Any]) -> tuple[str, ...]:
    about = f"{row['case']}: {row['known']}"
    truth = OR.join(WORDS.get(label, label) for label in row["truth"].split(OR))
    if row["status"] == "failed":
        return (about, truth, "", f"no verdict: {row['status_reason']}", "", "", "")
    first = f"{WORDS.get(row['first'], row['first'])} ({percent(row['first_p'])})"
    if row["status"] == "abstained":
        first = f"not decided: {row['status_reason']}; most probable {first}"
    removed = row["held_out"]
    return (
        about,
        truth,
        f"{'yes' if row['present'] else 'no'} ({row['p_value']:.2g})",
        first,
        percent(row["truth_p"]),
        f"{'yes' if row['in_set90'] else 'no'} ({row['set_size']:.0f})",
        "not asked for" if removed is None else percent(removed),
    )


def _misleads(row: Mapping[str, Any]) -> bool:
    """Whether a cause, or another movement, is named that is wrong, with confidence."""
    named = row["first"] == MOVED or row["first"] not in WORDS
    if row["status"] != "ok" or not row["present"] or not named:
        return False
    return not row["right"] and row["first_p"] > CONFIDENT


def _share(hits: list[bool]) -> str | None:
    """How many, with Wilson 95 % interval."""
    if not hits:
        return None
    low, high = wilson95(sum(hits), len(hits))
    return f"{sum(hits)} of {len(hits)} [{percent(low)}, {percent(high)}]"
