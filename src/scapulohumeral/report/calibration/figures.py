"""EMG quality and calibrated scalers: tables, and a figure of estimates with their intervals."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from scapulohumeral.quantities.paper import PREDICTED_PARTICIPANT, SCALERS
from scapulohumeral.report.coordination import Coordination
from scapulohumeral.report.coordination_targets import KIND_NAMES
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.report.tables import Table

CALIBRATED = "#0072b2"
PAPER_PROBLEM = "#e69f00"
PLANT = "#000000"
PUBLISHED = "#009e73"
FACTOR = "factor on the generic value [1]"


def emg_quality(coordination: Coordination) -> Table:
    """Outcome of the quality checks of every trial with EMG."""
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for trial in coordination.emg:
        if trial.envelopes is None:
            flagged.add(len(rows))
            failure = trial.quality["failure"]
            rows.append((trial.participant, trial.trial, "NOT SIMULATED", "", "", failure))
            continue
        checks = trial.quality["checks"]
        failed = [c for c in checks if not c["passed"]]
        if failed:
            flagged.add(len(rows))
        largest = max(c["value"] for c in checks if c["check"] == "above_mvc")
        rows.append(
            (
                trial.participant,
                trial.trial,
                "simulated" if trial.quality["simulated"] else "measured",
                f"{len(checks) - len(failed)} of {len(checks)}",
                f"{largest:.2f}",
                "; ".join(f"{c['channel']} ({c['recording']}): {c['check']}" for c in failed),
            )
        )
    columns = (
        "participant", "trial", "EMG", "checks passed", "largest envelope [fraction of MVC]",
        "not passed",
    )  # fmt: skip
    return Table(columns, rows, frozenset(flagged))


def scaler_table(coordination: Coordination) -> Table:
    """Every scaler with its interval, the estimate of the paper's problem, and the plant."""
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for participant, document in coordination.calibrations.items():
        for group, kinds in document["groups"].items():
            for kind, entry in kinds.items():
                if entry.get("covered") is False and entry["identifiable"]:
                    flagged.add(len(rows))
                rows.append(_scaler_row(participant, group, kind, entry))
    columns = (
        "participant", "muscle group", "scaler of", "calibrated", "90 % interval", "identifiable",
        "paper's problem", "plant", "error [%]", "interval covers the plant", "published",
    )  # fmt: skip
    return Table(columns, rows, frozenset(flagged))


def _scaler_row(
    participant: str, group: str, kind: str, entry: Mapping[str, Any]
) -> tuple[str, ...]:
    low, high = entry["ci90"]
    known = "plant" in entry
    published = SCALERS.get(group, {}) if participant == PREDICTED_PARTICIPANT else {}
    return (
        participant,
        group.replace("_", " "),
        KIND_NAMES[kind],
        f"{entry['value']:.3f}" + (" (at its bound)" if entry["at_bound"] else ""),
        f"{low:.2f} to {high:.2f}",
        "yes" if entry["identifiable"] else "no",
        f"{entry['paper_problem']:.3f}",
        f"{entry['plant']:.2f}" if known else "unknown",
        f"{100 * entry['error']:+.1f}" if known else "",
        ("yes" if entry["covered"] else "no") if known else "",
        f"{published[kind]:.2f}" if kind in published else "",
    )


def score_table(coordination: Coordination) -> Table:
    """Errors of both estimates against the plant, by participant and kind."""
    rows: list[tuple[str, ...]] = []
    for participant, document in coordination.calibrations.items():
        scores = document["scores"] or {}
        for kind, name in KIND_NAMES.items() if scores else ():
            entry = scores[kind]
            rows.append(
                (
                    participant,
                    name,
                    f"{entry['identifiable']} of {entry['groups']}",
                    _percent(entry["median_error"]),
                    _percent(entry["median_error_all"]),
                    _percent(entry["median_error_paper_problem"]),
                    _percent(_coverage(document, kind)),
                    f"{document['activation_time']:.2f}, {document['deactivation_time']:.2f}",
                    document["status"],
                )
            )
    columns = (
        "participant", "scaler of", "identifiable groups", "median error over them [%]",
        "over all groups [%]", "paper's problem, identifiable groups [%]",
        "of the identifiable, 90 % intervals that cover the plant [%]",
        "factors on activation and deactivation time", "refinement",
    )  # fmt: skip
    return Table(columns, rows)


def _coverage(document: Mapping[str, Any], kind: str) -> float | None:
    """Share of the 90 % intervals of identifiable scalers of a kind that hold the plant's."""
    entries = [kinds[kind] for kinds in document["groups"].values()]
    told = [bool(entry["covered"]) for entry in entries if entry["identifiable"]]
    return sum(told) / len(told) if told else None


