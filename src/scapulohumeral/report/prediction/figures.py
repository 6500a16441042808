"""Figures of predicted motions: angles over time and over elevation, excitations against EMG.

Letters: N nodes, C channels.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes

from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import Array, trial_to_pose
from scapulohumeral.quantities.paper import COMPOSITE_ELEVATIONS_S
from scapulohumeral.quantities.population import CITATION, UPWARD_ROTATION, healthy_band
from scapulohumeral.quantities.rhythm import rising_part
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    SINGULAR_COLUMNS,
    SINGULAR_ELEVATION_DEG,
    thorax_angles,
)
from scapulohumeral.report.coordination import Cases, Coordination, Prediction
from scapulohumeral.report.drawing.curves import on_branch, unwrap_deg
from scapulohumeral.report.drawing.svg import COLOURS, LINES, Drawing, Picture, styled
from scapulohumeral.report.tracking.figures import ANGLE_TITLES, GROUP_NAMES

HEALTHY: dict[str, Any] = {"color": "#0072b2", "linewidth": 1.5, "zorder": 5}
CUFF: dict[str, Any] = {"color": "#d55e00", "linewidth": 1.5, "zorder": 5}
GENERIC: dict[str, Any] = {"color": "#7a5195", "linewidth": 1.3, "zorder": 4}
TRACKED = {"color": COLOURS["recorded"], **LINES["recorded"]}
EMG_LINE: dict[str, Any] = {"color": "#8c8c8c", "linewidth": 2.4, "alpha": 0.7, "zorder": 2}
PUBLISHED = {"linewidth": 0.9, "linestyle": (0, (4, 2)), "zorder": 3}
BAND: dict[str, Any] = {"color": "#dfe9d8", "linewidth": 0.0, "zorder": 0}
BAND_LABEL = "healthy shoulders, other studies"
TRACKED_LABEL = "tracked motion"
ELEVATION, UPWARD = "thoracohumeral elevation [deg]", "scapular upward rotation [deg]"
PUBLISHED_LINES = {
    "healthy": ("published, healthy", {**PUBLISHED, "color": "#009e73"}),
    "rc_limited": ("published, cuff-limited", {**PUBLISHED, "color": "#cc79a7"}),
}
# Panels row by row, a column per segment as in the paper.
PANELS = (0, 3, 6, 1, 4, 7, 2, 5, 8)


@dataclass(frozen=True, eq=False)
class Curves:
    """Angles (N, 10) [deg] of one motion over time, and the line that draws them."""

    label: str
    time_s: Array
    angles: Array
    line: Mapping[str, Any]


def condition_label(prediction: Prediction) -> str:
    """A condition in words."""
    condition = prediction.condition
    weight = f"w_GH {condition.w_gh:g}"
    if not prediction.limited:
        stiffness = condition.girdle_stiffness_Nm_per_rad
        joints = "" if stiffness is None else f", girdle joints at {stiffness:g} N m/rad"
        return f"healthy, {condition.parameters} muscles{joints}, {weight}"
    return f"{muscle_names(prediction)} at {100 * condition.capacity:.0f} %, {weight}"


def muscle_names(prediction: Prediction) -> str:
    """Muscles that the condition limits, in words."""
    return " and ".join(GROUP_NAMES.get(m, m) for m in prediction.condition.muscles)


def predicted(prediction: Prediction, label: str, line: Mapping[str, Any]) -> Curves:
    """Curves of a prediction."""
    return Curves(label, prediction.solution.time_s, prediction.angles, line)


def tracked(prediction: Prediction) -> Curves:
    """Curves of the composite of tracked motions, whose humerus the prediction follows."""
    s = prediction.solution
    angles = unwrap_deg(thorax_angles(s.reference_pose))
    return Curves(TRACKED_LABEL, s.time_s, angles, TRACKED)


def published(cases: Cases) -> list[Curves]:
    """Curves of the published predictions of this participant, on the clock of ours."""
    curves = []
    for name, (label, line) in PUBLISHED_LINES.items():
        if name not in cases.published:
            continue
        motion = cases.published[name]
        time_s, angles = published_angles(cases, motion)
        curves.append(Curves(label, time_s, angles, line))
    return curves


def published_angles(cases: Cases, motion: Motion) -> tuple[Array, Array]:
    """Times (T,) [s] and angles (T, 10) [deg] of a published prediction.

    Its elevations are put at the times of ours; only the pauses, which are shorter there, stretch.
    What lies outside of the elevations of this study is left out.
    """
    about = cases.healthy
    if about is None:
        return np.zeros(0), np.zeros((0, 10))
    planes = about.planes
    times, angles = [np.zeros(0)], [np.zeros((0, 10))]
    for known in _published_runs(planes):
        theirs = np.concatenate([COMPOSITE_ELEVATIONS_S[plane] for plane in known])
        ours = np.concatenate([about.solution.time_s[planes[plane]][[0, -1]] for plane in known])
        inside = (motion.time_s >= theirs[0]) & (motion.time_s <= theirs[-1] + 0.01)
        times.append(np.interp(motion.time_s[inside], theirs, ours))
        angles.append(thorax_angles(trial_to_pose(motion.angles_rad[inside])))
    return np.concatenate(times), np.concatenate(angles)


def _published_runs(planes: Iterable[str]) -> list[list[str]]:
    """Planes of ours that follow one another in the published motion, too, run by run."""
    order = list(COMPOSITE_ELEVATIONS_S)
    runs: list[list[str]] = []
    for plane in filter(order.__contains__, planes):
        if runs and order.index(plane) == order.index(runs[-1][-1]) + 1:
            runs[-1].append(plane)
        else:
            runs.append([plane])
    return runs


def shades(count: int) -> list[Any]:
    """Colours of an ordered set, from light to dark."""
    return [mpl.colormaps["viridis_r"](x) for x in np.linspace(0.12, 0.95, count)]


def prediction_kinematics(cases: Cases, note: str = "") -> Picture | None:
    """Healthy against cuff-limited prediction (figure of the paper).

    ``note`` says in the caption what the tracked motion is.
    """
    if cases.healthy is None:
        return None
    lines = [predicted(cases.healthy, "predicted, healthy", HEALTHY)]
    if cases.cuff is not None:
        lines.append(predicted(cases.cuff, "predicted, cuff-limited", CUFF))
    loss = "supraspinatus and infraspinatus without active force, at the paper's w_GH."
    return kinematics_figure(
        f"prediction_{cases.participant}",
        cases.healthy,
        [*lines, *published(cases)],
        "Predicted motion of clavicle and scapula; only the humerus is tracked. Healthy: "
        f"{cases.healthy.condition.parameters} muscles"
        + (f"; cuff-limited: {loss}" if cases.cuff is not None else ".")
        + note,
    )


def calibration_effect(cases: Cases) -> Picture | None:
    """Generic against calibrated muscles (figure of the paper's supplement)."""
    if cases.healthy is None or cases.generic is None:
        return None
    return kinematics_figure(
        f"generic_calibrated_{cases.participant}",
        cases.healthy,
        [
            predicted(cases.healthy, "predicted, calibrated", HEALTHY),
            predicted(cases.generic, "predicted, generic", GENERIC),
            *[curves for curves in published(cases) if curves.label == "published, healthy"],
        ],
        "Healthy shoulder predicted with generic and with calibrated muscles; the published one "
        "has calibrated muscles.",
    )


def sweep_kinematics(cases: Cases) -> Picture | None:
    """Cuff-limited predictions for all stability weights (figure of the paper's supplement)."""
    if cases.healthy is None or len(cases.sweep) < 2:
        return None
    lines = [predicted(cases.healthy, "healthy", {**HEALTHY, "linestyle": (0, (5, 1.5))})]
    for prediction, colour in zip(cases.sweep, shades(len(cases.sweep)), strict=True):
        label = f"w_GH {prediction.condition.w_gh:g}"
        lines.append(predicted(prediction, label, {"color": colour, "linewidth": 1.2, "zorder": 4}))
    return kinematics_figure(
        f"sweep_{cases.participant}",
        cases.healthy,
        lines,
        "Cuff-limited prediction at each weight of joint stability, w_GH, against the healthy one.",
    )


@styled
def kinematics_figure(
    name: str, about: Prediction, lines: Sequence[Curves], caption: str
) -> Picture:
    """Angles of clavicle, scapula and humerus in the thorax over the composite motion.

    Parameters
    ----------
    name : of the figure
    about : prediction whose tracked motion, planes and pauses are shown
    lines : what is drawn over them
    caption : first sentences of the caption
    """
    drawing = Drawing(3, 3, (12.5, 7.6), sharex="all")
    reference = tracked(about)
    for axes, column in zip(drawing.axes.flat, PANELS, strict=True):
        axes.set_title(ANGLE_TITLES[column], loc="left")
        _draw_band(axes, about, column)
        for curves in (reference, *lines):
            angles = on_branch(curves.angles, curves.time_s, reference.angles, reference.time_s)
            if column in SINGULAR_COLUMNS:
                angles[_in_pauses(about, curves.time_s), column] = np.nan
            drawing.curve(axes, curves.label, curves.time_s, angles[:, column], **curves.line)
        _mark_pauses(axes, about)
        axes.set_ylabel("angle [deg]")
    _name_planes(drawing, about)
    for axes in drawing.axes[-1]:
        axes.set_xlabel("time [s]")
    entries = {curves.label: curves.line for curves in (reference, *lines)}
    drawing.legend({**entries, BAND_LABEL: {"color": BAND["color"], "linewidth": 7.0}})
    return drawing.finish(
        name,
        f"Participant {about.participant}. {caption} Angles in the thorax, sequences as in "
        "tracking; the first and third angle of the humerus are left out below "
        f"{SINGULAR_ELEVATION_DEG:g} deg of elevation and in the pauses between the planes (grey), "
        "where the arm hangs close to the singularity and may turn at will. "
        f"Green band, while the arm rises: {CITATION}.{_published_note(lines)}",
    )


def _published_note(lines: Sequence[Curves]) -> str:
    """How published curves came to the clock and the arm of ours; empty without them."""
    labels = {label for label, _ in PUBLISHED_LINES.values()}
    if labels.isdisjoint(curves.label for curves in lines):
        return ""
    return (
        " Published curves belong to another motion of the arm: elevations of other height and "
        "speed, stretched in time so that each begins and ends with the one here."
    )


def _in_pauses(about: Prediction, time_s: Array) -> Array:
    """Which times (T,) lie in no elevation, as truth values (T,)."""
    outside = np.ones(len(time_s), dtype=bool)
    for nodes in about.planes.values():
        first, last = about.solution.time_s[nodes][[0, -1]]
        outside &= (time_s < first - 1e-9) | (time_s > last + 1e-9)
    return outside


def _draw_band(axes: Axes, about: Prediction, column: int) -> None:
    elevation = about.angles[:, ELEVATION_COLUMN]
    for plane, nodes in about.planes.items():
        rise = rising_part(elevation[nodes])
        band = healthy_band(plane, column, elevation[nodes][rise])
        if band is not None:
            times = about.solution.time_s[nodes][rise]
            axes.fill_between(times, band.low, band.high, **BAND)


def _mark_pauses(axes: Axes, about: Prediction) -> None:
    times = about.solution.time_s
    for start, end in pauses(about):
        axes.axvspan(times[start], times[end], color="#f2f2f2", linewidth=0.0, zorder=-1)


def pauses(about: Prediction) -> list[tuple[int, int]]:
    """Last node of each elevation but the last, and first node of the next."""
    planes = list(about.planes.values())
    return [
        (before.stop - 1, after.start)
        for before, after in zip(planes[:-1], planes[1:], strict=True)
    ]


def _name_planes(drawing: Drawing, about: Prediction) -> None:
    """Names of the planes above the panels of the first row, between them and their titles."""
    for axes in drawing.axes[0]:
        axes.set_title(axes.get_title(loc="left"), loc="left", pad=15.0)
        for plane, nodes in about.planes.items():
            middle = about.solution.time_s[nodes].mean()
            axes.text(
                middle, 1.01, plane, transform=axes.get_xaxis_transform(), ha="center", va="bottom",
                fontsize=7.5, color="#666666",
            )  # fmt: skip


@styled
def upward_rotation_figure(cases: Cases, note: str = "") -> Picture | None:
    """Upward rotation over elevation while the arm rises, a panel per plane; `note` as above."""
    about = cases.healthy
    if about is None:
        return None
    lines = _headline_curves(cases, about)
    drawing = Drawing(1, len(about.planes), (12.5, 3.6), sharey="all")
    for axes, (plane, nodes) in zip(drawing.axes[0], about.planes.items(), strict=True):
        axes.set_title(f"{plane} plane", loc="left")
        grid = np.linspace(0.0, 120.0, 121)
        band = healthy_band(plane, UPWARD_ROTATION, grid)
        if band is not None:
            axes.fill_between(grid, band.low, band.high, **BAND)
        limits = about.solution.time_s[nodes]
        for curves in lines:
            part = (curves.time_s >= limits[0] - 1e-9) & (curves.time_s <= limits[-1] + 1e-9)
            elevation = curves.angles[part, ELEVATION_COLUMN]
            rise = rising_part(elevation)
            upward = curves.angles[part, UPWARD_ROTATION][rise]
            axes.plot(elevation[rise], upward, **curves.line)
            numbers = _at_whole_degrees(elevation[rise], upward)
            drawing.keep(f"{plane} plane", curves.label, *numbers, across=ELEVATION, along=UPWARD)
        axes.set_xlabel(ELEVATION)
    drawing.axes[0, 0].set_ylabel(UPWARD)
    drawing.legend(
        {curves.label: curves.line for curves in lines}
        | {BAND_LABEL: {"color": BAND["color"], "linewidth": 7.0}}
    )
    return drawing.finish(
        f"upward_rotation_{cases.participant}",
        f"Participant {cases.participant}: upward rotation of the scapula over elevation of "
        "the arm, rise only. The rhythm is the slope: on a line of rhythm r, upward rotation grows "
        f"by 1 deg per r + 1 deg of elevation.{note} Green band: {CITATION}."
        + (" Published curves belong to another motion of the arm." if published(cases) else ""),
    )


def _headline_curves(cases: Cases, about: Prediction) -> list[Curves]:
    """Tracked motion, healthy, generic and cuff-limited prediction, and the published ones."""
    chosen = (
        (about, "predicted, healthy", HEALTHY),
        (cases.generic, "predicted, generic", GENERIC),
        (cases.cuff, "predicted, cuff-limited", CUFF),
    )
    lines = [predicted(p, label, line) for p, label, line in chosen if p is not None]
    return [tracked(about), *lines, *published(cases)]


def _at_whole_degrees(elevation: Array, upward: Array) -> tuple[Array, Array]:
    """The curve where it first reaches whole degrees of elevation: comparable numbers."""
    reached = np.maximum.accumulate(elevation)
    first = np.concatenate([[True], np.diff(reached) > 0])
    degrees = np.arange(np.ceil(reached[0]), np.floor(reached[-1]) + 1.0)
    return degrees, np.interp(degrees, reached[first], upward[first])


def compared(cases: Cases, healthy: Prediction) -> dict[str, tuple[Prediction, dict[str, Any]]]:
    """The paper's two shoulders by name, each with its line; the second only if it was solved."""
    shown = {"healthy": (healthy, HEALTHY)}
    if cases.cuff is not None:
        shown["cuff-limited"] = (cases.cuff, CUFF)
    return shown


@styled
def prediction_excitations(
    coordination: Coordination, cases: Cases, trial_times: Mapping[str, Array]
) -> Picture | None:
    """Excitations of the healthy and the cuff-limited prediction against EMG (figure of the paper).

    Parameters
    ----------
    trial_times : mesh of each tracked elevation on its own clock, by plane [s]
    """
    about, channels = cases.healthy, coordination.channels
    if about is None or channels is None:
        return None
    if all(coordination.envelopes(cases.participant, plane) is None for plane in about.planes):
        return None
    shown = compared(cases, about)
    drawing = Drawing(2, 4, (12.5, 5.0), sharex="all")
    matrix = channels.matrix(about.solution.muscles.tolist())
    for row, (axes, name) in enumerate(
        zip(drawing.panels(len(channels.names)), channels.names, strict=True)
    ):
        axes.set_title(name.replace("_", " "), loc="left")
        _mark_pauses(axes, about)
        _draw_emg(drawing, axes, coordination, about, trial_times, row)
        for label, (prediction, line) in shown.items():
            excitation = prediction.solution.excitation @ matrix[row]
            drawing.curve(axes, label, prediction.solution.time_s, excitation, **line)
        axes.set_ylim(bottom=0.0)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel(f"excitation, {coordination.emg_word} over MVC [1]")
    entries = {coordination.emg_word: EMG_LINE}
    drawing.legend(entries | {label: line for label, (_, line) in shown.items()})
    return drawing.finish(
        f"prediction_emg_{cases.participant}",
        f"Participant {cases.participant}: excitation predicted for each channel (mean of its "
        f"elements) and {coordination.emg_word} of the same elevations. Panels have their own "
        "scales. "
        "No EMG is defined in the pauses (grey). It belongs to the healthy shoulder with the "
        "tracked scapula; in a prediction the scapula moves differently.",
    )


def _draw_emg(
    drawing: Drawing,
    axes: Axes,
    coordination: Coordination,
    about: Prediction,
    trial_times: Mapping[str, Array],
    channel: int,
) -> None:
    for plane, nodes in about.planes.items():
        envelopes = coordination.envelopes(about.participant, plane)
        if envelopes is not None:
            values = envelopes.at(trial_times[plane])[:, channel]
            label = f"{coordination.emg_word}, {plane}"
            drawing.curve(axes, label, about.solution.time_s[nodes], values, **EMG_LINE)
