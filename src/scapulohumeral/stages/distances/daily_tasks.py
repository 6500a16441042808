"""Healthy predictions on the arm of recorded daily tasks, beside the recorded girdle.

Elevations have chosen the model, daily tasks have not. Beside each prediction stands how far the
model is from the recording where it is told to follow it with all segments, and how far that
recording is from the elevations of the same person where the arm points the same way. Every
prediction has a row; failed solves have their status and only the last of these.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.errors import DataError
from scapulohumeral.model.muscle_paths.pose_region import (
    Region,
    elevation_poses,
    recorded_poses,
)
from scapulohumeral.model.participant import participant_of
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.problems.solution_mesh import on_mesh
from scapulohumeral.quantities.fit_region import outside_region
from scapulohumeral.quantities.recording_distance import TaskDistance, task_distance
from scapulohumeral.quantities.recordings_apart import Apart, recordings_apart
from scapulohumeral.stages.distances.against import (
    CERTIFIED,
    STOP_MOMENT,
    Predicted,
    read_predictions,
)

OUTSIDE = "outside_fit_share"
# Angles of the girdle, by column; with a prefix those of the tracked motion, or of the recordings.
ANGLES = {
    "ur_rmse_deg": "upward rotation",
    "tilt_rmse_deg": "tilt",
    "internal_rotation_rmse_deg": "internal rotation",
    "clavicle_elevation_rmse_deg": "clavicle elevation",
}
TRACKED = "tracked_"
APART = "apart_"
COLUMNS = (
    *("participant", "task", "condition", "variant", "hand_load_kg", "status", CERTIFIED),
    *(field.name for field in fields(TaskDistance)),
    *(f"{TRACKED}{column}" for column in ANGLES),
    *(f"{APART}{field.name}" for field in fields(Apart)),
    *(OUTSIDE, STOP_MOMENT),
)


@dataclass(frozen=True)
class TaskFiles:
    """Predictions and their summaries in one order; tracked tasks and participants in any."""

    solutions: Sequence[Path]
    summaries: Sequence[Path]
    tracked: Sequence[Path]
    participants: Sequence[Path]


def task_distances(files: TaskFiles, region: Region) -> pd.DataFrame:
    """Distances of predicted daily tasks to their recordings, in the columns ``COLUMNS``.

    Parameters
    ----------
    region : that muscle paths were fitted to

    Raises
    ------
    DataError                        a prediction whose task is not among the tracked ones
    """
    people = {path.parent.name: participant_of(path) for path in files.participants}
    fitted = {name: recorded_poses(person) for name, person in people.items()}
    elevated = {name: elevation_poses(person) for name, person in people.items()}
    tracked: dict[tuple[str, ...], Solution] = {
        (one.header["participant"], one.header["trial"]): one
        # What was recorded stands in a failed solve too; no prediction that follows it is solved.
        for one in (read_solution(path, allow_failed=True) for path in files.tracked)
    }
    rows = []
    for one in read_predictions(files.solutions, files.summaries):
        recorded = _followed(one, tracked)
        row = {"task": recorded.header["trial"], **one.names}
        row["hand_load_kg"] = one.summary["hand_load_kg"]
        others = elevated[one.names["participant"]]
        apart = asdict(recordings_apart(recorded.reference_pose, others))
        row |= {f"{APART}{name}": value for name, value in apart.items()}
        if one.solved:
            pose = one.solution.pose
            same = on_mesh(recorded, float(np.diff(one.solution.time_s).mean()))
            outside = outside_region(pose, fitted[one.names["participant"]], region)
            followed = asdict(task_distance(recorded.pose, recorded.reference_pose))
            row |= {f"{TRACKED}{column}": followed[column] for column in ANGLES}
            row |= asdict(task_distance(pose, same.reference_pose)) | {
                CERTIFIED: one.certified,
                OUTSIDE: float(outside.mean()),
                STOP_MOMENT: one.summary[STOP_MOMENT],
            }
        rows.append(row)
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _followed(one: Predicted, tracked: Mapping[tuple[str, ...], Solution]) -> Solution:
    """The tracked task that a prediction follows, by participant and task."""
    name = (one.summary["participant"], *one.summary["planes"])
    if name not in tracked:
        raise DataError(
            f"prediction of {' '.join(name)}: no tracked task has that name. There are: "
            f"{', '.join(' '.join(known) for known in tracked)}. Name its tracking solution too"
        )
    return tracked[name]
