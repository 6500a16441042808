"""Participants of the study can be read, and each kind of bad input is refused with a remedy."""

import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from places import REPOSITORY

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.motion import read_motion
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.participant_file import list_participants

pytestmark = pytest.mark.unit

PARTICIPANTS = REPOSITORY / "config" / "participants"


@pytest.fixture
def folder(tmp_path):
    """A copy of the participants that a test may damage."""
    return Path(shutil.copytree(PARTICIPANTS, tmp_path / "participants"))


def replace(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


@pytest.mark.parametrize("name", list_participants(PARTICIPANTS))
def test_every_participant_of_the_study_can_be_read(name):
    participant = read_participant(PARTICIPANTS, name)
    assert {"frontal", "scapular", "sagittal"} <= set(participant.trials)
    for trial in participant.trials.values():
        assert trial.motion.angles_rad.shape == (len(trial.motion.time_s), 10)
        if trial.published_file:
            assert read_motion(trial.published_file).angles_rad.shape[1] == 10
    for file in participant.predictions.values():
        read_motion(file)


def test_angles_are_in_radians_and_in_order():
    motion = read_participant(PARTICIPANTS, "par2").trial("frontal").motion
    np.testing.assert_allclose(
        np.rad2deg(motion.angles_rad[0, [0, 3, 9]]), [-25.365, 37.782, 20.289]
    )


@pytest.mark.parametrize("name", ["par1", "par2"])
def test_lifting_has_the_load_of_its_recording(name):
    assert read_participant(PARTICIPANTS, name).trial("lifting").hand_load_kg == 2.0


def test_daily_tasks_are_recorded_but_are_no_elevations():
    participant = read_participant(PARTICIPANTS, "par1")
    elevations = [participant.trial(name).motion for name in ("frontal", "scapular", "sagittal")]
    assert participant.elevations == elevations
    assert len(participant.recordings) == len(elevations) + 4, "lifting counts once"


def test_unknown_participant_lists_the_known_ones():
    with pytest.raises(ConfigError, match="'par9'.*Choose from par1, par2, par3"):
        read_participant(PARTICIPANTS, "par9")


def test_unknown_trial_lists_the_known_ones():
    participant = read_participant(PARTICIPANTS, "par3")
    with pytest.raises(ConfigError, match="'drinking' of par3.*frontal, scapular, sagittal"):
        participant.trial("drinking")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("GH_z_deg", "GH_z", "row 1: missing column GH_z_deg; found time_s"),
        ("-25.365", "nan", "row 2, column SC_y_deg: nan; expected a finite number"),
        ("-25.365", "", "row 2, column SC_y_deg: '' is not a number"),
        ("-25.365", "-25,365", "row 2: 12 cells, expected 11"),
        ("-25.256", "rest", "row 3, column SC_y_deg: 'rest' is not a number"),
        ("\n0.0321", "\n0.0000", "row 3, column time_s: 0.0 s does not follow 0.0 s"),
        ("-25.365", "-2536.5", "row 2, column SC_y_deg: -2536.5 deg is beyond one turn"),
    ],
)
def test_damaged_recording_is_refused_with_its_place(folder, old, new, message):
    path = folder / "par2" / "frontal.csv"
    replace(path, old, new)
    with pytest.raises(DataError, match=message) as refusal:
        read_participant(folder, "par2")
    assert "par2/frontal.csv" in str(refusal.value)


def _spoilt(folder: Path, change) -> None:
    path = folder / "par2" / "frontal.csv"
    change(table := pd.read_csv(path))
    table.to_csv(path, index=False)


def _milliseconds(table):
    table["time_s"] *= 1000.0


def _hole(table):
    table.loc[20:, "time_s"] += 1.5


def _jump(table):
    table.loc[30, "SC_y_deg"] += 60.0


def _turned_scapula(table):
    table["AC_z_deg"] += 120.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (_milliseconds, "column time_s: steps of .* s; expected 0.2 s or less.*milliseconds"),
        (_hole, "row 22, column time_s: .* expected 1 s or less between rows"),
        (_jump, "row 32: the clavicle turns by .* deg/s"),
        (_turned_scapula, "row 2, column AC_y_deg: the joint is at .* no shoulder turns further"),
    ],
)
def test_a_motion_that_no_shoulder_makes_is_refused(folder, change, message):
    _spoilt(folder, change)
    with pytest.raises(DataError, match=f"par2/frontal.csv, {message}"):
        read_participant(folder, "par2")


