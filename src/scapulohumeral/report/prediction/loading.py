"""Figures of the glenohumeral joint force: its path in the glenoid, its size, and what changes it.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse

from scapulohumeral.quantities.joint_loading import (
    ANTERIOR_POSTERIOR_LIMIT,
    superior_inferior_limit,
)
from scapulohumeral.quantities.paper import ORTHOLOAD_BW
from scapulohumeral.quantities.prediction_rows import peaks
from scapulohumeral.quantities.rhythm import rhythm_by_plane
from scapulohumeral.report.coordination import Cases, Prediction
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.report.prediction.figures import compared, condition_label
from scapulohumeral.report.tables import number_or_none

PLANE_COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7")
# Half the side of a panel in units of the superior limit: at least, and at most for large shear.
RANGE, FARTHEST = 1.25, 2.5
MARGIN = 1.05
RIM_NOTE = (
    "Point of the glenoid at which the force of the humeral head is directed: shear over "
    "compression, seen from lateral; the ellipse is the rim. Points outside the "
    "panel lie beyond its edge."
)


@styled
def loading_figure(cases: Cases) -> Picture | None:
    """Path of the force in the glenoid, healthy and cuff-limited, and its size over time."""
    about = cases.healthy
    if about is None:
        return None
    shown = compared(cases, about)
    drawing = Drawing(1, 3, (12.5, 4.0), width_ratios=(1, 1, 2.1))
    ellipses, size = drawing.axes[0, :2], drawing.axes[0, 2]
    reach = _reach([prediction for prediction, _ in shown.values()])
    for axes, (label, (prediction, _)) in zip(ellipses, shown.items(), strict=False):
        axes.set_title(f"{label}, w_GH {prediction.condition.w_gh:g}", loc="left")
        _draw_path(drawing, axes, prediction, reach)
    ellipses[1].set_visible(len(shown) > 1)
    size.set_title("size of the joint force", loc="left")
    for label, (prediction, line) in shown.items():
        force = prediction.load.percent_body_weight
        drawing.curve(size, label, prediction.solution.time_s, force, **line)
    _draw_implants(size, about)
    size.set_xlabel("time [s]")
    size.set_ylabel("force [% body weight]")
    size.set_ylim(bottom=0.0)
    drawing.legend(
        {label: line for label, (_, line) in shown.items()}
        | _plane_entries(about)
        | {"instrumented implants, mean ± SD of peaks": {"color": "#555555", "linewidth": 1.2}}
    )
    return drawing.finish(
        f"glenohumeral_force_{cases.participant}",
        f"Participant {cases.participant}. {RIM_NOTE} Right: size of the force. Grey marks: peak "
        "force of instrumented implants (Orthoload database, as quoted by the paper: "
        + ", ".join(f"{plane} plane, n = {n}" for plane, (_, _, n) in ORTHOLOAD_BW.items())
        + ").",
    )


def _draw_implants(axes: Axes, about: Prediction) -> None:
    """Peak forces of implants at the time of the largest force."""
    for plane, nodes in about.planes.items():
        if plane in ORTHOLOAD_BW:
            mean, sd, _ = ORTHOLOAD_BW[plane]
            times = about.solution.time_s[nodes]
            axes.errorbar(
                times[np.argmax(about.load.percent_body_weight[nodes])], mean, sd, fmt="s",
                markersize=4, color="#555555", capsize=4, linewidth=1.2, zorder=3,
            )  # fmt: skip


def _plane_entries(about: Prediction) -> dict[str, dict[str, object]]:
    marker = {"linestyle": "none", "marker": "o", "markersize": 4}
    return {
        f"{plane} plane": {"color": colour, **marker} for plane, colour in _coloured(about.planes)
    }


def _coloured(planes: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Planes with their colours, which come again where there are more planes."""
    return zip(planes, cycle(PLANE_COLOURS), strict=False)


def _reach(predictions: Sequence[Prediction]) -> float:
    """Half the side of panels that hold the paths of all predictions [1]."""
    limit = superior_inferior_limit(predictions[0].record)
    paths = [one.load.path[nodes] for one in predictions for nodes in one.planes.values()]
    largest = float(np.nanmax(np.abs(np.concatenate(paths))))
    return float(np.clip(MARGIN * largest, RANGE * limit, FARTHEST * limit))


