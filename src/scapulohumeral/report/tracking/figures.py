"""Figures of tracked motions: angles, excitations, joint reaction and gimbal lock.

Letters: N nodes, M muscles, G muscle groups.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from scapulohumeral.model.rotations import Array, trial_to_pose
from scapulohumeral.quantities.paper import GIMBAL_MUSCLES
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    SINGULAR_ELEVATION_DEG,
    thorax_angles,
)
from scapulohumeral.report.drawing.curves import (
    group_means,
    on_branch,
    orientation_error,
    unwrap_deg,
)
from scapulohumeral.report.drawing.svg import (
    COLOURS,
    FAILED_LINE,
    LABELS,
    LINES,
    Drawing,
    Picture,
    styled,
)
from scapulohumeral.report.study import Run, TrialRuns

# Names of the columns of `thorax_angles`, and what a positive angle means.
ANGLE_TITLES = (
    "clavicle y: pro- (+), retraction (−)",
    "clavicle z: elevation (+)",
    "clavicle x: backward rotation (+)",
    "scapula y: pro- (+), retraction (−)",
    "scapula z: upward rotation (+)",
    "scapula x: posterior tilt (+)",
    "humerus y: plane of elevation",
    "humerus z: elevation (+)",
    "humerus y': internal rotation (+)",
    "elbow: flexion (+)",
)
# Panels are filled row by row: one column per segment.
PANEL_ORDER = (0, 3, 6, 9, 1, 4, 7, None, 2, 5, 8, None)
ERROR_PANELS = {7: "scapula", 11: "humerus"}

GROUP_NAMES = {
    "trap_scap": "trapezius, scapular",
    "trap_clav": "trapezius, clavicular",
    "lev_scap": "levator scapulae",
    "pect_min": "pectoralis minor",
    "rhomboid": "rhomboids",
    "serr_ant": "serratus anterior",
    "delt_scap": "deltoid, scapular",
    "delt_clav": "deltoid, clavicular",
    "coracobr": "coracobrachialis",
    "infra": "infraspinatus",
    "ter_min": "teres minor",
    "ter_maj": "teres major",
    "supra": "supraspinatus",
    "subscap": "subscapularis",
    "bic_c_l": "biceps, long head",
    "bic_c_b": "biceps, short head",
    "triceps": "triceps, long head",
    "tric_med": "triceps, medial head",
    "tric_lat": "triceps, lateral head",
    "lat_dorsi": "latissimus dorsi",
    "pect_maj_t": "pectoralis major, thoracic",
    "pect_maj_c": "pectoralis major, clavicular",
    "brachiorad": "brachioradialis",
}


def run_line(run: Run) -> dict[str, Any]:
    """Line of a solve: the colour of its formulation, dotted if it failed."""
    line = {"color": COLOURS[run.formulation], **LINES[run.formulation]}
    return {**line, "linestyle": FAILED_LINE} if run.failed else line


def run_label(run: Run) -> str:
    """Name of a solve's formulation, with a warning if it failed."""
    return LABELS[run.formulation] + (" (NOT CONVERGED)" if run.failed else "")


def _recorded_line() -> dict[str, Any]:
    return {"color": COLOURS["recorded"], **LINES["recorded"]}


def _mark_failed(drawing: Drawing, runs: Mapping[str, Run]) -> None:
    failed = [LABELS[r.formulation] for r in runs.values() if r.failed]
    if failed:
        drawing.watermark(f"NOT CONVERGED: {', '.join(failed)}")


