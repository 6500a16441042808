"""Trials are read as recorded, bad files are refused by place, and names influence nothing."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from gap_files import elevation, write_csv, write_mot, write_participant

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording import movement_window as movement_window_module
from scapulohumeral.gap.recording.case import case_hash, make_case
from scapulohumeral.gap.recording.movement_window import (
    humerothoracic_speed,
    movement_window,
    smoothed,
)
from scapulohumeral.gap.recording.participant_file import read_participant_file
from scapulohumeral.gap.recording.trials import (
    TrialEntry,
    read_trial,
    read_trials,
    task_and_repeat,
    trial_files,
)
from scapulohumeral.model.motion import ANGLE_COLUMNS, Motion
from scapulohumeral.model.rotations import ANGLE_NAMES
from scapulohumeral.model.smoothing import smooth_recording

pytestmark = pytest.mark.unit


def read(path: Path, entry: TrialEntry | None = None):
    return read_trial(path, entry or TrialEntry())[0]


def test_csv_and_both_kinds_of_mot_give_the_same_trial(tmp_path):
    table = elevation()
    radians = in_radians(table)
    trials = [
        read(write_csv(table, tmp_path / "a.csv")),
        read(write_mot(table, tmp_path / "b.mot", "yes")),
        read(write_mot(radians, tmp_path / "c.mot", "no")),
    ]
    for trial in trials:
        np.testing.assert_allclose(trial.time_s, table["time"], atol=1e-12)
        np.testing.assert_allclose(trial.angles_rad, radians[list(ANGLE_NAMES)], atol=1e-12)


def test_tables_of_the_study_are_trials_too(tmp_path):
    own = elevation().rename(
        columns={"time": "time_s", **dict(zip(ANGLE_NAMES, ANGLE_COLUMNS, strict=True))}
    )
    expected = read(write_csv(elevation(), tmp_path / "a.csv")).angles_rad
    np.testing.assert_array_equal(read(write_csv(own, tmp_path / "b.csv")).angles_rad, expected)


def test_companions_keep_their_own_rate(tmp_path):
    path = write_csv(elevation(), tmp_path / "lift_r2.csv")
    time = np.linspace(0.0, 3.0, 3001)
    emg = pd.DataFrame({"time": time, "EMG_b": 0.2 + 0.01 * time, "EMG_a": 0.1 + 0.01 * time})
    force = pd.DataFrame({"time": time[::10], "GHF_x": 10.0, "GHF_y": 20.0, "GHF_z": 30.0})
    write_csv(emg, tmp_path / "lift_r2_emg.csv")
    write_csv(force, tmp_path / "lift_r2_force.csv")
    trial = read(path)
    assert trial.emg.channels == ("EMG_a", "EMG_b")
    np.testing.assert_array_equal(trial.emg.values[0], [0.1, 0.2])
    assert len(trial.emg.time_s) == 3001
    assert len(trial.contact.time_s) == 301
    np.testing.assert_array_equal(trial.contact.force_N[0], [10.0, 20.0, 30.0])
    assert (trial.task, trial.repeat) == ("lift", 2)


def test_emg_may_stand_in_the_trial_and_unknown_columns_are_told(tmp_path):
    table = elevation().assign(TH_x=1.0, PS_y=2.0)
    table["EMG_infra"] = 0.3 + 0.01 * table["time"]
    [trial], notes = read_trials([write_csv(table, tmp_path / "a.csv")], {})
    assert trial.emg.channels == ("EMG_infra",)
    assert trial.contact is None
    assert len(notes) == 1
    assert notes[0].endswith("columns ignored: TH_x, PS_y")


def test_companions_listed_as_trials_are_left_out(tmp_path):
    path = write_csv(elevation(), tmp_path / "a.csv")
    emg = write_csv(pd.DataFrame({"time": [0.0], "EMG_a": [0.1]}), tmp_path / "a_emg.csv")
    named_so = write_csv(elevation(), tmp_path / "b_emg.csv")
    trials, notes = trial_files([path, emg, named_so, path])
    assert trials == [path, named_so]
    assert "read with a.csv" in notes[0]
    with pytest.raises(DataError, match=r"a_emg.csv: read with a.csv.*expected trials"):
        trial_files([emg])


def test_envelopes_of_a_recording_that_became_no_trial_are_left_out(tmp_path):
    """A glob finds them: convert writes no table of a recording with a fault, and emg does not
    know."""
    path = write_csv(elevation(), tmp_path / "a.csv")
    orphan = write_csv(pd.DataFrame({"time_s": [0.0], "EMG_a": [0.1]}), tmp_path / "c_emg.csv")
    trials, notes = trial_files([path, orphan])
    assert trials == [path]
    assert "c_emg.csv: left out, because the trial" in notes[0]
    with pytest.raises(DataError, match=r"c_emg.csv: left out"):
        trial_files([orphan])
    missing = tmp_path / "d_emg.csv"
    assert trial_files([missing])[0] == [missing], "told as missing when it is read"


def smooth_motion(table):
    angles = np.deg2rad(table[list(ANGLE_NAMES)].to_numpy())
    return smoothed(Motion(table["time"].to_numpy(), angles))


def test_a_trial_is_smoothed_once(tmp_path, monkeypatch):
    filtered = []

    def counted(motion, cutoff_hz):
        filtered.append(cutoff_hz)
        return smooth_recording(motion, cutoff_hz)

    monkeypatch.setattr(movement_window_module, "smooth_recording", counted)
    trial = read(write_csv(elevation(100.0), tmp_path / "a.csv"))
    times, angles = trial.moved(21)
    assert (times[0], times[-1]) == trial.window_s
    assert angles.shape == (21, 10)
    assert len(filtered) == 1
    np.testing.assert_allclose(trial.smooth.angles_rad, trial.angles_rad, atol=np.deg2rad(0.5))


@pytest.mark.parametrize("rate_hz", [12.0, 33.3, 100.0, 1000.0])
def test_movement_window_does_not_depend_on_sampling_rate(rate_hz):
    table = elevation(rate_hz)
    start, end = movement_window(smooth_motion(table))
    # Speed of the smooth step is 30 x^2 (1 - x)^2, 5 % of its peak at x = 0.0591 of 2 s.
    tolerance = 0.02 + 1.0 / rate_hz
    assert start == pytest.approx(0.5 + 2.0 * 0.0591, abs=tolerance)
    assert end == pytest.approx(2.5 - 2.0 * 0.0591, abs=tolerance)


def test_rest_around_a_movement_changes_no_window(tmp_path):
    windows = [
        read(write_csv(elevation(still_s=s), tmp_path / f"{s}.csv")).window_s for s in (0.5, 4.5)
    ]
    np.testing.assert_allclose(np.subtract(*windows[::-1]), [4.0, 4.0], atol=0.021)


def test_noise_at_rest_is_no_movement():
    table = elevation(100.0)
    angles = np.deg2rad(table[list(ANGLE_NAMES)].to_numpy())
    noisy = angles + np.deg2rad(0.05) * np.random.default_rng(1).normal(size=angles.shape)
    time = table["time"].to_numpy()
    raw = humerothoracic_speed(Motion(time, noisy))
    assert (raw[:20] > 0.05 * raw.max()).any()
    assert movement_window(smoothed(Motion(time, noisy)))[0] > 0.5


def test_a_held_posture_counts_in_full():
    table = elevation(peak_deg=0.0)
    assert movement_window(smooth_motion(table)) == pytest.approx((0.0, 3.0))


def test_smoothing_leaves_a_slow_movement_and_uneven_steps_alone():
    table = elevation(100.0)
    keep = np.random.default_rng(2).random(len(table)) > 0.3
    keep[[0, -1]] = True
    time = table["time"].to_numpy()[keep]
    motion = Motion(time, np.deg2rad(table[list(ANGLE_NAMES)].to_numpy())[keep])
    np.testing.assert_allclose(smoothed(motion).angles_rad, motion.angles_rad, atol=np.deg2rad(0.3))


def test_window_of_the_participant_file_wins(tmp_path):
    path = write_csv(elevation(), tmp_path / "a_r3.csv")
    trial = read(path, TrialEntry("other", 7, (0.4, 2.0)))
    assert (trial.task, trial.repeat, trial.window_s) == ("other", 7, (0.4, 2.0))


@pytest.mark.parametrize(
    ("stem", "expected"),
    [("lift_r12", ("lift", 12)), ("lift", ("lift", None)), ("a_r1_b", ("a_r1_b", None))],
)
def test_task_and_repeat_by_name(stem, expected):
    assert task_and_repeat(stem) == expected


def with_nan(table):
    return table.assign(GH_z=["NaN" if i == 3 else v for i, v in enumerate(table["GH_z"])])


def with_stalled_time(table):
    time = table["time"].to_numpy().copy()
    time[4] = time[3]
    return table.assign(time=time)


def in_radians(table):
    return table.assign(**{name: np.deg2rad(table[name]) for name in ANGLE_NAMES})


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda t: t.drop(columns="AC_z"), r"row 1: missing column AC_z"),
        (
            lambda t: t.drop(columns=["SC_y", "SC_z", "SC_x"]),
            r"a\.csv, row 1: missing column SC_y, SC_z, SC_x; found .*scapulohumeral convert",
        ),
        (lambda t: t.drop(columns="time"), r"row 1: missing column time"),
        (with_nan, r"a\.csv, row 5, column GH_z: NaN; expected a finite number"),
        (with_stalled_time, r"a\.csv, row 6, column time: .* does not follow"),
        (in_radians, r"a\.csv, columns AC_y, AC_z, AC_x: .*these are radians; expected degrees"),
        (lambda t: t.head(9), r"a\.csv: 9 rows; expected 10 or more"),
        (lambda t: t.assign(GHF_x=1.0), r"GHF_x alone; expected all of GHF_x, GHF_y, GHF_z"),
        (lambda t: t.assign(EMG_a=55.0), r"row 2, column EMG_a: 55.0; expected a share"),
        (lambda t: t.assign(time_s=1.0), r"column time more than once"),
    ],
)
def test_bad_trials_are_refused_by_place(tmp_path, spoil, message):
    with pytest.raises(DataError, match=message):
        read(write_csv(spoil(elevation()), tmp_path / "a.csv"))


def test_rows_of_a_mot_file_are_counted_with_its_header(tmp_path):
    with pytest.raises(DataError, match=r"a\.mot, row 10, column time"):
        read(write_mot(with_stalled_time(elevation()), tmp_path / "a.mot", "yes"))


def test_a_mot_file_must_say_its_unit(tmp_path):
    with pytest.raises(DataError, match="inDegrees"):
        read(write_mot(elevation(), tmp_path / "a.mot", "perhaps"))


def test_humerus_may_be_wound_up_but_no_other_joint(tmp_path):
    """A blind case was refused for a GH_y of 732 deg, made continuous over several elevations."""
    table = elevation()
    plain = read(write_csv(table, tmp_path / "a.csv"))
    wound = read(write_csv(table.assign(GH_y=table.GH_y + 1080.0), tmp_path / "b.csv"))
    np.testing.assert_allclose(
        np.exp(1j * wound.angles_rad), np.exp(1j * plain.angles_rad), atol=1e-9
    )
    with pytest.raises(DataError, match=r"column SC_y: .* deg is beyond 2 turns"):
        read(write_csv(table.assign(SC_y=table.SC_y + 1080.0), tmp_path / "c.csv"))


@pytest.mark.parametrize("turns", [-1, 1])
def test_an_elbow_wound_by_a_turn_is_the_same_elbow(tmp_path, turns):
    """Ball joints are compared as rotations; the one angle of the elbow is not."""
    table = elevation()
    wound = table.assign(EL_x=table["EL_x"] + 360.0 * turns)
    paths = [write_csv(t, tmp_path / f"a_r{i}.csv") for i, t in enumerate((table, wound), 1)]
    [one, other], _ = read_trials(paths, {})
    np.testing.assert_allclose(other.angles_rad, one.angles_rad, atol=1e-12)


def test_degrees_declared_as_radians_are_refused(tmp_path):
    with pytest.raises(DataError, match=r"row 6, column SC_y: -25.0 rad is beyond 2 turns"):
        read(write_mot(elevation(), tmp_path / "a.mot", "no"))


@pytest.mark.parametrize(
    ("companion", "message"),
    [
        ({"time": np.arange(11.0), "other": 1.0}, "found time, other; expected EMG_"),
        ({"time": np.linspace(1.5, 3.0, 50), "EMG_a": 0.1}, "expected to cover the movement"),
    ],
)
def test_bad_companions_are_refused(tmp_path, companion, message):
    path = write_csv(elevation(), tmp_path / "a.csv")
    write_csv(pd.DataFrame(companion), tmp_path / "a_emg.csv")
    with pytest.raises(DataError, match=message):
        read(path)


def test_emg_in_two_places_is_refused(tmp_path):
    path = write_csv(elevation().assign(EMG_a=0.1), tmp_path / "a.csv")
    write_csv(pd.DataFrame({"time": [0.0, 3.0], "EMG_a": 0.1}), tmp_path / "a_emg.csv")
    with pytest.raises(DataError, match="expected one of them"):
        read(path)


def case_of(folder: Path, test: dict[str, float], reference: dict[str, float], **participant):
    """A case of elevations with these peaks [deg], in files of these names."""
    folder.mkdir(exist_ok=True)
    file = read_participant_file(write_participant(folder, **participant), "published")
    sides = [
        read_trials(
            [write_csv(elevation(peak_deg=p), folder / f"{name}.csv") for name, p in side.items()],
            file.trials,
        )[0]
        for side in (test, reference)
    ]
    return make_case(file.participant, *sides)


def test_names_and_order_of_files_do_not_change_a_case(tmp_path):
    one = case_of(tmp_path / "one", {"lift_r1": 60, "lift_r2": 61, "push_r1": 40}, {"lift_r3": 59})
    other = case_of(
        tmp_path / "two", {"x_r1": 40, "b_r7": 61, "b_r2": 60}, {"b_r1": 59}, id="someone else"
    )
    assert case_hash(one) == case_hash(other)
    for first, second in zip(one.test, other.test, strict=True):
        np.testing.assert_array_equal(first.angles_rad, second.angles_rad)


@pytest.mark.parametrize(
    ("test", "reference", "participant"),
    [
        ({"lift_r1": 60, "push_r1": 62}, {"lift_r3": 59}, {}),
        ({"lift_r1": 60, "lift_r2": 61}, {"push_r3": 59}, {}),
        ({"lift_r1": 60, "lift_r2": 61.5}, {"lift_r3": 59}, {}),
        ({"lift_r1": 60, "lift_r2": 61}, {}, {}),
        (
            {"lift_r1": 60, "lift_r2": 61},
            {"lift_r3": 59},
            {"model": {"generic": True, "body_mass_kg": 81, "height_m": 1.8}},
        ),
    ],
)
def test_content_does_change_a_case(tmp_path, test, reference, participant):
    base = case_of(tmp_path / "one", {"lift_r1": 60, "lift_r2": 61}, {"lift_r3": 59})
    assert case_hash(base) != case_hash(case_of(tmp_path / "two", test, reference, **participant))


def test_a_recording_is_never_its_own_reference(tmp_path):
    with pytest.raises(DataError, match="same recording as test and as reference"):
        case_of(tmp_path, {"lift_r1": 60}, {"push_r1": 60})


def test_the_same_recording_twice_counts_once(tmp_path):
    case = case_of(tmp_path, {"lift_r1": 60, "lift_r2": 60}, {"lift_r3": 59})
    assert len(case.test) == 1
    assert "counted once" in case.notes[0]
