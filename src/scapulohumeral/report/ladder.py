"""The ladder from the authors' problem to the study's own: which choice moves the scapula how much.

Letters: N nodes.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from scapulohumeral.report.against import Predicted
from scapulohumeral.stages.published_distance import ANGLES, LEVELS_DEG, at_level
from scapulohumeral.stages.rhythm import range_rhythm, rising_part
from scapulohumeral.stages.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)

WHOLE_RISE = "start-90"
KINDS = {"alone_": "alone", "upto_": "cumulative"}


def ladder_table(predictions: Sequence[Predicted]) -> pd.DataFrame:
    """A row per rung, condition and plane, the starting variant first.

    Columns: rung, step, kind (start, alone, cumulative), condition, plane, status, upward rotation
    at fixed elevations and at the peak, clavicle elevation, rhythm over the whole rise by the
    paper's estimator, joint force at rest and at the peak [N], effort (activation term), objective.
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
            part = angles[first:stop]
            rise = rising_part(part[:, ELEVATION_COLUMN])
            row |= {
                f"ur_{level:g}_deg": at_level(part, UPWARD_ROTATION_COLUMN, level)
                for level in LEVELS_DEG
            }
            row |= {
                "ur_peak_deg": float(part[:, UPWARD_ROTATION_COLUMN].max()),
                "clavicle_15_deg": at_level(part, ANGLES["clavicle_elevation"], 15.0),
                "clavicle_70_deg": at_level(part, ANGLES["clavicle_elevation"], 70.0),
                "rhythm": range_rhythm(
                    part[rise, ELEVATION_COLUMN], part[rise, UPWARD_ROTATION_COLUMN]
                )[WHOLE_RISE],
                "gh_force_rest_N": float(force[first:stop][rise.start]),
                "gh_force_peak_N": float(force[first:stop].max()),
                "effort": one.summary["terms"]["activation"],
                "objective": one.summary["objective"],
                "stop_moment_median_Nm": one.summary["stop_moment_median_Nm"],
            }
        yield row


def ladder_figure(table: pd.DataFrame) -> str:
    """SVG text: upward rotation of each rung at fixed elevations, a panel per plane and kind."""
    planes = list(dict.fromkeys(table.plane))
    figure = Figure(figsize=(11.0, 2.6 + 2.4 * len(planes)))
    axes = figure.subplots(len(planes), 2, sharex=True, squeeze=False)
    columns = [f"ur_{level:g}_deg" for level in LEVELS_DEG]
    colours = [mpl.colormaps["viridis_r"](x) for x in np.linspace(0.15, 0.95, len(columns))]
    for row, plane in zip(axes, planes, strict=True):
        for panel, kind in zip(row, ("alone", "cumulative"), strict=True):
            part = table[(table.plane == plane) & table.kind.isin(["start", kind])]
            places = np.arange(len(part))
            for column, level, colour in zip(columns, LEVELS_DEG, colours, strict=True):
                if column not in part:
                    continue
                panel.plot(
                    part[column], places, "o", color=colour, label=f"arm at {level:g} deg",
                    markersize=4,
                )  # fmt: skip
                panel.axvline(part[column].iloc[0], color=colour, linewidth=0.6, alpha=0.6)
            panel.set_yticks(places, part.step, fontsize=7)
            panel.invert_yaxis()
            panel.set_title(f"{plane} plane, {kind}", loc="left", fontsize=8)
    for panel in axes[-1]:
        panel.set_xlabel("upward rotation [deg]")
    axes[0, 0].legend(fontsize=6, loc="best")
    figure.tight_layout()
    text = io.StringIO()
    figure.savefig(text, format="svg")
    return text.getvalue()