@styled
def motion_figure(trial: TrialRuns) -> Picture:
    """Recorded, simulated and published angles of one trial, and orientation errors."""
    drawing = Drawing(3, 4, (12.5, 7.4), sharex="all")
    recorded = unwrap_deg(thorax_angles(trial.any_run.solution.reference_pose))
    for panel, (axes, column) in enumerate(zip(drawing.axes.flat, PANEL_ORDER, strict=True)):
        if column is None:
            _draw_errors(drawing, axes, trial, ERROR_PANELS[panel])
        else:
            axes.set_title(ANGLE_TITLES[column], loc="left")
            _draw_angle(drawing, axes, trial, recorded, column)
        axes.set_ylabel("angle [deg]")
    for axes in drawing.axes[-1]:
        axes.set_xlabel("time [s]")
    entries = {LABELS["recorded"]: _recorded_line()}
    entries |= {run_label(run): run_line(run) for run in trial.runs.values()}
    if trial.published:
        entries[LABELS["published"]] = {"color": COLOURS["published"], **LINES["published"]}
    drawing.legend(entries)
    _mark_failed(drawing, trial.runs)
    return drawing.finish(
        f"motion_{trial.participant}_{trial.trial}",
        "Segment angles in the thorax: clavicle and scapula in the body-fixed sequence Y-Z-X, "
        "humerus in Y-Z-Y (DAS3 axes: x to the right, y up, z to the back). The first and third "
        f"humeral angle are left out below {SINGULAR_ELEVATION_DEG:g} deg of elevation, where the "
        "sequence is singular. Last column, lower two panels: angle of the one rotation between "
        "recorded and simulated orientation, which no sequence distorts.",
    )


def _draw_angle(
    drawing: Drawing, axes: Axes, trial: TrialRuns, recorded: Array, column: int
) -> None:
    time_s = trial.any_run.solution.time_s
    drawing.curve(axes, LABELS["recorded"], time_s, recorded[:, column], **_recorded_line())
    motions = [
        (run_label(run), run.solution.time_s, run.solution.pose, run_line(run))
        for run in trial.runs.values()
    ]
    if trial.published:
        line = {"color": COLOURS["published"], **LINES["published"]}
        pose = trial_to_pose(trial.published.angles_rad)
        motions.append((LABELS["published"], trial.published.time_s, pose, line))
    for label, times, pose, line in motions:
        angles = on_branch(thorax_angles(pose), times, recorded, time_s)
        drawing.curve(axes, label, times, angles[:, column], **line)


def _draw_errors(drawing: Drawing, axes: Axes, trial: TrialRuns, segment: str) -> None:
    axes.set_title(f"{segment}: rotation from recorded", loc="left")
    for run in trial.runs.values():
        s = run.solution
        error = orientation_error(s.pose, s.reference_pose, segment)
        drawing.curve(axes, run_label(run), s.time_s, error, **run_line(run))
    axes.set_ylim(bottom=0.0)


