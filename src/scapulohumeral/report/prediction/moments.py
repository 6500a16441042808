"""Joint moments of the muscles, what they could be at most, and forces of muscle groups.

Letters: N nodes, M muscle elements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.quantities.joint_moments import (
    DIRECTIONS,
    JointMoments,
    joint_moments,
    torque_capacity,
)
from scapulohumeral.quantities.muscle_groups import group_force
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN
from scapulohumeral.report.coordination import Cases, Coordination, Prediction
from scapulohumeral.report.drawing.svg import Drawing, Picture, styled
from scapulohumeral.report.prediction.figures import CUFF, HEALTHY, compared, condition_label
from scapulohumeral.report.tables import Table
from scapulohumeral.report.tracking.figures import GROUP_NAMES
from scapulohumeral.stages.calibration import calibrated_muscles
from scapulohumeral.stages.prediction import limit_capacity

DIRECTION_NAMES = {"SC": "clavicle", "AC": "scapula", "GH": "humerus", "EL": "elbow"}


@dataclass(frozen=True, eq=False)
class MomentsOf:
    """A prediction and the moments of its muscles."""

    label: str
    prediction: Prediction
    moments: JointMoments
    line: Mapping[str, object]


def headline_moments(
    coordination: Coordination, cases: Cases, equations: Sequence[Path]
) -> list[MomentsOf]:
    """Moments of the healthy and the cuff-limited prediction of a participant.

    Parameters
    ----------
    equations : folders of the equations of motion, that of quaternions among them
    """
    geometry = {path.parent.name: path for path in coordination.files.geometry}
    folder = next((path for path in equations if path.name == "quaternion"), None)
    if folder is None or cases.participant not in geometry or not coordination.files.channels:
        return []
    forces = MuscleForces(compiled.load(folder), load_geometry(geometry[cases.participant]))
    chosen = (("healthy", cases.healthy, HEALTHY), ("cuff-limited", cases.cuff, CUFF))
    return [
        MomentsOf(label, prediction, _moments(coordination, prediction, forces), line)
        for label, prediction, line in chosen
        if prediction is not None
    ]


def _moments(
    coordination: Coordination, prediction: Prediction, forces: MuscleForces
) -> JointMoments:
    condition, record = prediction.condition, prediction.record
    files = coordination.files
    scored = {path.stem: path for path in files.calibrations}
    calibration = scored[prediction.participant] if condition.parameters == "calibrated" else None
    muscles = calibrated_muscles(record, files.channels[0], calibration)
    muscles = limit_capacity(muscles, record, condition.muscles, condition.capacity)
    s = prediction.solution
    return joint_moments(forces, muscles, s.q, s.u, s.activation)


def _direction_title(direction: str) -> str:
    joint, _, axis = direction.partition("_")
    return f"{joint}, {DIRECTION_NAMES[joint]}" + (f" {axis}" if axis else ", flexion")


@styled
def moment_figure(participant: str, shown: Sequence[MomentsOf]) -> Picture | None:
    """Net muscle moments over time, a panel per direction."""
    if not shown:
        return None
    drawing = Drawing(2, 5, (12.5, 4.8), sharex="all")
    for column, (axes, direction) in enumerate(zip(drawing.axes.flat, DIRECTIONS, strict=True)):
        axes.set_title(_direction_title(direction), loc="left")
        for case in shown:
            times = case.prediction.solution.time_s
            net, passive = case.moments.net[:, column], case.moments.passive[:, column]
            drawing.curve(axes, case.label, times, net, **case.line)
            thin = {**case.line, "linewidth": 0.8, "linestyle": (0, (2, 1.5))}
            drawing.curve(axes, f"{case.label}, passive", times, passive, **thin)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel("moment [N m]")
    drawing.legend(
        {case.label: case.line for case in shown}
        | {"of it passive": {"color": "#555555", "linewidth": 0.8, "linestyle": (0, (2, 1.5))}}
    )
    return drawing.finish(
        f"moments_{participant}",
        f"Participant {participant}: moments of all muscles about the joints, in the axes of the "
        "segment beyond each joint (x to the right, y up along the bone, z to the back); dashed: "
        "part of passive muscle force.",
    )


def margin_table(shown: Sequence[MomentsOf]) -> Table:
    """Glenohumeral moments at the highest elevation of each plane, and the margin left."""
    columns = [i for i, name in enumerate(DIRECTIONS) if name.startswith("GH")]
    rows = []
    for case in shown:
        prediction = case.prediction
        elevation = prediction.angles[:, ELEVATION_COLUMN]
        nodes = [s.start + int(np.argmax(elevation[s])) for s in prediction.planes.values()]
        capacity = torque_capacity(case.moments, nodes)
        for row, (plane, node) in enumerate(zip(prediction.planes, nodes, strict=True)):
            cells = (
                f"{capacity.required[row, i]:.1f} ({capacity.lowest[row, i]:.1f} to "
                f"{capacity.highest[row, i]:.1f}), {capacity.margin[row, i]:.2f}"
                for i in columns
            )
            head = (prediction.participant, condition_label(prediction), plane)
            rows.append((*head, f"{elevation[node]:.0f}", *cells))
    names = ("participant", "shoulder", "plane", "elevation [deg]")
    return Table((*names, *(f"{DIRECTIONS[i]} [N m], margin [1]" for i in columns)), rows)


@styled
def group_force_figure(cases: Cases) -> Picture | None:
    """Summed force of each muscle group, healthy and cuff-limited."""
    about = cases.healthy
    if about is None:
        return None
    shown = compared(cases, about)
    names = {muscle.name: muscle.group for muscle in about.record.muscles}
    groups = np.array([names[name] for name in about.solution.muscles.tolist()])
    forces = {k: group_force(p.solution.muscle_force_N, groups) for k, (p, _) in shown.items()}
    panels = list(forces["healthy"])
    rows = -(-len(panels) // 5)
    drawing = Drawing(rows, 5, (12.5, 1.6 * rows + 0.5), sharex="all")
    for axes, group in zip(drawing.panels(len(panels)), panels, strict=True):
        axes.set_title(GROUP_NAMES.get(group, group), loc="left")
        for label, (prediction, line) in shown.items():
            drawing.curve(axes, label, prediction.solution.time_s, forces[label][group], **line)
        axes.axhline(0.0, color="#555555", linewidth=0.6, zorder=1)
    drawing.figure.supxlabel("time [s]")
    drawing.figure.supylabel("force, sum over the elements [N]")
    drawing.legend({label: line for label, (_, line) in shown.items()})
    return drawing.finish(
        f"muscle_forces_{cases.participant}",
        f"Participant {cases.participant}: force of each muscle, summed over its elements, active "
        "and passive. Elements of one muscle pull in different directions, so the sum is no "
        "resultant. Panels have their own scales. "
        + _pushing_words([one for one, _ in shown.values()]),
    )


def _pushing_words(predictions: Sequence[Prediction]) -> str:
    push = largest_push(predictions)
    if push is None:
        return ""
    return (
        "Below zero: the paper's passive curve pushes where fibres are shorter than optimal, a "
        f"single element here by up to {push[0]:.1f} N."
    )


def largest_push(predictions: Sequence[Prediction]) -> tuple[float, str] | None:
    """Largest negative force of a muscle element in solved predictions [N], and which has it.

    The passive curve of the paper is below zero for fibres shorter than optimal (supplement,
    muscle model), so an element without activation pushes its ends apart. None where none does.
    """
    pushes = [
        (float(-one.solution.muscle_force_N.min()), _most_negative(one))
        for one in predictions
        if not one.failed
    ]
    largest = max(pushes, default=(0.0, ""))
    return largest if largest[0] > 0.0 else None


def _most_negative(prediction: Prediction) -> str:
    """Participant, condition and element of the most negative force."""
    element = int(prediction.solution.muscle_force_N.min(axis=0).argmin())
    muscle = prediction.solution.muscles[element]
    return f"{prediction.participant} {prediction.condition.name}, {muscle}"
