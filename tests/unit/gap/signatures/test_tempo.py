"""What another tempo asks of the muscles, as two solves tell it."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import CHANNELS, SETTINGS, small_movement, small_record

from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    SensorSetup,
    difference,
    predicted,
    without,
)
from scapulohumeral.gap.signatures import tempo
from scapulohumeral.gap.signatures.tempo import tempo_change, tempo_errors

pytestmark = pytest.mark.unit

RECORDER = SensorSetup(CHANNELS, np.array([[1.0, 0, 0], [0, 0.5, 0.5]]), contact=True)
MOTION = len(KINEMATIC_CHANNELS)


@pytest.fixture
def movements(quaternion_equations, monkeypatch):
    """The small movement as it is, and in any other time."""
    move = small_movement(quaternion_equations)
    usual = small_record().duration_s

    def in_time(_, observed, __):
        step = move.objective.step * observed.duration_s / usual
        return replace(move, objective=replace(move.objective, step=step))

    monkeypatch.setattr(tempo, "movement", in_time)
    return move, in_time


def test_a_change_of_tempo_is_that_between_two_movements(movements):
    """Of a tempo at which a cold start ends in the same one of the small arm's optima."""
    move, in_time = movements
    record = small_record()
    point = move.solved(move.body, move.cold_start(), 500)
    hasty_s = 0.8 * record.duration_s
    found = tempo_change(move, point, record, hasty_s, RECORDER, None, SETTINGS)
    hasty = in_time(None, replace(record, duration_s=hasty_s), None)
    hasty_point = hasty.solved(hasty.body, hasty.cold_start(), 500)
    slow, fast = (
        predicted(m.trajectory(p), 1.0, CHANNELS, RECORDER.electrodes, True)
        for m, p in ((move, point), (hasty, hasty_point))
    )
    expected = difference(fast, slow)
    assert np.abs(expected[:, MOTION:]).max() > 0.01
    np.testing.assert_allclose(found[:, MOTION:], expected[:, MOTION:], rtol=1e-3, atol=1e-4)
    np.testing.assert_array_equal(found[:, :MOTION], 0.0)


def test_the_same_tempo_asks_for_nothing_else(movements, monkeypatch):
    move, _ = movements
    record = small_record()
    point = move.solved(move.body, move.cold_start(), 500)
    monkeypatch.setattr(tempo, "movement", None)
    alike_s = 1.01 * record.duration_s
    assert not tempo_change(move, point, record, alike_s, RECORDER, None, SETTINGS).any()
    by_motion = SensorSetup((), np.zeros((0, 3)), contact=False)
    assert tempo_change(move, point, record, 9.0, by_motion, None, SETTINGS).shape[1] == MOTION


def test_each_channel_may_be_off_by_a_share_of_its_own_change():
    change = np.zeros((5, 4))
    change[:, 1], change[:, 3] = 2.0, np.arange(5.0)
    errors = tempo_errors(change, 0.3)
    assert errors.shape == (2, 5, 4)
    np.testing.assert_allclose(errors.sum(axis=0), 0.3 * change)
    assert not errors[0][:, 3].any()
    assert not errors[1][:, 1].any()
    assert tempo_errors(np.zeros((5, 4)), 0.3).shape == (0, 5, 4)


def test_a_known_change_is_taken_off_emg_and_force_alone():
    record = replace(small_record(), contact_N=np.ones((12, 3)))
    change = np.tile(np.arange(MOTION + 5.0), (12, 1))
    less = without(record, change)
    np.testing.assert_allclose(difference(record, less)[:, :MOTION], 0.0, atol=1e-9)
    np.testing.assert_allclose(difference(record, less)[:, MOTION:], change[:, MOTION:])
    assert without(replace(record, emg=None, contact_N=None), change).emg is None
