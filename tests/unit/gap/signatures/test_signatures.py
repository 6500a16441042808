"""Derivatives of what is recorded: of intended posture, slack forces, and sessions."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, SETTINGS, SETUP, small_movement, small_record

from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.case import EmgSeries, GapTrial
from scapulohumeral.gap.recording.movement_window import smoothed
from scapulohumeral.gap.recording.observables import (
    JOINT_QUATERNIONS,
    KINEMATIC_CHANNELS,
    SensorSetup,
    channel_names,
    difference,
    electrode_matrix,
    mean,
    mean_pose,
    phase_functions,
    predicted,
    recorded,
)
from scapulohumeral.gap.signatures.linearise import Linearised
from scapulohumeral.gap.signatures.nuisances import SMOOTH, session_records, unmeasured_records
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import pose_to_trial, relative_angle, trial_to_pose

pytestmark = pytest.mark.unit

RECORDER = SensorSetup(CHANNELS, np.array([[1.0, 0, 0], [0, 0.5, 0.5]]), False)
ELBOW = 9


@pytest.fixture(scope="module")
def local(quaternion_equations):
    move = small_movement(quaternion_equations)
    point = move.solved(move.body, move.cold_start(), 500)
    return Linearised(move, move.body, point, 0.44, RECORDER)


def test_slack_force_acts_like_a_spring_that_moved(local):
    """A constant torque at the elbow is its spring with another angle of rest."""
    stiffness = local.body.parameters["joint_stiffness"][3]

    class Rest:
        def physical(self, x):
            return x

        def apply(self, body, values):
            rest = body.parameters["rest_EL"] + values[0] / stiffness
            return replace(body, parameters={**body.parameters, "rest_EL": rest})

    np.testing.assert_allclose(
        local.slack()[ELBOW, 0], local.by_effect(Rest(), np.zeros(1))[0], rtol=1e-5, atol=1e-7
    )


def test_posture_derivative_agrees_with_tracking_another_motion(local):
    move, shape = local.move, np.ones(NODES)
    records = []
    for sign in (1.0, -1.0):
        angles = move.angles_rad.copy()
        angles[:, 9] += np.deg2rad(0.2 * sign) * shape
        other = replace(move, objective=move.with_reference(angles), angles_rad=angles)
        x = other.trajectory(other.solved(other.body, local.point, 200))
        records.append(predicted(x, 0.44, CHANNELS, RECORDER.electrodes, False))
    expected = difference(*records) / 0.4
    found = local.intended(SMOOTH)[ELBOW, 0]
    assert np.linalg.norm(found - expected) < 0.05 * np.linalg.norm(expected)


def test_prediction_follows_a_record_that_is_wrong(local):
    move = local.move
    records, solved = [], []
    for sign in (1.0, -1.0):
        pose = trial_to_pose(move.angles_rad)
        pose = turn_frame(pose, "scapula", np.deg2rad(sign * np.array([0.1, 0.0, 0.05])))
        records.append(Observation(0.44, pose, CHANNELS, None, None))
        other = replace(move, objective=move.with_reference(pose_to_trial(pose)))
        x = other.trajectory(other.solved(other.body, local.point, 200))
        solved.append(predicted(x, 0.44, CHANNELS, RECORDER.electrodes, False))
    [found] = local.following([(records[0], records[1])], [1.0])
    expected = difference(*solved)
    assert np.linalg.norm(found - expected) < 0.05 * np.linalg.norm(expected)


def followable(local):
    """A movement that muscles can follow to a few degrees, and its solution."""
    angles = pose_to_trial(local.move.trajectory(local.point).q) + 0.02
    move = replace(local.move, objective=local.move.with_reference(angles), angles_rad=angles)
    return move, move.solved(move.body, local.point, 200)


def test_who_keeps_a_movement_firmly_shows_effects_less_in_its_angles(local):
    """As derivative and as solution: elsewhere the muscles have to make up for it."""
    move, point = followable(local)
    loose = Linearised(move, move.body, point, 0.44, RECORDER)
    firm = loose.kept(10.0)
    load = next(e for e in library(SETUP) if e.label == "body/hand_load")
    conditions = loose.conditions(load, np.zeros(2))
    give, keep = (one.through(conditions)[0] for one in (loose, firm))
    elbow = KINEMATIC_CHANNELS.index("EL_rx")
    assert np.linalg.norm(keep[:, elbow]) < 0.5 * np.linalg.norm(give[:, elbow])
    solved = []
    for kg in (0.05, 0.0):
        body = load.apply(move.body, np.array([kg, 0.0]))
        x = move.trajectory(firm.move.solved(body, point, 200))
        solved.append(predicted(x, 0.44, CHANNELS, RECORDER.electrodes, False))
    change = difference(*solved)
    assert np.linalg.norm(change - 0.05 * keep) < 0.1 * np.linalg.norm(change)


def test_stiffness_leaves_the_solution(local):
    """To first order: along flat directions of the cost a little of it moves the angles."""
    move, point = followable(local)
    kept = move.kept(point, 10.0)
    problem = kept.problem(move.body)
    before, after = (
        problem.objective_function.value(problem.layout.split(p.free))
        for p in (point, kept.solved(move.body, point, 200))
    )
    assert after <= before < 1.002 * after
    assert move.kept(point, 1.0) is move


def test_residual_keeps_what_the_prediction_has_not_followed(local):
    wrong, followed = np.full((1, 2, 3), 5.0), np.full((1, 2, 3), 4.0)
    none = np.zeros(0)
    of_task = TaskSignatures(
        task="t", mean_record=small_record(), nominal=small_record(), point=local.point,
        effects=((wrong,), (2.0 * wrong,)), intended=none, posture=none, session=wrong,
        followed=(followed,),
        followed_session=0.5 * followed,
        tempo=none, tempo_errors=none, unmeasured=wrong, followed_unmeasured=followed,
        slack=none, levers=none, needed=none,
        drive=local.move.drive,
    )  # fmt: skip
    residual = of_task.of_residual()
    np.testing.assert_allclose(residual.effects[0][0], 1.0)
    np.testing.assert_allclose(residual.effects[1][0], 6.0)
    np.testing.assert_allclose(residual.session, 3.0)
    np.testing.assert_allclose(residual.unmeasured, 1.0)


def test_a_scapula_that_nobody_measured_turns_about_all_its_axes():
    record = small_record()
    sensors = replace(RECORDER, unmeasured={"scapula": 12.0})
    turned = unmeasured_records(record, sensors)
    assert len(turned) == 3 * SMOOTH
    turns = np.stack([difference(one, record) for one in turned])
    np.testing.assert_allclose(turns[:, :, :3], 0.0, atol=1e-9)
    spread = np.sqrt(np.sum(turns[:, :, 3:6] ** 2, axis=(0, 2)).mean())
    np.testing.assert_allclose(spread, np.sqrt(3.0) * 12.0, rtol=1e-6)
    assert unmeasured_records(record, RECORDER) == []


def test_an_elbow_that_nobody_measured_may_be_bent_in_any_smooth_way():
    record = small_record()
    bent = unmeasured_records(record, replace(RECORDER, unmeasured_angles={"EL_x": 35.0}))
    turns = np.stack([difference(one, record) for one in bent])
    assert len(bent) == SMOOTH
    np.testing.assert_allclose(turns[:, :, :9], 0.0, atol=1e-9)
    spread = np.sqrt(np.sum(turns[:, :, 9] ** 2, axis=0).mean())
    np.testing.assert_allclose(spread, 35.0, rtol=1e-6)


def test_an_axial_rotation_that_nobody_measured_turns_the_humerus_about_its_own_axis():
    record = small_record()
    sensors = replace(RECORDER, unmeasured_angles={"GH_yy": 35.0})
    turned = unmeasured_records(record, sensors)
    turns = np.stack([difference(one, record) for one in turned])
    assert len(turned) == SMOOTH
    np.testing.assert_allclose(turns[:, :, [*range(6), 9]], 0.0, atol=1e-9)
    spread = np.sqrt(np.sum(turns[:, :, 6:9] ** 2, axis=(0, 2)).mean())
    np.testing.assert_allclose(spread, 35.0, rtol=1e-6)


def test_sessions_change_frames_and_electrodes():
    record = small_record()
    changes = np.stack([difference(one, record) for one in session_records(record, SETTINGS)])
    assert changes.shape == (9 + SMOOTH + 2 * len(CHANNELS) + 1, NODES, 12)
    s = SETTINGS.session
    np.testing.assert_allclose(np.linalg.norm(changes[0, :, :3], axis=1), s.frame_deg, rtol=1e-6)
    gain_a = changes[9 + SMOOTH]
    np.testing.assert_allclose(gain_a[:, 10], s.emg_gain * record.emg[:, 0])
    assert not gain_a[:, :10].any()
    without = session_records(replace(record, channels=(), emg=None), SETTINGS)
    assert len(without) == 9 + SMOOTH


def test_phase_functions_are_orthonormal():
    functions = phase_functions(26, 6)
    np.testing.assert_allclose(functions.T @ functions, np.eye(6), atol=1e-12)


@pytest.mark.parametrize("rate_hz", [30.0, 1000.0])
def test_record_does_not_depend_on_the_sampling_rate(rate_hz, tmp_path):
    time = np.arange(0.0, 3.0, 1.0 / rate_hz)
    angles = np.tile([-0.4, 0.1, 0.2, 0.8, 0.05, 0.0, 0.2, 0.4, 0.3, 0.3], (len(time), 1))
    angles[:, 9] += 0.3 * time
    emg = EmgSeries(time, ("EMG_a",), 0.1 * time[:, None])
    smooth = smoothed(Motion(time, angles))
    trial = GapTrial("x", "t", 1, time, angles, smooth, emg, None, (0.5, 2.5), tmp_path)
    record = recorded(trial, ("EMG_a",), False, 21)
    expected = np.linspace(0.5, 2.5, 21)
    assert record.duration_s == 2.0
    np.testing.assert_allclose(record.emg[:, 0], 0.1 * expected, atol=1e-4)
    np.testing.assert_allclose(pose_to_trial(record.pose)[:, 9], 0.3 + 0.3 * expected, atol=1e-3)


def test_mean_of_two_records_lies_between_them():
    low, high = small_record(1.3), small_record(1.5)
    middle = mean([low, high])
    np.testing.assert_allclose(difference(middle, low), -difference(middle, high), atol=1e-6)
    assert np.abs(difference(middle, low)).max() > 1.0


def test_mean_pose_is_on_the_way_whatever_the_signs():
    rng = np.random.default_rng(3)
    angles = rng.uniform(-0.5, 0.5, size=(6, 10))
    first, second = (
        trial_to_pose(angles),
        trial_to_pose(angles + 0.1 * rng.normal(size=(6, 10))),
    )
    flipped = second.copy()
    flipped[:, 4:8] *= -1.0
    for other in (second, flipped):
        for share in (0.0, 0.3, 1.0):
            found = mean_pose([first, other], [1 - share, share])
            assert np.allclose(found[:, 12], (1 - share) * first[:, 12] + share * second[:, 12])
            for part in JOINT_QUATERNIONS:
                whole = relative_angle(first[:, part], second[:, part])
                np.testing.assert_allclose(
                    relative_angle(first[:, part], found[:, part]), share * whole, atol=2e-3
                )
                np.testing.assert_allclose(np.linalg.norm(found[:, part], axis=1), 1.0)


def test_electrodes_average_the_elements_of_their_groups():
    matrix = electrode_matrix([["a"], ["a", "b"]], np.array(["a", "a", "b", "c"]))
    np.testing.assert_allclose(matrix, [[0.5, 0.5, 0, 0], [1 / 3, 1 / 3, 1 / 3, 0]])
    assert electrode_matrix([], np.array(["a"])).shape == (0, 1)
    assert channel_names(("EMG_a",), True)[9:] == ("EL_rx", "EMG_a", "GHF_x", "GHF_y", "GHF_z")
