"""The ladder from the authors' problem to the study's own: which choice moves the scapula how much.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from scapulohumeral.quantities.prediction_rows import rise_quantities
from scapulohumeral.quantities.published_distance import LEVELS_DEG
from scapulohumeral.quantities.segment_angles import thorax_angles
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.report.tables import Table, solves
from scapulohumeral.report.words import step_in_words
from scapulohumeral.stages.distances.against import Predicted

# Elevations of the arm at which the clavicle is told: nearly hanging, and high [deg].
CLAVICLE_LEVELS_DEG = (15.0, 70.0)
NAMES = ("rung", "step", "kind", "condition", "plane", "status")
UPWARD = "upward rotation [deg]"
KINDS = {"alone_": "alone", "upto_": "cumulative"}


def ladder_table(predictions: Sequence[Predicted]) -> pd.DataFrame:
    """A row per rung, condition and plane, the starting variant first.

    Columns: rung, step, kind (start, alone, cumulative), condition, plane, status, upward rotation
    at fixed elevations and at the peak, clavicle elevation, rhythm over the whole rise by the
    paper's estimator, joint force where the rise starts and at its peak [N], effort (activation
    term), objective.
    """
    return pd.DataFrame([row for one in predictions for row in _rows(one)])


def _rows(one: Predicted) -> Iterator[dict[str, Any]]:
    rung = one.names["variant"]
    prefix = next((p for p in KINDS if rung.startswith(p)), "")
    about = {
        "rung": rung,
        "step": rung.removeprefix(prefix),
        "kind": KINDS.get(prefix, "start"),
        "condition": one.names["condition"],
        "status": one.names["status"],
    }
    angles = thorax_angles(one.solution.pose)
    force = np.linalg.norm(one.solution.reaction_N, axis=1)
    for plane, (first, stop) in one.summary["planes"].items():
        row = {**about, "plane": plane}
        if one.solved:
            part = angles[first:stop], force[first:stop]
            row |= rise_quantities(*part, "N", LEVELS_DEG, CLAVICLE_LEVELS_DEG)
            row |= {
                "effort": one.summary["terms"]["activation"],
                "objective": one.summary["objective"],
                "stop_moment_median_Nm": one.summary["stop_moment_median_Nm"],
            }
        yield row


@styled
def ladder_figure(table: pd.DataFrame) -> Picture:
    """Upward rotation of each rung at fixed elevations of the arm.

    A row of panels per condition and plane, a column per kind of rung.
    """
    shown = list(dict.fromkeys(zip(table.condition, table.plane, strict=True)))
    drawing = Drawing(len(shown), 2, (11.5, 1.0 + 2.6 * len(shown)))
    colours = [mpl.colormaps["viridis_r"](x) for x in np.linspace(0.15, 0.95, len(LEVELS_DEG))]
    lines = {
        f"arm at {level:g} deg": {"color": colour, "marker": "o", "linestyle": "none"}
        for level, colour in zip(LEVELS_DEG, colours, strict=True)
    }
    for row, (condition, plane) in zip(drawing.axes, shown, strict=True):
        there = table[(table.condition == condition) & (table.plane == plane)]
        for panel, kind in zip(row, ("alone", "cumulative"), strict=True):
            part = there[there.kind.isin(["start", kind])]
            panel.set_title(f"{condition}, {plane} plane, {kind}", loc="left")
            _draw_rungs(drawing, panel, part, lines)
    for panel in drawing.axes[-1]:
        panel.set_xlabel(UPWARD)
    drawing.legend(lines)
    return drawing.finish(
        "ladder_steps",
        "Upward rotation of the predicted scapula while the arm rises. First row of each panel: "
        "the authors' problem, continued by thin lines; below it one choice at a time taken back "
        "to the study's own (left), or all choices up to it (right). Rungs without marks did not "
        "converge.",
    )


def _draw_rungs(
    drawing: Drawing, panel: Axes, part: pd.DataFrame, lines: Mapping[str, Any]
) -> None:
    places, names = np.arange(len(part), dtype=float), list(map(step_in_words, part.step))
    for (label, line), level in zip(lines.items(), LEVELS_DEG, strict=True):
        values = part.get(f"ur_{level:g}_deg", pd.Series(np.nan, index=part.index)).to_numpy()
        panel.plot(values, places, markersize=4, **line)
        panel.axvline(values[0], color=line["color"], linewidth=0.6, alpha=0.6)
        title = panel.get_title(loc="left")
        drawing.keep(title, label, names, values, across="rung", along=UPWARD)
    panel.set_yticks(places, names, fontsize=7)
    panel.invert_yaxis()


def ladder_moves(table: pd.DataFrame) -> Table:
    """How far each choice moves the scapula, alone and on the way; marked: a rung did not converge.

    Mean change of upward rotation over the fixed elevations that both rungs reach, by condition and
    plane: alone from the start, on the way from the last rung before that converged. Empty: no such
    rung.
    """
    planes = list(dict.fromkeys(table.plane))
    moves = [
        ((str(condition), *cells), converged)
        for condition, rungs in table.groupby("condition", sort=False)
        for cells, converged in _moves(rungs, planes)
    ]
    columns = [f"{word}, {plane} [deg]" for word in ("alone", "on the way") for plane in planes]
    flagged = frozenset(row for row, (_, converged) in enumerate(moves) if not converged)
    rows = [cells for cells, _ in moves]
    return Table(("condition", "choice taken back", *columns), rows, flagged)


def _moves(table: pd.DataFrame, planes: Sequence[str]) -> Iterator[tuple[tuple[str, ...], bool]]:
    """Cells of each choice of one condition, and whether its rungs converged."""
    levels = [f"ur_{level:g}_deg" for level in LEVELS_DEG]
    upward = {
        (row["kind"], row["step"], row["plane"]): np.array([row.get(key, np.nan) for key in levels])
        for row in table.to_dict("records")
    }
    start = {plane: value for (kind, _, plane), value in upward.items() if kind == "start"}
    before, missing = dict(start), np.full(len(levels), np.nan)
    solved = dict(
        zip(zip(table.kind, table.step, strict=True), table.status == "optimal", strict=True)
    )
    for row, step in enumerate(dict.fromkeys(table.step[table.kind == "cumulative"])):
        # Alone the first step is the same problem as on the way.
        kind = "cumulative" if row == 0 else "alone"
        alone = {plane: upward.get((kind, step, plane), missing) for plane in planes}
        way = {plane: upward.get(("cumulative", step, plane), missing) for plane in planes}
        changes = [_change(alone[plane], start[plane]) for plane in planes]
        changes += [_change(way[plane], before[plane]) for plane in planes]
        before |= {plane: value for plane, value in way.items() if np.isfinite(value).any()}
        converged = solved.get(("alone", step), True) and solved["cumulative", step]
        cells = ("" if np.isnan(c) else f"{c:+.1f}" for c in changes)
        yield (step_in_words(step), *cells), bool(converged)


def _change(after: np.ndarray, before: np.ndarray) -> float:
    """Mean change over the elevations that both have [deg]; not a number where there is none."""
    change = (after - before)[np.isfinite(after - before)]
    return float(change.mean()) if len(change) else float("nan")


def ladder_rows(table: pd.DataFrame) -> Table:
    """All rungs as text; marked: not converged."""
    return solves(table, NAMES, 3)