def _draw_path(drawing: Drawing, axes: Axes, prediction: Prediction, reach: float) -> None:
    limit = superior_inferior_limit(prediction.record)
    rim = Ellipse(
        (0, 0), 2 * ANTERIOR_POSTERIOR_LIMIT, 2 * limit, facecolor="#f4efe6",
        edgecolor="#555555", linewidth=1.2,
    )  # fmt: skip
    axes.add_patch(rim)
    for plane, colour in _coloured(prediction.planes):
        nodes = prediction.planes[plane]
        superior, posterior = prediction.load.path[nodes].T
        axes.plot(posterior, superior, color=colour, linewidth=0.8, marker="o", markersize=1.8)
        panel = axes.get_title(loc="left")
        times = prediction.solution.time_s[nodes]
        for side, values in (("superior", superior), ("posterior", posterior)):
            words = {"across": "time [s]", "along": "shear over compression [1]"}
            drawing.keep(panel, f"{plane}, {side}", times, values, **words)
    # From lateral the front of a right shoulder is on the right.
    axes.set_xlim(reach, -reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    axes.set_xlabel("posterior ←   → anterior [1]")
    axes.set_ylabel("inferior ←   → superior [1]")


@styled
def sweep_figure(cases: Cases) -> Picture | None:
    """Path of the force in the glenoid for each stability weight (figure of the supplement)."""
    if len(cases.sweep) < 2:
        return None
    count, reach = len(cases.sweep), _reach(cases.sweep)
    drawing = Drawing(1, count, (2.55 * count, 3.4), sharex="all", sharey="all")
    for axes, prediction in zip(drawing.axes[0], cases.sweep, strict=True):
        largest = _largest_eccentricity(prediction)
        where = "inside" if largest <= 1.0 else "outside"
        axes.set_title(f"w_GH {prediction.condition.w_gh:g}: {largest:.2f}, {where}", loc="left")
        _draw_path(drawing, axes, prediction, reach)
    for axes in drawing.axes[0, 1:]:
        axes.set_ylabel("")
    drawing.legend(_plane_entries(cases.sweep[0]))
    return drawing.finish(
        f"sweep_force_{cases.participant}",
        f"Participant {cases.participant}, supraspinatus and infraspinatus without active force. "
        f"{RIM_NOTE} Above each panel: largest distance from the centre during the elevations, "
        "with 1 at the rim.",
    )


def _largest_eccentricity(prediction: Prediction) -> float:
    load = prediction.load
    return max(float(load.eccentricity[nodes].max()) for nodes in prediction.planes.values())


@styled
def capacity_figure(cases: Cases) -> Picture | None:
    """Rhythm, upward rotation and joint force over the capacity of the cuff."""
    if len(cases.graded) < 2:
        return None
    shown = (*cases.graded, *cases.isolated)
    positions = np.array([100 * p.condition.capacity for p in cases.graded])
    isolated = -25.0 * np.arange(1, len(cases.isolated) + 1)
    titles = {
        "peak_upward_rotation_deg": "peak upward rotation [deg]",
        "rhythm": "rhythm, start to 90 deg [1]",
        "peak_gh_force_bw": "peak joint force [% body weight]",
        "max_eccentricity": "largest distance of the force from the centre (rim: 1)",
    }
    drawing = Drawing(1, len(titles), (13.0, 3.3))
    for axes, (key, title) in zip(drawing.axes[0], titles.items(), strict=True):
        axes.set_title(title, loc="left", fontsize=8)
        _draw_by_plane(drawing, axes, cases, key, np.concatenate([positions, isolated]))
        names = [f"{x:.0f}" for x in positions] + [p.condition.name for p in cases.isolated]
        axes.set_xticks([*positions, *isolated], names, fontsize=7)
        axes.set_xlim(106.0, min([0.0, *isolated]) - 12.0)
        axes.set_xlabel("active force of the cuff [%]")
    drawing.axes[0, 3].axhline(1.0, color="#555555", linewidth=0.8)
    drawing.legend(_plane_entries(shown[0]))
    return drawing.finish(
        f"capacity_{cases.participant}",
        f"Participant {cases.participant}: force of supraspinatus and infraspinatus partly lost, "
        f"w_GH {cases.graded[0].condition.w_gh:g}; right of it other losses: "
        + ("; ".join(map(condition_label, cases.isolated)) or "none")
        + ". No line: the rhythm is no number, because the scapula hardly turns upward. Panels "
        "have their own scales, which do not start at zero.",
    )


def _draw_by_plane(
    drawing: Drawing, axes: Axes, cases: Cases, key: str, positions: np.ndarray
) -> None:
    shown = (*cases.graded, *cases.isolated)
    joined = len(cases.graded)
    for plane, colour in _coloured(shown[0].planes):
        values = np.array([quantities(p)[plane][key] for p in shown])
        axes.plot(positions[:joined], values[:joined], "-o", color=colour, markersize=4)
        axes.plot(positions[joined:], values[joined:], "D", color=colour, markersize=4)
        labels = [condition_label(p) for p in shown]
        title = axes.get_title(loc="left")
        drawing.keep(title, f"{plane} plane", labels, values, across="shoulder")


def quantities(prediction: Prediction) -> dict[str, dict[str, float]]:
    """Peaks of a prediction and its rhythm of the whole rise, by plane."""
    limits = {plane: (nodes.start, nodes.stop) for plane, nodes in prediction.planes.items()}
    phases = rhythm_by_plane(prediction.solution.pose, limits)
    rhythms = {phase.plane: phase.shr for phase in phases if phase.phase == "start-90"}
    return {
        plane: {**peaks(prediction.load, prediction.solution.pose, nodes), "rhythm": rhythms[plane]}
        for plane, nodes in prediction.planes.items()
    }


def stability_rows(predictions: Sequence[Prediction]) -> list[tuple[str, ...]]:
    """Rows of a table: condition, plane, peaks and the share of time outside the glenoid."""
    rows: list[tuple[str, ...]] = []
    for prediction in predictions:
        for plane, values in quantities(prediction).items():
            rows.append(
                (
                    prediction.participant,
                    condition_label(prediction),
                    plane,
                    f"{values['peak_upward_rotation_deg']:.1f}",
                    number_or_none(values["rhythm"]),
                    f"{values['peak_gh_force_bw']:.1f}",
                    f"{values['max_eccentricity']:.2f}",
                    f"{100 * values['fraction_outside']:.0f}",
                )
            )
    return rows
