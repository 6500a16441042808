"""Calibration, validation and prediction: complete, certified, and honest about simulated EMG.

Run by the rule test_results. Whether the numbers meet the targets of the study is said by the
report (`scapulohumeral.report.coordination_targets`): a missed one is a finding, not a defect.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from result_files import paths, some_paths

from scapulohumeral.ocp.solution import read_solution

pytestmark = pytest.mark.results

LARGEST_KKT_ERROR = 1e-6
# Twice that of the worst tracked elevation.
LARGEST_ARM_RMSE_DEG = 5.0


@pytest.fixture(scope="module")
def predictions(files) -> list[Path]:
    """Solutions <participant>/<condition>.npz."""
    return some_paths(files, "predictions")


@pytest.fixture(scope="module")
def table(files) -> pd.DataFrame:
    """One row per prediction and plane."""
    some_paths(files, "predictions")
    return pd.read_csv(paths(files, "prediction_summary")[0])


def test_every_prediction_has_a_row_per_plane(table: pd.DataFrame, predictions: list[Path]) -> None:
    requested = {
        (path.parent.name, path.stem, plane)
        for path in predictions
        for plane in read_solution(path, allow_failed=True).header["planes"]
    }
    rows = list(table[["participant", "condition", "plane"]].itertuples(index=False, name=None))
    assert set(rows) == requested
    assert len(rows) == len(requested)


def test_certificates_say_what_was_measured(table: pd.DataFrame, predictions: list[Path]) -> None:
    """A certificate holds if the stored inertia and error of the optimality conditions say so."""
    assert (table.status == "optimal").any()
    for path in predictions:
        stored = path.with_name(f"{path.stem}.summary.json").read_text(encoding="utf-8")
        about = json.loads(stored)
        rows = table[(table.participant == path.parent.name) & (table.condition == path.stem)]
        assert set(rows.status) == {about["status"]}, path
        proof = about["certificate"]
        assert (proof is None) == (about["status"] != "optimal"), path
        if proof is not None:
            minimum = proof["inertia"] == proof["expected_inertia"]
            exact = proof["kkt_error"] <= LARGEST_KKT_ERROR
            assert set(rows.certified) == {minimum and exact}, path
            assert exact, path


def test_predictions_have_quantities_if_and_only_if_they_are_solved(table: pd.DataFrame) -> None:
    quantities = table[["peak_gh_force_bw", "peak_upward_rotation_deg"]]
    solved = table.status == "optimal"
    assert (quantities.notna().all(axis=1) == solved).all()
    assert (quantities.isna().all(axis=1) == ~solved).all()
    # Percent of body weight.
    assert quantities[solved].peak_gh_force_bw.between(5.0, 500.0).all()


def test_every_daily_task_has_a_row_and_a_distance_where_it_is_solved(files) -> None:
    tasks = some_paths(files, "task_predictions")
    [against] = paths(files, "against_tasks")
    rows = pd.read_csv(against).set_index(["participant", "task"])
    assert sorted(rows.index) == sorted((p.parents[1].name, p.parent.name) for p in tasks)
    for path in tasks:
        about = read_solution(path, allow_failed=True).header
        row = rows.loc[(about["participant"], path.parent.name)]
        assert row.status == about["status"], path
        assert list(about["planes"]) == [path.parent.name], "one trial, and that of the folder"
        assert np.isfinite(row.ur_rmse_deg) == (about["status"] == "optimal"), path
        # The arm is followed: it may not be the arm that makes the girdle right or wrong.
        assert not row.arm_rmse_deg > LARGEST_ARM_RMSE_DEG, path


def test_rhythm_has_every_phase_of_every_solved_prediction(files, table: pd.DataFrame) -> None:
    rhythm = pd.read_csv(paths(files, "rhythm")[0])
    # Recordings stand beside the predictions.
    rhythm = rhythm[rhythm.condition != "recorded"]
    keys = ["participant", "condition", "plane"]
    phases = rhythm.groupby(keys).phase.apply(set)
    solved = table[table.status == "optimal"].set_index(keys).index
    assert set(phases.index) == set(solved)
    assert all({"start-30", "30-60", "60-90", "start-90"} <= found for found in phases)


def test_intervals_of_scalers_hold_the_truth_they_are_said_to(files, repository: Path) -> None:
    """Judged from the plant's own file; an interval that fails more often than not is none."""
    for path in some_paths(files, "calibrations"):
        document = json.loads(path.read_text(encoding="utf-8"))
        assert document["emg_simulated"] == (not _measured_trials(files, path.stem))
        if not document["emg_simulated"] or document["status"] == "failed":
            assert document["scores"] is None
            continue
        plant = (repository / "config" / "plant" / f"{path.stem}.yaml").read_text(encoding="utf-8")
        truth = yaml.safe_load(plant)
        held = [
            entry["ci90"][0] <= truth[kind][name] <= entry["ci90"][1]
            for name, kinds in document["groups"].items()
            for kind, entry in kinds.items()
            if entry["identifiable"]
        ]
        assert held, path
        assert document["scores"]["coverage90"] == pytest.approx(np.mean(held)), path
        assert np.mean(held) > 0.5, path


def _measured_trials(files, participant: str) -> dict[str, str]:
    """Trials whose EMG was measured, by the participant's own file."""
    [own] = [path for path in paths(files, "participants") if path.parent.name == participant]
    document = yaml.safe_load(own.read_text(encoding="utf-8"))
    return document.get("emg", {"trials": {}})["trials"]


def test_every_channel_of_every_task_is_compared(files) -> None:
    table = pd.read_csv(some_paths(files, "validation")[0])
    channels = pd.read_csv(paths(files, "channels")[0]).channel
    counts = table.groupby(["participant", "task"]).channel.nunique()
    assert (counts == len(channels)).all()
    assert {"rmse_generic", "rmse_calibrated"} <= set(table.columns)


def test_simulated_envelopes_say_so(files) -> None:
    """Paths are <participant>/<trial>_envelope.csv; what was measured, the participant says."""
    for path in some_paths(files, "envelopes"):
        trial = path.stem.removesuffix("_envelope")
        measured = trial in _measured_trials(files, path.parent.name)
        assert set(pd.read_csv(path).simulated) == {not measured}, path
