"""Figures of how the solver performed."""

from __future__ import annotations

import numpy as np

from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN
from scapulohumeral.report.drawing.curves import passes_gimbal_lock
from scapulohumeral.report.drawing.svg import COLOURS, LABELS, Drawing, Picture, styled
from scapulohumeral.report.study import Study, TrialRuns
from scapulohumeral.report.tracking.figures import run_label, run_line
from scapulohumeral.report.words import BESIDE_OTHERS

# Rows of the two formulations are set apart, so that equal values do not hide each other.
ROW_SHIFT = {"quaternion": -0.14, "euler": 0.14}
MEASURES = {"iterations": "iterations", "seconds": "wall time [s]"}
INFEASIBILITIES = {
    "primal_infeasibility": "largest constraint violation",
    "dual_infeasibility": "largest dual infeasibility",
}


@styled
def performance_figure(study: Study) -> Picture:
    """Iterations and wall time of every solve, side by side for both formulations."""
    height = 0.3 * len(study.trials) + 1.3
    drawing = Drawing(1, 2, (11.0, height), sharey="all")
    labels = [_trial_label(trial) for trial in study.trials]
    for axes, (key, label) in zip(drawing.axes[0], MEASURES.items(), strict=True):
        axes.set_title(label, loc="left")
        for formulation, shift in ROW_SHIFT.items():
            rows = [i for i, t in enumerate(study.trials) if formulation in t.runs]
            runs = [study.trials[i].runs[formulation] for i in rows]
            values = np.array([run.summary[key] for run in runs])
            faces = ["none" if run.failed else COLOURS[formulation] for run in runs]
            places = np.array(rows) + shift
            axes.scatter(
                values, places, s=42, facecolors=faces, edgecolors=COLOURS[formulation], zorder=3
            )
            names = [labels[i] for i in rows]
            drawing.keep(label, LABELS[formulation], names, values, across="recording")
        axes.set_xlim(left=0.0)
        axes.set_xlabel(label)
    drawing.axes[0, 0].set_yticks(range(len(labels)), labels)
    drawing.axes[0, 0].set_ylim(len(labels) - 0.4, -0.6)
    marker = {"linestyle": "none", "marker": "o"}
    drawing.legend(
        {LABELS[f]: {"color": COLOURS[f], **marker} for f in ROW_SHIFT}
        | {"not converged": {"color": "#555555", "markerfacecolor": "none", **marker}}
    )
    return drawing.finish(
        "performance",
        "Iterations and wall time of each solve, all phases together. * marks recordings that come "
        f"close to gimbal lock of the glenohumeral sequence Y-Z-Y. Times {BESIDE_OTHERS}.",
    )


def _trial_label(trial: TrialRuns) -> str:
    recorded = trial.any_run.solution.reference_rad[:, ELEVATION_COLUMN]
    return f"{trial.participant} {trial.trial}" + (" *" if passes_gimbal_lock(recorded) else "")


@styled
def convergence_figure(study: Study) -> Picture:
    """Infeasibilities by iteration, one line per solve."""
    drawing = Drawing(1, 2, (11.0, 3.6), sharex="all")
    for axes, (key, label) in zip(drawing.axes[0], INFEASIBILITIES.items(), strict=True):
        axes.set_title(label, loc="left")
        axes.set_yscale("log")
        axes.set_xlabel("iteration, phases one after the other")
        axes.set_ylabel("as reported by IPOPT [1]")
        for run in study.runs:
            values = np.array([step[key] for step in run.summary["history"]])
            shown = np.where(values > 0.0, values, np.nan)
            line = {**run_line(run), "linewidth": 0.8, "alpha": 0.8}
            drawing.curve(axes, run.name, np.arange(len(shown)), shown, **line)
    drawing.legend({run_label(run): run_line(run) for run in study.runs})
    return drawing.finish(
        "convergence",
        "How each solve converged. The Gauss-Newton phase, on a coarse mesh, finds the region of "
        "the optimum; infeasibilities jump where a solution goes to a finer mesh. The exact "
        "Hessian, started from there, ends quadratically.",
    )
