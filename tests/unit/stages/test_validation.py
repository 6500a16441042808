"""Daily tasks against EMG: errors by channel, with generic and calibrated muscles side by side."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from emg_study import CHANNELS, CONFIG
from muscle_record import ELEMENTS
from small_posed import small_model, small_settings
from synthetic_study import PARTICIPANTS, solution

from scapulohumeral.emg.envelope import Envelopes, write_envelopes, write_failed_envelopes
from scapulohumeral.errors import DataError, SolveError
from scapulohumeral.ocp.solution import read_solution, write_solution
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.stages import validation
from scapulohumeral.stages.validation import (
    ValidationFiles,
    compare_with_emg,
    one_per_recording,
    solve_validation,
    summarise_validation,
)

pytestmark = pytest.mark.unit

TABLE = CONFIG / "emg" / "channels.csv"
TASKS = ("frontal", "sagittal")
ENVELOPE = 0.3


def task_files(folder, task, parameters, excitation, status="optimal"):
    """A solution of constant excitation (by element) and an envelope of 0.3 in every channel."""
    solved = solution("par2", task, "quaternion", status)
    values = np.broadcast_to(excitation, (len(solved.time_s), len(ELEMENTS)))
    solved = replace(
        solved,
        header={**solved.header, "parameters": parameters},
        excitation=values,
        muscles=np.array(list(ELEMENTS)),
    )
    path = folder / f"{task}_{parameters}.npz"
    write_solution(solved, path)
    time = np.array([solved.time_s[0] - 0.1, solved.time_s[-1] + 0.1])
    envelope = folder / f"{task}.csv"
    flat = np.full((2, len(CHANNELS.names)), ENVELOPE)
    write_envelopes(envelope, Envelopes(CHANNELS.names, time, flat, simulated=True))
    return path, envelope


def summary(folder, cases) -> pd.DataFrame:
    """Table of cases (task, parameters, excitation, status)."""
    solutions, envelopes = zip(*(task_files(folder, *case) for case in cases), strict=True)
    summarise_validation(solutions, TABLE, envelopes, folder / "summary.csv")
    return pd.read_csv(folder / "summary.csv")


def test_channel_error_is_that_of_the_mean_of_its_elements(tmp_path):
    channel = CHANNELS.names.index("anterior_deltoid")
    first, second = CHANNELS.elements[channel]
    excitation = np.full(len(ELEMENTS), ENVELOPE)
    for name, value in ((first, 0.5), (second, 0.7)):
        excitation[list(ELEMENTS).index(name)] = value
    path, envelope = task_files(tmp_path, "frontal", "generic", excitation)
    table = compare_with_emg(path, TABLE, envelope)
    assert table["channel"].tolist() == list(CHANNELS.names)
    expected = np.where(table["channel"] == "anterior_deltoid", 0.6 - ENVELOPE, 0.0)
    np.testing.assert_allclose(table["rmse"], expected, atol=1e-9)


def test_both_kinds_of_muscles_stand_side_by_side(tmp_path):
    table = summary(
        tmp_path,
        [
            ("frontal", "generic", 0.5),
            ("frontal", "calibrated", 0.4),
            ("sagittal", "calibrated", 0.25),
            ("sagittal", "generic", 0.2),
        ],
    )
    assert len(table) == 2 * len(CHANNELS.names)
    for task, generic, calibrated in (("frontal", 0.2, 0.1), ("sagittal", 0.1, 0.05)):
        rows = table[table["task"] == task]
        assert rows["channel"].tolist() == list(CHANNELS.names)
        assert (rows["participant"] == "par2").all()
        np.testing.assert_allclose(rows["rmse_generic"], generic, atol=1e-6)
        np.testing.assert_allclose(rows["rmse_calibrated"], calibrated, atol=1e-6)
        np.testing.assert_allclose(rows["reduction"], 0.5, atol=1e-4)


def test_a_recording_that_is_solved_again_is_named(tmp_path):
    cases = [(task, kind, 0.5) for task in TASKS for kind in ("generic", "calibrated")]
    solutions, envelopes = zip(*(task_files(tmp_path, *case) for case in cases), strict=True)
    for parameters in ("generic", "calibrated"):
        path = tmp_path / f"frontal_{parameters}.npz"
        heavy = read_solution(path)
        again = tmp_path / f"heavy_{parameters}.npz"
        write_solution(replace(heavy, header={**heavy.header, "trial": "heavy"}), again)
        solutions, envelopes = (*solutions, again), (*envelopes, envelopes[0])
    summarise_validation(solutions, TABLE, envelopes, tmp_path / "summary.csv")
    table = pd.read_csv(tmp_path / "summary.csv")
    named = dict(table[["task", "recording"]].itertuples(index=False))
    assert named == {"frontal": "frontal", "sagittal": "sagittal", "heavy": "frontal"}
    assert set(one_per_recording(table).task) == set(TASKS)


def test_failed_solve_has_no_error(tmp_path):
    table = summary(
        tmp_path,
        [("frontal", "generic", 0.5), ("frontal", "calibrated", 0.4, "failed")],
    )
    assert len(table) == len(CHANNELS.names)
    np.testing.assert_allclose(table["rmse_generic"], 0.2, atol=1e-6)
    assert table[["rmse_calibrated", "reduction"]].isna().all(axis=None)


def test_task_whose_emg_could_not_be_simulated_has_no_error(tmp_path):
    path, envelope = task_files(tmp_path, "frontal", "generic", np.full(len(ELEMENTS), 0.5))
    write_failed_envelopes(envelope, CHANNELS.names, "no way")
    table = compare_with_emg(path, TABLE, envelope)
    assert table["channel"].tolist() == list(CHANNELS.names)
    assert table["rmse"].isna().all()


def test_task_that_failed_with_all_muscles_keeps_its_rows(tmp_path):
    table = summary(
        tmp_path,
        [(task, kind, 0.5, "failed" if task == "sagittal" else "optimal")
         for task in TASKS for kind in ("generic", "calibrated")],
    )  # fmt: skip
    rows = table[table["task"] == "sagittal"]
    assert len(rows) == len(CHANNELS.names)
    assert rows[["rmse_generic", "rmse_calibrated"]].isna().all(axis=None)


@pytest.mark.parametrize(
    ("calibration", "tracking", "why"),
    [
        ("failed", "optimal", "calibration failed: no way"),
        (None, "failed", "tracking of frontal failed"),
    ],
)
def test_task_without_what_it_starts_from_is_written_as_failed(
    calibration, tracking, why, quaternion_equations, tmp_path, monkeypatch
):
    monkeypatch.setattr(validation, "load_model", lambda _: small_model(quaternion_equations))
    monkeypatch.setattr(validation, "hashes", lambda *_: {})
    scalers = None
    if calibration:
        scalers = tmp_path / "scalers.json"
        failure = {"status": calibration, "message": "no way", "groups": {}}
        scalers.write_text(json.dumps(failure), encoding="utf-8")
    person = PARTICIPANTS / "par2" / "participant.yaml"
    tracked = tmp_path / "tracked.npz"
    write_solution(solution("par2", "frontal", "quaternion", tracking), tracked)
    files = ValidationFiles(ModelFiles(person, *[tmp_path / "unread"] * 4), TABLE, scalers, tracked)
    written = tmp_path / "task.npz", tmp_path / "task.summary.json"
    solve_validation("frontal", files, small_settings(), written, tmp_path / "solver.log")
    with pytest.raises(SolveError, match=why):
        read_solution(written[0])
    about = json.loads(written[1].read_text(encoding="utf-8"))
    kind = "calibrated" if calibration else "generic"
    assert (about["parameters"], about["iterations"]) == (kind, 0)


def test_unknown_muscles_are_refused(tmp_path):
    with pytest.raises(DataError, match="muscles 'stronger'"):
        summary(tmp_path, [("frontal", "stronger", 0.5)])
