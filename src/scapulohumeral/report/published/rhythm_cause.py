"""Why a rhythm is not the printed one: the arm, the model, or what nobody knows of the authors'.

Between the study's own prediction and the printed table lie two more predictions: the same model on
the published arm, and the authors' problem on it. All four are told by the paper's estimator.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from scapulohumeral.quantities.prediction_rows import WHOLE_RISE
from scapulohumeral.report.words import step_in_words

# As for cells of the printed table: closer than this is no difference [1].
SAME_SHARE = 0.2


@dataclass(frozen=True)
class RhythmCell:
    """One cell of the printed table: predicted condition, plane, phase and printed rhythm."""

    condition: str
    plane: str
    phase: str
    printed: float


def rhythm_cause(
    cell: RhythmCell, own: float, published: pd.DataFrame, ladder: pd.DataFrame
) -> str:
    """Which step between own and printed rhythm changes it most, in words; empty if one is unknown.

    Parameters
    ----------
    own : rhythm of the study's prediction by the paper's estimator
    published : rows of results/prediction/against_published.csv
    ladder : rows of reports/ladder.csv, empty if it was not climbed
    """
    same_model = _on_published_arm(published, "study_arm", cell)
    authors = _on_published_arm(published, "published", cell)
    values = np.array([own, same_model, authors, cell.printed])
    if not (np.isfinite(values) & (values > 0.0)).all():
        return ""
    said = (
        f"by the paper's estimator {own:.2f} here, {same_model:.2f} with the same model on the "
        f"published arm, {authors:.2f} with the authors' problem"
    )
    if abs(own / cell.printed - 1.0) <= SAME_SHARE:
        return said
    steps = -np.diff(np.log(values))
    towards = steps * np.sign(steps.sum())
    names = ("the motion of the arm", "model and problem", "what the authors' problem leaves open")
    cause = names[int(towards.argmax())]
    rung = largest_rung(ladder, cell) if cause == names[1] else ""
    return f"{said}: the largest step is {cause}" + (f", above all {rung}" if rung else "")


def _on_published_arm(published: pd.DataFrame, variant: str, cell: RhythmCell) -> float:
    names: Mapping[str, str] = {
        "variant": variant,
        "condition": cell.condition,
        "plane": cell.plane,
        "phase": cell.phase,
        "quantity": "rhythm_range",
    }
    rows = published
    for column, value in names.items():
        rows = rows[rows[column] == value]
    return float(rows.reproduced.iloc[0]) if len(rows) else float("nan")


def largest_rung(ladder: pd.DataFrame, cell: RhythmCell) -> str:
    """Step of the ladder that changes the rhythm of the whole rise most, in words.

    Empty for other phases and conditions, which the ladder does not tell, and without a ladder. The
    step to the recorded arm is no choice of the model and is left out.
    """
    if ladder.empty or cell.phase != WHOLE_RISE:
        return ""
    rungs = ladder[
        ladder.kind.isin(["start", "cumulative"])
        & (ladder.plane == cell.plane)
        & (ladder.condition == cell.condition)
        & (ladder.status == "optimal")
        & (ladder.step != "arm")
    ]
    if len(rungs) < 2:
        return ""
    changes = np.abs(np.diff(np.log(rungs.rhythm.to_numpy(dtype=float))))
    largest = int(changes.argmax())
    before, after = rungs.rhythm.iloc[largest : largest + 2]
    return f"{step_in_words(rungs.step.iloc[largest + 1])} ({before:.2f} to {after:.2f})"
