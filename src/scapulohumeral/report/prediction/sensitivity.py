"""How far one prediction depends on weights, mesh and start: table and tornado.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from scapulohumeral.problems.sensitivity import BASE, Case
from scapulohumeral.quantities.joint_loading import percent_body_weight
from scapulohumeral.quantities.prediction_rows import rise_quantities
from scapulohumeral.quantities.segment_angles import UPWARD_ROTATION_COLUMN, thorax_angles
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.report.tables import Table, solves
from scapulohumeral.stages.distances.against import Predicted

# Elevations of the rising arm at which upward rotation is compared [deg].
LEVELS_DEG = (15.0, 45.0, 70.0)
# The same for the elevation of the clavicle.
CLAVICLE_LEVELS_DEG = (45.0,)
# What the tornado shows, and what each panel is called.
SHOWN = {
    **{f"ur_{level:g}_deg": f"upward rotation at {level:g} deg [deg]" for level in LEVELS_DEG},
    "gh_force_peak_bw": "largest joint force [% body weight]",
}
NAMES = ("case", "kind", "change", "plane", "status", "reached_from")
BAR_COLOURS = {"up": "#0072b2", "down": "#e69f00"}


def sensitivity_table(cases: Sequence[Case], predictions: Sequence[Predicted]) -> pd.DataFrame:
    """A row per case and plane, cases and predictions in the same order, the unchanged one first.

    Columns: case, kind, change in words, plane, status, reached_from (start that led to the
    solution), objective, iterations, upward rotation at fixed elevations and at the peak, its
    differences from the unchanged prediction at equal time, clavicle elevation, rhythm by the
    paper's estimator, joint force where the rise starts and at its largest. Failed cases have no
    numbers.
    """
    base = {
        plane: row["upward_rotation"]
        for case, one in zip(cases, predictions, strict=True)
        if case.name == BASE and one.solved
        for plane, row in _numbers(one)
    }
    rows: list[dict[str, Any]] = []
    for case, one in zip(cases, predictions, strict=True):
        about = {"case": case.name, "kind": case.kind, "change": case.change}
        about |= {key: one.summary[key] for key in ("status", "reached_from", "iterations")}
        if not one.solved:
            rows += [{**about, "plane": plane} for plane in one.summary["planes"]]
            continue
        about["objective"] = one.summary["objective"]
        for plane, row in _numbers(one):
            curve = row.pop("upward_rotation")
            rows.append({**about, "plane": plane, **row, **_difference(curve, base.get(plane))})
    return pd.DataFrame(rows)


def _numbers(one: Predicted) -> Iterator[tuple[str, dict[str, Any]]]:
    """Quantities of each plane; `upward_rotation` over the elevation at equal parts of its time."""
    angles = thorax_angles(one.solution.pose)
    newtons = np.linalg.norm(one.solution.reaction_N, axis=1)
    force = percent_body_weight(newtons, one.summary["body_mass_kg"])
    for plane, (first, stop) in one.summary["planes"].items():
        part = angles[first:stop]
        numbers = rise_quantities(part, force[first:stop], "bw", LEVELS_DEG, CLAVICLE_LEVELS_DEG)
        yield plane, {"upward_rotation": part[:, UPWARD_ROTATION_COLUMN], **numbers}


def _difference(curve: np.ndarray, base: np.ndarray | None) -> dict[str, float]:
    """Differences of upward rotation (N,) from the unchanged one, on whatever mesh either is."""
    if base is None:
        return {"ur_rms_change_deg": np.nan, "ur_largest_change_deg": np.nan}
    here, there = np.linspace(0.0, 1.0, len(base)), np.linspace(0.0, 1.0, len(curve))
    change = np.interp(here, there, curve) - base
    return {
        "ur_rms_change_deg": float(np.sqrt(np.mean(change**2))),
        "ur_largest_change_deg": float(np.abs(change).max()),
    }


@styled
def tornado(table: pd.DataFrame) -> Picture:
    """Change of upward rotation and joint force with each weight, largest on top."""
    planes = list(dict.fromkeys(table.plane))
    drawing = Drawing(len(planes), len(SHOWN), (13.0, 1.2 + 2.4 * len(planes)), sharey="row")
    for row, plane in zip(drawing.axes, planes, strict=True):
        part = table[table.plane == plane]
        order = _order(part)
        for panel, (column, title) in zip(row, SHOWN.items(), strict=True):
            panel.set_title(f"{plane} plane: {title}", loc="left", fontsize=8)
            _draw_bars(drawing, panel, part, column, order)
    drawing.legend(
        {
            "weight multiplied": {"color": BAR_COLOURS["up"], "linewidth": 6},
            "weight divided": {"color": BAR_COLOURS["down"], "linewidth": 6},
        }
    )
    return drawing.finish(
        "tornado",
        "Change of the prediction when one weight of the objective is multiplied or divided by the "
        "configured factor and all others stay. Without a bar: the solve did not converge, or the "
        "arm does not reach the elevation.",
    )


def _order(table: pd.DataFrame) -> list[str]:
    """Changed weights, that with the largest change of upward rotation last, which is on top."""
    weights = table[table.kind == "weight"]
    names = weights.case.str.replace(r"_(divided|times)$", "", regex=True)
    if "ur_rms_change_deg" not in weights:
        return list(dict.fromkeys(names))
    return list(weights.groupby(names).ur_rms_change_deg.max().fillna(0.0).sort_values().index)


def _draw_bars(
    drawing: Drawing, panel: Axes, table: pd.DataFrame, column: str, order: Sequence[str]
) -> None:
    values = table.set_index("case").reindex(columns=[column])[column]
    places = np.arange(len(order), dtype=float)
    for side, word in (("up", "times"), ("down", "divided")):
        changes = np.array([values.get(f"{name}_{word}", np.nan) for name in order])
        changes = changes - values.get(BASE, np.nan)
        panel.barh(places, changes, height=0.7, alpha=0.75, color=BAR_COLOURS[side])
        title, bars = panel.get_title(loc="left"), f"weight {word}"
        drawing.keep(title, bars, list(order), changes, across="weight", along="change")
    panel.axvline(0.0, color="#555555", linewidth=0.8)
    panel.set_yticks(places, [name.replace("_", " ") for name in order])
    panel.set_xlabel("change")


def sensitivity_rows(table: pd.DataFrame) -> Table:
    """All cases as text; marked: not converged."""
    return solves(table, NAMES, 4)
