"""Calibration, validation and prediction: complete, certified, and honest about simulated EMG.

Run by the rule test_results. Whether the numbers meet the targets of the study is said by the
report (`scapulohumeral.report.coordination_targets`): a missed one is a finding, not a defect.
"""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from scapulohumeral.ocp.solution import read_solution

pytestmark = pytest.mark.results

LARGEST_KKT_ERROR = 1e-6
UNIT_NORM_TOLERANCE = 1e-8


@pytest.fixture(scope="module")
def predictions(files) -> list[Path]:
    """Solutions <participant>/<condition>.npz."""
    return _paths(files, "predictions")


@pytest.fixture(scope="module")
def table(files, predictions: list[Path]) -> pd.DataFrame:
    """One row per prediction and plane."""
    if not predictions:
        pytest.skip("the study has no prediction")
    return pd.read_csv(_paths(files, "prediction_summary")[0])


def _paths(files, name: str) -> list[Path]:
    value = files[name]
    return [Path(value)] if isinstance(value, str) else [Path(path) for path in value]


def test_every_prediction_has_a_row_per_plane(table: pd.DataFrame, predictions: list[Path]) -> None:
    requested = {
        (path.parent.name, path.stem, plane)
        for path in predictions
        for plane in read_solution(path, allow_failed=True).header["planes"]
    }
    rows = list(table[["participant", "condition", "plane"]].itertuples(index=False, name=None))
    assert set(rows) == requested
    assert len(rows) == len(requested)


def test_solved_predictions_are_certified(table: pd.DataFrame) -> None:
    solved = table[table.status == "optimal"]
    assert not solved.empty
    assert (solved.kkt_error <= LARGEST_KKT_ERROR).all()


def test_failed_predictions_have_no_quantities(table: pd.DataFrame) -> None:
    failed = table[table.status != "optimal"]
    assert failed[["peak_gh_force_bw", "peak_upward_rotation_deg"]].isna().all(axis=None)


def test_rhythm_has_every_phase_of_every_solved_prediction(files, table: pd.DataFrame) -> None:
    rhythm = pd.read_csv(_paths(files, "rhythm")[0])
    keys = ["participant", "condition", "plane"]
    phases = rhythm.groupby(keys).phase.nunique()
    solved = table[table.status == "optimal"].set_index(keys).index
    assert set(phases.index) == set(solved)
    assert (phases == 4).all()


def test_predicted_quaternions_keep_unit_length(predictions: list[Path]) -> None:
    for path in predictions:
        solution = read_solution(path, allow_failed=True)
        if solution.header["status"] != "optimal":
            continue
        norms = [np.linalg.norm(solution.q[:, i : i + 4], axis=1) for i in (0, 4, 8)]
        np.testing.assert_allclose(norms, 1.0, atol=UNIT_NORM_TOLERANCE, err_msg=str(path))


def test_scalers_lie_in_their_intervals_and_name_simulated_emg(files) -> None:
    for path in _paths(files, "calibrations"):
        document = json.loads(path.read_text(encoding="utf-8"))
        assert isinstance(document["emg_simulated"], bool)
        assert (document["scores"] is not None) == document["emg_simulated"]
        for kinds in document["groups"].values():
            for entry in kinds.values():
                low, high = entry["ci90"]
                assert low <= entry["value"] <= high


def test_every_channel_of_every_task_is_compared(files) -> None:
    tables = _paths(files, "validation")
    if not tables:
        pytest.skip("the study has no daily task")
    table = pd.read_csv(tables[0])
    channels = pd.read_csv(_paths(files, "channels")[0]).channel
    counts = table.groupby(["participant", "task"]).channel.nunique()
    assert (counts == len(channels)).all()
    assert {"rmse_generic", "rmse_calibrated"} <= set(table.columns)


def test_simulated_envelopes_say_so(files) -> None:
    for path in _paths(files, "envelopes"):
        marks = pd.read_csv(path).simulated.unique()
        assert len(marks) == 1, path
