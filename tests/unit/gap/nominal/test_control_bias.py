"""Recorded EMG tells what drives a person's muscles beside effort; effects change it as before."""

import numpy as np
import pytest
from gap_movement import CHANNELS, SETTINGS, SETUP, small_body, small_movement, small_record

from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.nominal import optimal_movement
from scapulohumeral.gap.nominal.control_bias import Drive, toward_emg
from scapulohumeral.gap.recording.observables import SensorSetup, difference, predicted
from scapulohumeral.gap.signatures import of_tasks
from scapulohumeral.gap.signatures.linearise import Linearised
from scapulohumeral.gap.signatures.of_tasks import task_signatures

pytestmark = pytest.mark.unit

RECORDER = SensorSetup(CHANNELS, np.array([[1.0, 0, 0], [0, 0.5, 0.5]]), False)
EFFORT = np.array([0.01, 0.02, 0.05])
LOAD = next(e for e in library(SETUP) if e.label == "body/hand_load")


@pytest.fixture(scope="module")
def nominal(quaternion_equations):
    move = small_movement(quaternion_equations)
    return move, move.solved(move.body, move.cold_start(), 500)


def a_drive(seed):
    rng = np.random.default_rng(seed)
    return Drive(rng.uniform(0.0, 2.0, 3), rng.uniform(0.0, 1.0, (4, 3)), rng.normal(size=(4, 3)))


def cost(drive, excitation):
    """Definition of a drive, with effort."""
    away = drive.weight * (excitation - drive.target) ** 2 + drive.slope * excitation
    return float(np.sum(EFFORT * excitation**2 + away))


def test_cost_of_a_drive_is_its_definition_up_to_a_constant():
    drive, rng = a_drive(1), np.random.default_rng(2)
    term = drive.term(EFFORT)

    def as_term(excitation):
        return float(np.sum(term.errors(excitation) ** 2))

    one, other = rng.uniform(0.0, 1.0, (2, 4, 3))
    assert as_term(one) - as_term(other) == pytest.approx(cost(drive, one) - cost(drive, other))


def test_a_bias_keeps_the_slope_and_nothing_of_the_curvature():
    drive, there = a_drive(3), np.full((4, 3), 0.3)
    bias, step = drive.bias(there), 1e-3
    assert not bias.weight.any()
    for k in range(3):
        shift = step * np.eye(3)[k]
        rise = cost(drive, there + shift) - cost(drive, there - shift)
        assert cost(bias, there + shift) - cost(bias, there - shift) == pytest.approx(rise)
    bend = [cost(bias, there + sign * step) - cost(bias, there) for sign in (1.0, -1.0)]
    assert sum(bend) == pytest.approx(2.0 * 4 * step**2 * EFFORT.sum(), rel=1e-6)


def test_elements_of_a_channel_move_by_what_it_lacks():
    excitation = np.array([[0.2, 0.1, 0.3]])
    drive = toward_emg(excitation, np.array([[0.5, 0.25]]), RECORDER.electrodes)
    np.testing.assert_allclose(drive.target, [[0.5, 0.15, 0.35]])
    silent = toward_emg(excitation, np.array([[0.5, 0.0]]), RECORDER.electrodes)
    np.testing.assert_allclose(silent.target, [[0.5, 0.0, 0.1]])
    unseen = toward_emg(excitation, np.array([[0.5]]), RECORDER.electrodes[:1])
    np.testing.assert_allclose(unseen.weight > 0.0, [True, False, False])


def emg(move, point):
    return move.trajectory(point).e @ RECORDER.electrodes.T


def test_control_bias_brings_the_solution_nearer_to_emg_and_leave_it_optimal(nominal):
    move, point = nominal
    wanted = emg(move, point) + np.array([0.10, 0.05])
    person, habitual = move.with_control_bias(point, wanted, RECORDER.electrodes, 200)
    before, after = (np.linalg.norm(emg(move, p) - wanted) for p in (point, habitual))
    assert after < 0.95 * before
    again = person.solved(person.body, habitual, 200)
    np.testing.assert_allclose(emg(person, again), emg(person, habitual), atol=1e-4)


def test_a_person_with_habits_answers_a_load_as_its_derivative_says(nominal):
    """By solving again with the load: EMG is no longer followed."""
    move, point = nominal
    wanted = emg(move, point) + np.array([0.10, 0.05])
    person, habitual = move.with_control_bias(point, wanted, RECORDER.electrodes, 200)
    slope = Linearised(person, person.body, habitual, 0.44, RECORDER).by_effect(LOAD, np.zeros(2))
    records = []
    for kg in (0.02, 0.0):
        body = LOAD.apply(person.body, np.array([kg, 0.0]))
        x = person.trajectory(person.solved(body, habitual, 200))
        records.append(predicted(x, 0.44, CHANNELS, RECORDER.electrodes, False))
    change = difference(*records)
    assert np.linalg.norm(change - 0.02 * slope[0]) < 0.05 * np.linalg.norm(change)


@pytest.mark.parametrize("tells", [True, False])
def test_only_a_record_that_tells_habits_gives_any(nominal, monkeypatch, tells):
    move, _ = nominal
    monkeypatch.setattr(of_tasks, "movement", lambda *_: move)
    monkeypatch.setattr(of_tasks, "nominal_start", lambda move, settings: move.cold_start())
    record = small_record()
    found = task_signatures(
        "t", record, record.duration_s, None, (), RECORDER, SETTINGS, tells, False
    )
    assert bool(found.drive.slope.any()) is tells


def test_soft_ribs_are_the_same_body_with_a_wider_contact():
    body = small_body()
    soft = optimal_movement._on_soft_ribs(body)
    changed = [
        name
        for name, value in soft.parameters.items()
        if not np.array_equal(value, body.parameters[name])
    ]
    assert changed == ["contact_eps"]
    assert soft.parameters["contact_eps"] == 3.0 * body.parameters["contact_eps"]