def recovery_table(found: pd.DataFrame) -> Table:
    """Errors of calibrations to arms of other structure, by arm and kind, over all groups."""
    rows: list[tuple[str, ...]] = []
    for (arm, kind), part in found.groupby(["arm", "kind"], sort=False) if len(found) else ():
        told = part[part.identifiable]
        rows.append(
            (
                str(arm).replace("_", " "),
                KIND_NAMES[str(kind)],
                _percent((part.value / part.plant - 1.0).abs().median()),
                _percent((part.paper_problem / part.plant - 1.0).abs().median()),
                f"{len(told)} of {len(part)}",
                f"{int(told.covered.sum())} of {len(told)}",
                f"{part.misfit.iloc[0]:.2f}",
                str(part.status.iloc[0]),
            )
        )
    columns = (
        "simulated arm", "scaler of", "median error [%]", "paper's problem [%]",
        "identifiable groups", "of these, 90 % intervals that cover the arm's value",
        "misfit of EMG over its noise", "refinement",
    )  # fmt: skip
    return Table(columns, rows)


def _percent(share: float | None) -> str:
    return "" if share is None else f"{100 * share:.1f}"


@styled
def scaler_figure(coordination: Coordination) -> Picture | None:
    """Scalers of all participants as dots with whiskers; a row of panels per participant."""
    calibrations = coordination.calibrations
    if not calibrations:
        return None
    groups = list(next(iter(calibrations.values()))["groups"])
    rows = len(calibrations)
    drawing = Drawing(rows, 2, (11.5, 0.7 + (0.42 * len(groups) + 0.6) * rows), sharey="all")
    for row, (participant, document) in zip(drawing.axes, calibrations.items(), strict=True):
        for axes, (kind, name) in zip(row, KIND_NAMES.items(), strict=True):
            axes.set_title(f"{participant}: scaler of {name}, {coordination.emg_word}", loc="left")
            for position, group in enumerate(groups):
                _draw_scaler(axes, position, document["groups"][group][kind])
                if participant == PREDICTED_PARTICIPANT and group in SCALERS:
                    _mark(axes, SCALERS[group][kind], position + 0.22, "^", PUBLISHED)
            axes.axvline(1.0, color="#bbbbbb", linewidth=1.0, zorder=0)
            _keep_scalers(drawing, axes, {g: document["groups"][g][kind] for g in groups})
    drawing.axes[0, 0].set_yticks(range(len(groups)), [g.replace("_", " ") for g in groups])
    drawing.axes[0, 0].set_ylim(len(groups) - 0.5, -0.5)
    for axes in drawing.axes[-1]:
        axes.set_xlabel(FACTOR)
    drawing.legend(_scaler_entries())
    plant = "Black line: plant that made the simulated EMG. "
    return drawing.finish(
        "scalers",
        f"Scalers calibrated to {coordination.emg_word}, with 90 % intervals; open circles: the "
        f"data do not identify this scaler. {plant if coordination.emg_word != 'EMG' else ''}"
        "Orange: estimate of the paper's problem, in which the scalers also pay for effort and for "
        "their distance from one. Green: published, where printed. Panels have their own scales.",
    )


def _keep_scalers(drawing: Drawing, axes: Axes, entries: Mapping[str, Mapping[str, Any]]) -> None:
    """Numbers of a panel: scalers with the ends of their intervals, and what stands beside them."""
    words = {"across": "muscle group", "along": FACTOR}
    columns = {
        "calibrated": [entry["value"] for entry in entries.values()],
        "90 % interval, lower end": [entry["ci90"][0] for entry in entries.values()],
        "90 % interval, upper end": [entry["ci90"][1] for entry in entries.values()],
        "paper's problem": [entry["paper_problem"] for entry in entries.values()],
    }
    if any("plant" in entry for entry in entries.values()):
        columns["plant"] = [entry.get("plant", np.nan) for entry in entries.values()]
    for name, values in columns.items():
        drawing.keep(axes.get_title(loc="left"), name, list(entries), np.array(values), **words)


def _draw_scaler(axes: Axes, position: float, entry: Mapping[str, Any]) -> None:
    face = CALIBRATED if entry["identifiable"] else "white"
    low, high = entry["ci90"]
    axes.plot([low, high], [position, position], color=CALIBRATED, linewidth=1.6, zorder=3)
    axes.plot(
        entry["value"], position, "o", markersize=6, color=CALIBRATED, markerfacecolor=face,
        zorder=4,
    )  # fmt: skip
    _mark(axes, entry["paper_problem"], position - 0.22, "D", PAPER_PROBLEM)
    if "plant" in entry:
        axes.plot([entry["plant"]] * 2, [position - 0.3, position + 0.3], color=PLANT, zorder=5)


def _mark(axes: Axes, value: float, position: float, marker: str, colour: str) -> None:
    axes.plot(value, position, marker, markersize=4, color=colour, zorder=4)


def _scaler_entries() -> dict[str, dict[str, Any]]:
    dot = {"linestyle": "none", "marker": "o", "color": CALIBRATED}
    return {
        "identifiable": dot,
        "not identifiable": {**dot, "markerfacecolor": "white"},
        "plant": {"linestyle": "none", "marker": "|", "color": PLANT, "markersize": 10},
        "paper's problem": {"linestyle": "none", "marker": "D", "color": PAPER_PROBLEM},
        "published": {"linestyle": "none", "marker": "^", "color": PUBLISHED},
    }
