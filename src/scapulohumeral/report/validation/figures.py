"""Daily tasks with generic and with calibrated muscles, against EMG.

Letters: N nodes, C channels.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from scapulohumeral.quantities.paper import PREDICTED_PARTICIPANT, VALIDATION_RMSE
from scapulohumeral.report.coordination import Coordination
from scapulohumeral.report.coordination_targets import channel_reductions
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.report.prediction.figures import EMG_LINE, GENERIC, HEALTHY
from scapulohumeral.report.tables import Table, named_rows

LINES = {"generic": GENERIC, "calibrated": HEALTHY}
SHOWN_TASK = "shelf_reaching"


def reduction_table(coordination: Coordination) -> Table:
    """Error per channel over all daily tasks, next to the published one."""
    increase = coordination.targets["validation"]["increase"]
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for row in named_rows(channel_reductions(coordination.validation)):
        if not row.reduction >= -increase:
            flagged.add(len(rows))
        known = row.participant == PREDICTED_PARTICIPANT and row.channel in VALIDATION_RMSE
        before, after = VALIDATION_RMSE[row.channel] if known else (np.nan, np.nan)
        rows.append(
            (
                row.participant,
                row.channel.replace("_", " "),
                _number(row.generic),
                _number(row.calibrated),
                "" if np.isnan(row.reduction) else f"{100 * row.reduction:+.1f}",
                f"{before:.3f} → {after:.3f}" if known else "not printed",
                f"{100 * (1 - after / before):+.1f}" if known else "",
            )
        )
    columns = (
        "participant", "channel", "generic", "calibrated", "reduction [%]", "published",
        "published reduction [%]",
    )  # fmt: skip
    return Table(columns, rows, frozenset(flagged))


def solved_again(validation: pd.DataFrame) -> list[str]:
    """Tasks that follow the recording of another task, with another load in the hand."""
    again = validation[validation.task != validation.recording]
    pairs = again[["task", "recording"]].drop_duplicates().itertuples(index=False)
    return [f"{task} is that of {first}".replace("_", " ") for task, first in pairs]


def task_table(coordination: Coordination) -> Table:
    """Error per channel and daily task."""
    rows: list[tuple[str, ...]] = []
    flagged: set[int] = set()
    for row in named_rows(coordination.validation):
        if np.isnan(row.rmse_generic) or np.isnan(row.rmse_calibrated):
            flagged.add(len(rows))
        numbers = map(_number, (row.rmse_generic, row.rmse_calibrated))
        reduction = "" if np.isnan(row.reduction) else f"{100 * row.reduction:+.1f}"
        names = (row.participant, row.task.replace("_", " "), row.channel.replace("_", " "))
        rows.append((*names, *numbers, reduction))
    columns = ("participant", "task", "channel", "generic", "calibrated", "reduction [%]")
    return Table(columns, rows, frozenset(flagged))


def _number(error: float) -> str:
    """An error in a table; that of a failed solve, or without EMG, is not a number."""
    return "no result" if np.isnan(error) else f"{error:.3f}"


@styled
def error_figure(coordination: Coordination) -> Picture:
    """Errors of every channel and task, generic and calibrated side by side."""
    table = coordination.validation
    trials = table[["participant", "task"]].drop_duplicates().to_numpy().tolist()
    columns = min(4, len(trials))
    rows = -(-len(trials) // columns)
    size = (3.0 * columns + 1.6, 2.9 * rows + 0.5)
    error = f"root mean square of excitation minus {coordination.emg_word} [1]"
    drawing = Drawing(rows, columns, size, sharex="all", sharey="all")
    for axes, (participant, task) in zip(drawing.panels(len(trials)), trials, strict=True):
        part = table[(table.participant == participant) & (table.task == task)]
        axes.set_title(f"{participant}, {task.replace('_', ' ')}", loc="left")
        names = part.channel.to_list()
        positions = np.arange(len(names))
        axes.hlines(positions, part.rmse_generic, part.rmse_calibrated, color="#bbbbbb", zorder=1)
        for label, line in LINES.items():
            values = part[f"rmse_{label}"].to_numpy()
            axes.plot(values, positions, "o", color=line["color"], markersize=4.5)
            title = axes.get_title(loc="left")
            drawing.keep(title, label, names, values, across="channel", along=error)
        axes.set_yticks(positions, [name.replace("_", " ") for name in names])
    drawing.axes[0, 0].set_ylim(len(names) - 0.5, -0.5)
    drawing.axes[0, 0].set_xlim(left=0.0)
    drawing.figure.supxlabel(error)
    marker = {"linestyle": "none", "marker": "o"}
    drawing.legend({k: {"color": line["color"], **marker} for k, line in LINES.items()})
    return drawing.finish(
        "validation_errors",
        f"Excitations of daily tasks against {coordination.emg_word}, with generic and with "
        "calibrated muscles. No task entered the calibration.",
    )


@styled
def task_figure(coordination: Coordination, participant: str, task: str) -> Picture | None:
    """Excitations of one daily task with both parameter sets, and EMG (figure of the paper)."""
    channels, envelopes = coordination.channels, coordination.envelopes(participant, task)
    solutions = {k: coordination.tasks.get((participant, task, k)) for k in LINES}
    solved = {k: s for k, s in solutions.items() if s and s.optimal}
    if channels is None or envelopes is None or not solved:
        return None
    drawing = Drawing(2, 4, (12.5, 4.8), sharex="all")
    for index, (axes, name) in enumerate(
        zip(drawing.panels(len(channels.names)), channels.names, strict=True)
    ):
        axes.set_title(name.replace("_", " "), loc="left")
        times = next(iter(solved.values())).time_s
        emg = envelopes.at(times)[:, index]
        drawing.curve(axes, coordination.emg_word, times, emg, **EMG_LINE)
        for label, solution in solved.items():
            row = channels.matrix(solution.muscles.tolist())[index]
            drawing.curve(axes, label, solution.time_s, solution.excitation @ row, **LINES[label])
        axes.set_ylim(bottom=0.0)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel(f"excitation, {coordination.emg_word} over MVC [1]")
    lines = {label: LINES[label] for label in solved}
    drawing.legend({coordination.emg_word: EMG_LINE, **lines})
    missing = [label for label in LINES if label not in solved]
    return drawing.finish(
        f"task_{participant}_{task}",
        f"Participant {participant}, {task.replace('_', ' ')}: {coordination.emg_word} and the "
        "excitations with generic and with calibrated muscles (mean over the elements of each "
        "channel). Panels have their own scales."
        + "".join(f" Not converged and not drawn: {name} muscles." for name in missing),
    )


def task_figures(coordination: Coordination) -> list[Picture]:
    """The task that the paper shows first, then the others."""
    trials = sorted(
        dict.fromkeys((participant, task) for participant, task, _ in coordination.tasks),
        key=lambda trial: trial[1] != SHOWN_TASK,
    )
    figures = [task_figure(coordination, *trial) for trial in trials]
    return [figure for figure in figures if figure is not None]
