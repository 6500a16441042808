"""The table of predicted daily tasks: its rows, and what a failed solve leaves out."""

from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import REPOSITORY
from synthetic_coordination import CERTIFICATE
from synthetic_study import solution, write_json

from scapulohumeral.errors import DataError
from scapulohumeral.model.muscle_paths.pose_region import Region
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose
from scapulohumeral.ocp.solution import write_solution
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.quantities.population import UPWARD_ROTATION
from scapulohumeral.quantities.segment_angles import thorax_angles
from scapulohumeral.stages.distances.daily_tasks import COLUMNS, TaskFiles, task_distances
from scapulohumeral.stages.prediction import Condition

pytestmark = pytest.mark.unit

PARTICIPANTS = REPOSITORY / "config" / "participants"
WIDE = Region(10.0, (-30.0, 30.0), 20.0)


def files(folder: Path, turned_deg: dict[str, float], failed: str = "") -> TaskFiles:
    """Predictions of par1 whose scapula is turned up against the recorded one, by task."""
    paths: dict[str, list[Path]] = {"solutions": [], "summaries": [], "tracked": []}
    recordings = read_participant(PARTICIPANTS, "par1").trials
    for task, turn in turned_deg.items():
        recorded = trial_to_pose(recordings[task].motion.angles_rad[:40])
        angles = pose_to_trial(recorded)
        angles[:, 4] += np.deg2rad(turn)
        like = solution("par1", task, "quaternion")
        header = {
            **like.header,
            "status": "failed" if task == failed else "optimal",
            "condition": asdict(Condition("healthy", "generic", 2.0)),
            "variant": "study",
            "trial": "composite",
            "planes": {task: [0, len(recorded)]},
            "choices": asdict(ProblemChoices()),
            "hand_load_kg": recordings[task].hand_load_kg,
            "stop_moment_median_Nm": 0.0,
        }
        proof = None if task == failed else CERTIFICATE
        paths["tracked"].append(folder / f"{task}_tracked.npz")
        half = pose_to_trial(recorded)
        half[:, 4] += np.deg2rad(turn) / 2.0
        about = {**like.header, "status": header["status"]}
        tracked = replace(like, header=about, pose=trial_to_pose(half), reference_pose=recorded)
        write_solution(tracked, paths["tracked"][-1])
        paths["solutions"].append(folder / f"{task}.npz")
        predicted = replace(like, header=header, pose=trial_to_pose(angles))
        write_solution(predicted, paths["solutions"][-1])
        document = {**header, "certificate": proof}
        paths["summaries"].append(write_json(folder / f"{task}.json", document))
    return TaskFiles(**paths, participants=[PARTICIPANTS / "par1" / "participant.yaml"])


def test_each_task_is_compared_with_its_own_recording(tmp_path):
    table = task_distances(files(tmp_path, {"drinking": 0.0, "lifting": 5.0}), WIDE)
    assert tuple(table.columns) == COLUMNS
    right, turned = table.itertuples()
    assert (right.task, turned.task) == ("drinking", "lifting")
    assert right.ur_rmse_deg < 1e-6 < turned.ur_rmse_deg
    assert 4.0 < turned.ur_bias_deg < 6.0
    assert turned.tracked_ur_rmse_deg == pytest.approx(turned.ur_rmse_deg / 2.0, rel=0.05)
    assert turned.hand_load_kg == 2.0
    assert right.certified
    assert right.outside_fit_share == 0.0
    known = thorax_angles(
        trial_to_pose(read_participant(PARTICIPANTS, "par1").elevations[0].angles_rad)
    )
    assert 0.0 < right.apart_ur_rmse_deg < np.ptp(known[:, UPWARD_ROTATION])


def test_order_of_tracked_tasks_does_not_matter(tmp_path):
    given = files(tmp_path, {"drinking": 0.0, "lifting": 5.0})
    turned = replace(given, tracked=given.tracked[::-1])
    pd.testing.assert_frame_equal(task_distances(turned, WIDE), task_distances(given, WIDE))


def test_task_without_its_tracking_is_refused_by_name(tmp_path):
    given = files(tmp_path, {"drinking": 0.0, "lifting": 5.0})
    with pytest.raises(DataError, match="prediction of par1 lifting: no .* par1 drinking"):
        task_distances(replace(given, tracked=given.tracked[:1]), WIDE)


def test_a_scapula_where_no_path_was_fitted_is_counted(tmp_path):
    (row,) = task_distances(files(tmp_path, {"driving": 80.0}), WIDE).itertuples()
    assert row.outside_fit_share == 1.0


def test_failed_solve_keeps_its_row_without_numbers(tmp_path):
    given = files(tmp_path, {"drinking": 0.0, "driving": 0.0}, failed="driving")
    table = task_distances(given, WIDE).set_index("task")
    assert table.status["driving"] == "failed"
    assert table.apart_matched_share["driving"] > 0.0, "recordings need no solution"
    assert pd.isna(table.ur_rmse_deg["driving"])
    assert pd.isna(table.certified["driving"])
