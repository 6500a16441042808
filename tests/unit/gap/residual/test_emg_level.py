"""EMG that tells no level is as high as the model predicts it."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, SETTINGS, small_record

from scapulohumeral.gap.recording.observables import SensorSetup, channel_names
from scapulohumeral.gap.residual import emg_level
from scapulohumeral.gap.residual.differences import Records
from scapulohumeral.gap.residual.emg_level import at_level_of_model

pytestmark = pytest.mark.unit

SENSORS = SensorSetup(CHANNELS, np.eye(2, 3), False)


def records(*emg: np.ndarray) -> Records:
    """One task for each EMG (N, 2) of the reference; the tests have twice as much."""
    mean_records = {
        f"task {i}": replace(small_record(), channels=CHANNELS, emg=one)
        for i, one in enumerate(emg)
    }
    return Records(
        test={task: [replace(one, emg=2.0 * one.emg)] for task, one in mean_records.items()},
        reference={task: [one] for task, one in mean_records.items()},
        mean_records=mean_records,
        sensors=SENSORS,
        channels=channel_names(CHANNELS, False),
        of_one_person=True,
    )


def test_each_channel_gets_the_height_of_the_prediction(monkeypatch: pytest.MonkeyPatch) -> None:
    """By one factor for all tasks and both sides: what is twice as much stays so."""
    shape = np.linspace(0.5, 1.0, NODES)[:, None]
    predicted = shape * [0.2, 0.05]
    monkeypatch.setattr(emg_level, "_predicted_or_none", lambda *_: predicted)
    raised = at_level_of_model(records(shape * [1.0, 0.8], shape * [0.5, 0.4]), None, SETTINGS, 1)
    every = np.concatenate([one.emg for one in raised.mean_records.values()])
    height = np.sqrt(np.mean(every**2, axis=0))
    np.testing.assert_allclose(height, np.sqrt(np.mean(predicted**2, axis=0)))
    np.testing.assert_allclose(
        raised.mean_records["task 0"].emg, 2.0 * raised.mean_records["task 1"].emg
    )
    for task, one in raised.mean_records.items():
        np.testing.assert_array_equal(raised.reference[task][0].emg, one.emg)
        np.testing.assert_allclose(raised.test[task][0].emg, 2.0 * one.emg)


def test_a_task_that_is_not_solved_has_no_say(monkeypatch: pytest.MonkeyPatch) -> None:
    ones = np.ones((NODES, 2))
    found = iter([None, 0.3 * ones])
    monkeypatch.setattr(emg_level, "_predicted_or_none", lambda *_: next(found))
    raised = at_level_of_model(records(7.0 * ones, ones), None, SETTINGS, 1)
    np.testing.assert_allclose(raised.mean_records["task 1"].emg, 0.3)
    monkeypatch.setattr(emg_level, "_predicted_or_none", lambda *_: None)
    unchanged = records(ones)
    assert at_level_of_model(unchanged, None, SETTINGS, 1) is unchanged