def test_full_turns_of_a_recording_do_not_count(folder):
    recorded = read_participant(folder, "par2").trial("frontal").motion.angles_rad

    def wind(table):
        table["GH_y_deg"] += 360.0

    _spoilt(folder, wind)
    wound = read_participant(folder, "par2").trial("frontal").motion.angles_rad
    np.testing.assert_allclose(wound, recorded, atol=1e-12)


@pytest.mark.parametrize(
    ("gravity", "message"),
    [
        ("[0.0, 9.80665, 0.0]", "points up"),
        ("[0.0, 0.0, 0.0]", "has length 0.000"),
        ("[0.0, -1.0, 0.0]", "has length 1.000; expected 9.80665"),
    ],
)
def test_gravity_of_no_place_on_earth_is_refused(folder, gravity, message):
    path = folder / "par2" / "participant.yaml"
    line = next(x for x in path.read_text().splitlines() if x.startswith("gravity_in_thorax"))
    replace(path, line, f"gravity_in_thorax_mps2: {gravity}")
    with pytest.raises(ConfigError, match=f"gravity_in_thorax_mps2: .* {message}"):
        read_participant(folder, "par2")


def test_radians_are_refused(tmp_path):
    motion = read_motion(PARTICIPANTS / "par2" / "frontal.csv")
    path = tmp_path / "radians.csv"
    header = (PARTICIPANTS / "par2" / "frontal.csv").read_text().splitlines()[0]
    table = np.column_stack([motion.time_s, motion.angles_rad])
    np.savetxt(path, table, delimiter=",", header=header, comments="")
    with pytest.raises(DataError, match="these are radians; expected degrees. Multiply"):
        read_motion(path)


def test_too_few_frames_are_refused(tmp_path):
    lines = (PARTICIPANTS / "par2" / "frontal.csv").read_text().splitlines()[:3]
    (tmp_path / "short.csv").write_text("\n".join(lines))
    with pytest.raises(DataError, match="2 frames; a motion needs at least 4"):
        read_motion(tmp_path / "short.csv")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("id: par2", "id: par3", "id: 'par3'; expected 'par2'"),
        ("side: right", "side: left", "side: 'left'.*mirror left ones"),
        ("body_mass_kg: null", "body_mass_kg: 800", "body_mass_kg: 800 is greater than"),
        ("hand_r: [1.0, 1.0, 1.0]", "hand_r: [1.0, 1.0, 9.0]", "scale.hand_r.2: 9.0 is greater"),
        ("hand_r: [1.0, 1.0, 1.0]", "hand_r: [1.0, 1.0]", r"scale.hand_r: \[1.0, 1.0\] is too"),
        ("  thorax: [", "  chest: [", "scale.chest: there is no such key.*thorax"),
        ("published_total_kg: 36.5311", "published_total_kg: -1", "mass.published_total_kg: -1"),
        ("hand_load_kg: 2.0", "hand_load_kg: -2.0", "trials.lifting.hand_load_kg: -2.0"),
        ("hand_load_kg: 2.0", "load_kg: 2.0", "lifting.load_kg: .*Did you mean hand_load_kg"),
        ("schema: participant/1", "schema: participant/0", "schema: 'participant/1' was expected"),
        ("trials:", "trials: [", "cannot be read as YAML"),
        ("file: lifting.csv", "file: lift.csv", "lift.csv: no such file"),
    ],
)
def test_wrong_participant_file_is_refused(folder, old, new, message):
    replace(folder / "par2" / "participant.yaml", old, new)
    with pytest.raises((ConfigError, DataError), match=message) as refusal:
        read_participant(folder, "par2")
    assert "par2/" in str(refusal.value)


def test_raw_recording_is_smoothed_where_the_participant_says_so(folder):
    path = folder / "par2" / "participant.yaml"
    raw = read_participant(folder, "par2").trial("frontal").motion
    replace(
        path,
        "frontal.csv, hand_load_kg: 0.0",
        "frontal.csv, hand_load_kg: 0.0, smooth_cutoff_hz: 3",
    )
    smooth = read_participant(folder, "par2").trial("frontal").motion
    jerk = [np.abs(np.diff(m.angles_rad[:, 9], 3)).max() for m in (raw, smooth)]
    assert jerk[1] < jerk[0]
    np.testing.assert_allclose(smooth.angles_rad[:, 9], raw.angles_rad[:, 9], atol=0.05)