@styled
def excitation_figure(trial: TrialRuns) -> Picture:
    """Mean excitation of the elements of each muscle group in one trial."""
    means = {
        name: group_means(run.solution.excitation, trial.groups) for name, run in trial.runs.items()
    }
    groups = list(next(iter(means.values())))
    columns = 5
    rows = -(-len(groups) // columns)
    drawing = Drawing(rows, columns, (12.5, 1.55 * rows + 0.5), sharex="all", sharey="all")
    for axes, group in zip(drawing.panels(len(groups)), groups, strict=True):
        count = int(np.count_nonzero(trial.groups == group))
        axes.set_title(f"{GROUP_NAMES.get(group, group)} ({count})", loc="left")
        for name, run in trial.runs.items():
            curve = means[name][group]
            drawing.curve(axes, run_label(run), run.solution.time_s, curve, **run_line(run))
    drawing.axes[0, 0].set_ylim(bottom=0.0)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel("excitation [1]")
    drawing.legend({run_label(run): run_line(run) for run in trial.runs.values()})
    _mark_failed(drawing, trial.runs)
    return drawing.finish(
        f"excitation_{trial.participant}_{trial.trial}",
        "Excitation, mean over the elements of each group (number of elements in brackets), "
        "0 to 1; all panels share the axes.",
    )


@styled
def gimbal_figure(trial: TrialRuns) -> Picture:
    """Excitation and activation of the paper's two elements, nodes near gimbal lock marked."""
    drawing = Drawing(3, 2, (11.0, 7.0), sharex="all")
    for row, muscle in enumerate(GIMBAL_MUSCLES):
        for axes, signal in zip(drawing.axes[row], ("excitation", "activation"), strict=True):
            axes.set_title(f"{muscle}: {signal}", loc="left")
            axes.set_ylabel(f"{signal} [1]")
            for run in trial.runs.values():
                s = run.solution
                values = getattr(s, signal)[:, list(s.muscles).index(muscle)]
                drawing.curve(axes, run_label(run), s.time_s, values, **run_line(run))
            axes.set_ylim(bottom=0.0)
    _draw_approach(drawing, trial)
    for axes in drawing.axes.flat:
        _shade_singular(axes, trial)
    for axes in drawing.axes[-1]:
        axes.set_xlabel("time [s]")
    entries = {LABELS["recorded"]: _recorded_line()}
    drawing.legend(entries | {run_label(run): run_line(run) for run in trial.runs.values()})
    _mark_failed(drawing, trial.runs)
    return drawing.finish(
        f"gimbal_lock_{trial.participant}_{trial.trial}",
        f"Participant {trial.participant}, {trial.trial} plane. Shaded: recorded |GH_z| below "
        f"{SINGULAR_ELEVATION_DEG:g} deg, close to the singularity of the glenohumeral sequence "
        "Y-Z-Y. Lowest row: GH_z itself, and the fastest muscle element of each solve.",
    )


def _draw_approach(drawing: Drawing, trial: TrialRuns) -> None:
    """Second glenohumeral angle, and the largest activation step of any element per interval."""
    angle, step = drawing.axes[2]
    angle.set_title("GH_z, second angle of Y-Z-Y, magnitude", loc="left")
    angle.set_ylabel("|GH_z| [deg]")
    step.set_title("largest activation step of any element", loc="left")
    step.set_ylabel("per interval [1]")
    recorded = np.rad2deg(trial.any_run.solution.reference_rad[:, ELEVATION_COLUMN])
    times = trial.any_run.solution.time_s
    drawing.curve(angle, LABELS["recorded"], times, np.abs(recorded), **_recorded_line())
    for run in trial.runs.values():
        s = run.solution
        gh_z = np.abs(np.rad2deg(s.angles_rad[:, ELEVATION_COLUMN]))
        drawing.curve(angle, run_label(run), s.time_s, gh_z, **run_line(run))
        largest = np.abs(np.diff(s.activation, axis=0)).max(axis=1)
        drawing.curve(step, run_label(run), s.time_s[1:], largest, **run_line(run))
    step.set_ylim(bottom=0.0)


def _shade_singular(axes: Axes, trial: TrialRuns) -> None:
    s = trial.any_run.solution
    near = np.abs(np.rad2deg(s.reference_rad[:, ELEVATION_COLUMN])) < SINGULAR_ELEVATION_DEG
    half = 0.5 * (s.time_s[1] - s.time_s[0])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(int)))
    for first, end in edges.reshape(-1, 2):
        axes.axvspan(s.time_s[first] - half, s.time_s[end - 1] + half, color="#f7edd0", zorder=0)


@styled
def reaction_figure(trials: list[TrialRuns]) -> Picture:
    """Magnitude of the glenohumeral reaction in every trial."""
    columns = min(3, len(trials))
    rows = -(-len(trials) // columns)
    drawing = Drawing(rows, columns, (3.6 * columns + 1.5, 2.2 * rows + 0.6), sharey="all")
    for axes, trial in zip(drawing.panels(len(trials)), trials, strict=True):
        axes.set_title(f"{trial.participant}, {trial.trial} plane", loc="left")
        for run in trial.runs.values():
            force = np.linalg.norm(run.solution.reaction_N, axis=1)
            drawing.curve(axes, run_label(run), run.solution.time_s, force, **run_line(run))
    # A limit of one panel is that of all. Set before all are drawn, it would crop later peaks.
    drawing.axes.flat[0].set_ylim(bottom=0.0)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel("reaction [N]")
    drawing.legend({run_label(r): run_line(r) for t in trials for r in t.runs.values()})
    return drawing.finish(
        "reaction",
        "Magnitude of the force of the glenoid on the humeral head.",
    )
