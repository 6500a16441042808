"""Participants from landmarks and body size, as a diagnosis and as the study read them."""

from pathlib import Path

import made_recordings as made
import numpy as np
import pandas as pd
import pytest
import yaml
from scipy.spatial.transform import Rotation

from scapulohumeral import cli
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.recording.participant_file import find_participant, read_participant_file
from scapulohumeral.laboratory.body_size import Body, scale_factors, segment_masses, total_mass
from scapulohumeral.laboratory.participant import task_and_repeat
from scapulohumeral.laboratory.record import read_channels, record_path, write_trial
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.participant_schema import SCALED_SEGMENTS

pytestmark = pytest.mark.unit
MODEL = made.tables()
SIZE = 1.12
BODY = ["--body-mass", "60", "--height", "1.65", "--sex", "female"]


def session(
    folder: Path, names: list[str], bent: tuple[str, ...] = (), by_deg: float = 20.0
) -> list[str]:
    """Recordings of a person 1.12 times the model, and their map; arguments of the commands.

    In those that are `bent`, the trunk leans by so much more.
    """
    points = made.landmarks(made.arm_angles(), MODEL)
    more = Rotation.from_euler("x", by_deg, degrees=True).as_matrix()
    for name in names:
        turn = more if name in bent else np.eye(3)
        larger = {label: SIZE * p @ turn.T for label, p in points.items()}
        made.write_c3d(folder / f"{name}.c3d", made.marked(larger))
    return ["--map", str(made.write_map(folder / "map.yaml"))]


def test_scale_factors_are_those_of_the_person() -> None:
    points = made.landmarks(made.arm_angles(), MODEL)
    larger = {name: SIZE * p for name, p in points.items()}
    longer_arm = larger | {"EL": larger["EL"] + 0.1 * (larger["EL"] - larger["GH"])}
    assert scale_factors([larger], MODEL) == pytest.approx(
        dict.fromkeys(SCALED_SEGMENTS, SIZE), rel=1e-2
    )
    changed = scale_factors([longer_arm], MODEL)
    assert changed["humerus_r"] > 1.03 * SIZE
    assert changed["scapula_r"] == pytest.approx(SIZE, rel=1e-3)


def test_masses_are_fractions_of_body_mass() -> None:
    """De Leva 1996, women: 2.55, 1.38 and 0.56 % of body mass."""
    masses = segment_masses(Body(60.0, 1.65, "female"), MODEL)
    assert masses["humerus_r"] == pytest.approx(0.0255 * 60.0)
    assert masses["ulna_r"] + masses["radius_r"] == pytest.approx(0.0138 * 60.0)
    assert masses["hand_r"] == pytest.approx(0.0056 * 60.0)
    # Scaled as a whole to this mass, the arm of the model weighs as much.
    base = {name: MODEL.segments[name].mass_kg for name in SCALED_SEGMENTS}
    ratio = total_mass(masses, MODEL) / sum(base.values())
    arm = [name for name in SCALED_SEGMENTS if name != "thorax"]
    assert ratio * sum(base[n] for n in arm) == pytest.approx(sum(masses[n] for n in arm))


def test_convert_writes_the_participant_of_a_diagnosis(tmp_path: Path) -> None:
    arguments = session(tmp_path, ["reach_before_1", "reach_before_2", "reach_after_1"])
    files = [str(file) for file in sorted(tmp_path.glob("*.c3d"))]
    tasks = ["--tasks", r"(?P<task>[a-z]+)_.*_(?P<repeat>\d+)$"]
    out = tmp_path / "out"
    more = ["--out", str(out), "--id", "ann", *BODY, *tasks]
    assert cli.main(["convert", *files, *arguments, *more]) == 0
    file = read_participant_file(find_participant(sorted(out.glob("*.csv"))), "published")
    person = file.participant
    assert person.id == "ann"
    assert person.model.scale["humerus_r"] == pytest.approx((SIZE,) * 3, rel=2e-3)
    assert person.model.segment_mass_kg["hand_r"] == pytest.approx(0.0056 * 60.0, rel=1e-3)
    assert (file.trials["reach_after_1"].task, file.trials["reach_after_1"].repeat) == ("reach", 1)
    assert file.trials["reach_before_2"].repeat == 2
    # The person leans by 8 deg about the axis to the right: gravity turns the other way.
    lean = np.deg2rad(made.LEAN_DEG)
    expected = 9.80665 * np.array([0.0, -np.cos(lean), -np.sin(lean)])
    assert np.abs(np.abs(person.gravity_mps2) - np.abs(expected)).max() < 0.02
    up = made.TO_LABORATORY.T @ [0.0, 0.0, 1.0]
    assert np.array(person.gravity_mps2) == pytest.approx(-9.80665 * up, abs=0.01)


def test_a_further_conversion_keeps_what_the_participant_file_says(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """EMG and windows of trials, which emg and the person at the keyboard put there."""
    arguments = session(tmp_path, ["reach_1", "reach_2"])
    out = tmp_path / "out"
    more = [*BODY, "--tasks", r"(?P<task>[a-z]+)_(?P<repeat>\d+)", "--out", str(out)]
    first, second = (str(tmp_path / f"reach_{i}.c3d") for i in (1, 2))
    assert cli.main(["convert", first, *arguments, *more, "--id", "ann"]) == 0
    file = out / "participant.yaml"
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    document["emg"] = {"unit": "fraction_of_mvc", "channels": {"EMG_infra": ["infra"]}}
    document["trials"]["reach_1"]["window_s"] = [0.1, 0.9]
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    assert cli.main(["convert", second, *arguments, *more, "--id", "ann"]) == 0
    read = read_participant_file(file, "published")
    assert read.participant.emg_channels == {"EMG_infra": ("infra",)}
    assert read.trials["reach_1"].window_s == (0.1, 0.9)
    assert read.trials["reach_2"].repeat == 2
    assert "scale factors" not in capsys.readouterr().out
    scaled = yaml.safe_load((out / "scaled.yaml").read_text(encoding="utf-8"))
    smaller = {**scaled["segment_scale"][0], "scale_xyz": [1.05] * 3}
    scaled["segment_scale"][0] = smaller
    (out / "scaled.yaml").write_text(yaml.safe_dump(scaled), encoding="utf-8")
    assert cli.main(["convert", second, *arguments, *more, "--id", "ann"]) == 0
    said = capsys.readouterr().out
    assert "scale factors are those of the recordings converted now" in said
    assert "for 1.050); convert all recordings at once" in said
    before = file.read_bytes()
    assert cli.main(["convert", second, *arguments, *more, "--id", "bob"]) == 2
    assert "is of 'ann', for a diagnosis, and would be replaced" in capsys.readouterr().err
    assert file.read_bytes() == before


def gravity_of(file: Path) -> np.ndarray:
    return np.array(yaml.safe_load(file.read_text(encoding="utf-8"))["gravity_in_thorax_mps2"])


def test_gravity_is_that_of_all_trials_however_many_runs_brought_them(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A trial that comes later does not tilt those before; one that leans otherwise is named."""
    names = ["reach_1", "reach_2", "stoop_1"]
    arguments = session(tmp_path, [*names, "static"], bent=("stoop_1",))
    files = {name: str(tmp_path / f"{name}.c3d") for name in names}
    at_once, in_turn = tmp_path / "at_once", tmp_path / "in_turn"
    more = [*BODY, "--id", "ann", *arguments]
    assert cli.main(["convert", *files.values(), *more, "--out", str(at_once)]) == 0
    assert cli.main(["convert", files["reach_1"], *more, "--out", str(in_turn)]) == 0
    upright = gravity_of(in_turn / "participant.yaml")
    rest = [files["reach_2"], files["stoop_1"]]
    capsys.readouterr()
    assert cli.main(["convert", *rest, *more, "--out", str(in_turn)]) == 0
    said = capsys.readouterr().out
    assert "note      stoop_1: gravity is turned by 13 deg" in said
    assert "note      reach_1: gravity is turned by 7 deg" in said
    mean = gravity_of(at_once / "participant.yaml")
    np.testing.assert_allclose(gravity_of(in_turn / "participant.yaml"), mean, atol=1e-4)
    assert np.linalg.norm(mean - upright) > 0.5

    person = ["participant", "--static", str(tmp_path / "static.c3d"), *more]
    people = ["--out", str(tmp_path / "people"), "--trials"]
    assert cli.main([*person, *people, str(at_once / "reach_1.csv")]) == 0
    file = tmp_path / "people" / "ann" / "participant.yaml"
    np.testing.assert_allclose(gravity_of(file), upright, atol=1e-4)
    later = [str(at_once / f"{name}.csv") for name in names[1:]]
    capsys.readouterr()
    assert cli.main([*person, *people, *later]) == 0
    assert "note      stoop_1: gravity is turned by 13 deg" in capsys.readouterr().out
    np.testing.assert_allclose(gravity_of(file), mean, atol=1e-4)


def test_a_static_posture_that_nobody_holds_is_no_measure_of_a_person(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Companions of trials are no trials."""
    arguments = session(tmp_path, ["upright", "reach", "fallen"], ("fallen",), by_deg=65.0)
    out = tmp_path / "out"
    assert cli.main(["convert", str(tmp_path / "reach.c3d"), *arguments, "--out", str(out)]) == 0
    (out / "reach_emg.csv").write_text("time,EMG_infra\n0.0,0.1\n", encoding="utf-8")
    trials = ["--trials", *map(str, sorted(out.glob("*.csv")))]
    more = [*arguments, *BODY, "--id", "ann", "--out", str(tmp_path / "people"), *trials]
    assert cli.main(["participant", "--static", str(tmp_path / "fallen.c3d"), *more]) == 2
    assert "fallen.c3d: thorax tilted by" in capsys.readouterr().err
    assert cli.main(["participant", "--static", str(tmp_path / "upright.c3d"), *more]) == 0
    assert set(read_participant(tmp_path / "people", "ann").trials) == {"reach"}


def test_what_is_worth_a_look_in_a_static_posture_is_said(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = session(tmp_path, ["reach"])
    out = tmp_path / "out"
    assert cli.main(["convert", str(tmp_path / "reach.c3d"), *arguments, "--out", str(out)]) == 0
    static = tmp_path / "static.csv"
    points = {name: SIZE * p[:1] for name, p in made.landmarks(made.arm_angles(), MODEL).items()}
    made.WRITERS[".csv"](static, made.marked(points))
    more = ["--trials", str(out / "reach.csv"), "--out", str(tmp_path / "people"), "--id", "ann"]
    person = ["participant", "--static", str(static), *arguments, *BODY, *more]
    said = "note      static.csv: nothing says where up is"
    assert cli.main(person) == 0
    assert said not in capsys.readouterr().out
    written = tmp_path / "map.yaml"
    written.write_text(written.read_text(encoding="utf-8").replace('up: "+z"\n', ""), "utf-8")
    assert cli.main(person) == 0
    assert said in capsys.readouterr().out


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_one_frame_is_enough_of_a_static_posture(tmp_path: Path, suffix: str) -> None:
    arguments = session(tmp_path, ["reach"])
    out = tmp_path / "out"
    assert cli.main(["convert", str(tmp_path / "reach.c3d"), *arguments, "--out", str(out)]) == 0
    still = {n: SIZE * p[:1] for n, p in made.landmarks(made.arm_angles(), MODEL).items()}
    static = tmp_path / f"static{suffix}"
    made.WRITERS[suffix](static, made.marked(still))
    more = ["--trials", str(out / "reach.csv"), "--out", str(tmp_path / "people"), "--id", "ann"]
    assert cli.main(["participant", "--static", str(static), *arguments, *BODY, *more]) == 0
    person = read_participant(tmp_path / "people", "ann")
    assert person.scale["scapula_r"] == pytest.approx((SIZE,) * 3, rel=2e-3)


def test_trials_of_one_name_and_recordings_in_their_place_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = session(tmp_path, ["static"])
    twice = [str(tmp_path / folder / "reach.csv") for folder in ("a", "b")]
    more = ["--trials", *twice, "--out", str(tmp_path / "people"), "--id", "ann", *BODY]
    static = ["--static", str(tmp_path / "static.c3d")]
    assert cli.main(["participant", *static, *arguments, *more]) == 2
    assert "trials named reach more than once" in capsys.readouterr().err
    recorded = tmp_path / "reach.csv"
    made.WRITERS[".csv"](recorded, made.marked(made.landmarks(made.arm_angles(), MODEL)))
    before = recorded.read_bytes()
    assert cli.main(["convert", str(recorded), *arguments, "--out", str(tmp_path)]) == 2
    assert "reach.csv: is read, and the result would replace it" in capsys.readouterr().err
    assert recorded.read_bytes() == before
    tasks = ["--tasks", "(?P<task>[a-z]+)_(?P<repeat>[0-9]+)", "--out", str(tmp_path / "out")]
    assert cli.main(["convert", str(recorded), *arguments, *BODY, *tasks]) == 2
    assert "fits none of reach as a whole" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_tables_that_convert_did_not_make_are_not_replaced(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Laboratories export analog signals as .csv beside the .c3d of the same name."""
    arguments = session(tmp_path, ["reach"])
    call = ["convert", str(tmp_path / "reach.c3d"), *arguments, "--out", str(tmp_path)]
    analog = tmp_path / "reach.csv"
    analog.write_text("time_s,EMG_V\n0,0\n", encoding="utf-8")
    assert cli.main(call) == 2
    assert "reach.csv: is there without reach.recording.json" in capsys.readouterr().err
    assert analog.read_text(encoding="utf-8") == "time_s,EMG_V\n0,0\n"
    analog.unlink()
    assert cli.main(call) == 0
    assert cli.main(call) == 0, "its own table is replaced"


def test_a_participant_of_the_study_is_read_by_the_study(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = session(tmp_path, ["static", "frontal", "reach"])
    out, people = tmp_path / "out", tmp_path / "people"
    files = [str(tmp_path / f"{name}.c3d") for name in ("frontal", "reach")]
    assert cli.main(["convert", *files, *arguments, "--out", str(out)]) == 0
    trials = [str(out / "frontal.csv"), str(out / "reach.csv")]
    more = ["--trials", *trials, "--out", str(people), "--id", "ann", *BODY]
    static = ["--static", str(tmp_path / "static.c3d")]
    record = record_path(out / "reach.csv")
    sound = record.read_text(encoding="utf-8")
    record.write_text(sound.replace('"usable": true', '"usable": false'), encoding="utf-8")
    assert cli.main(["participant", *static, *arguments, *more]) == 0
    said = capsys.readouterr().out
    assert "note      reach: has a fault" in said
    assert "note      frontal" not in said
    person = read_participant(people, "ann")
    assert set(person.trials) == {"frontal", "reach"}
    assert person.body_mass_kg == 60.0
    assert person.scale["scapula_r"] == pytest.approx((SIZE,) * 3, rel=2e-3)
    assert person.gravity_mps2 == pytest.approx(
        tuple(-9.80665 * made.TO_LABORATORY.T @ [0.0, 0.0, 1.0]), abs=0.01
    )
    assert read_channels(people / "ann" / "frontal.csv")["SC_x"].status == "estimated"
    # What its own comment asks for outlives a further call, of one of the trials.
    file = people / "ann" / "participant.yaml"
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    document["trials"]["reach"] |= {"hand_load_kg": 2.0, "daily_task": True}
    file.write_text(yaml.safe_dump(document), encoding="utf-8")
    record.unlink()
    more[1:3] = [str(out / "reach.csv")]
    assert cli.main(["participant", *static, *arguments, *more]) == 0
    again = read_participant(people, "ann").trials
    assert set(again) == {"frontal", "reach"}
    assert (again["reach"].hand_load_kg, again["reach"].daily_task) == (2.0, True)
    assert again["frontal"].hand_load_kg == 0.0
    assert read_channels(people / "ann" / "reach.csv")["SC_x"].status == "measured"
    # No conversion speaks for this table, so it is looked at here.
    turned = pd.read_csv(out / "reach.csv")
    turned["AC_y_deg"] *= -1.0
    turned.to_csv(out / "reach.csv", index=False)
    assert cli.main(["participant", *static, *arguments, *more]) == 2
    assert "reach.csv: AC_y reaches" in capsys.readouterr().err


def test_a_smoothed_table_is_not_smoothed_again(tmp_path: Path) -> None:
    arguments = session(tmp_path, ["static", "frontal", "reach"])
    out, people = tmp_path / "out", tmp_path / "people"
    for name, smooth in (("frontal", ["--smooth-hz", "5"]), ("reach", [])):
        call = ["convert", str(tmp_path / f"{name}.c3d"), *arguments, *smooth, "--out", str(out)]
        assert cli.main(call) == 0
    trials = [str(out / "frontal.csv"), str(out / "reach.csv")]
    more = ["--trials", *trials, "--out", str(people), "--id", "ann", *BODY]
    assert (
        cli.main(["participant", "--static", str(tmp_path / "static.c3d"), *arguments, *more]) == 0
    )
    entries = yaml.safe_load((people / "ann" / "participant.yaml").read_text(encoding="utf-8"))[
        "trials"
    ]
    assert "smooth_cutoff_hz" not in entries["frontal"]
    assert entries["reach"]["smooth_cutoff_hz"] == 6.0


def test_a_participant_that_the_study_cannot_use_is_not_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A broken one would stop the study of all others."""
    arguments = session(tmp_path, ["static"])
    angles = made.arm_angles()
    for name, rate in (("frontal", 100.0), ("slow", 10.0)):
        motion = Motion(np.arange(len(angles)) / rate, angles)
        write_trial(tmp_path / f"{name}.csv", motion)
    trials = [str(tmp_path / f"{name}.csv") for name in ("frontal", "slow")]
    more = ["--trials", *trials, "--out", str(tmp_path / "people"), "--id", "ann", *BODY]
    static = ["--static", str(tmp_path / "static.c3d")]
    assert cli.main(["participant", *static, *arguments, *more]) == 2
    assert f"{trials[1]}: cut-off 6.0 Hz; expected" in capsys.readouterr().err
    assert not (tmp_path / "people").exists()


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (["--height", "165"], "expected 1 to 2.5 m"),
        (["--body-mass", "600"], "expected 20 to 300 kg"),
        (["--id", "Ann 1"], "expected small letters and digits"),
    ],
)
def test_wrong_persons_are_refused(
    change: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = session(tmp_path, ["frontal"])
    file, out = str(tmp_path / "frontal.c3d"), str(tmp_path / "out")
    assert cli.main(["convert", file, *arguments, "--out", out]) == 0
    more = ["--trials", str(tmp_path / "out" / "frontal.csv"), "--id", "ann", *BODY]
    people = str(tmp_path / "people")
    call = ["participant", "--static", file, *arguments, "--out", people, *more, *change]
    assert cli.main(call) == 2
    assert said in capsys.readouterr().err


def test_tasks_need_their_groups(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = session(tmp_path, ["reach_1"])
    call = ["convert", str(tmp_path / "reach_1.c3d"), *arguments, "--out", str(tmp_path / "out")]
    assert cli.main([*call, *BODY, "--tasks", "([a-z]+)_"]) == 2
    assert "expected groups (?P<task>...)" in capsys.readouterr().err
    assert cli.main([*call, *BODY, "--tasks", r"(?P<task>x+)(?P<repeat>\d)"]) == 2
    assert "fits none of reach_1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("pattern", "said"),
    [
        ("(?P<task>.+)_(?P<repeat>.+)", "finds the repeat 'a' in reach_a"),
        ("(?P<task>.+)_a(?P<repeat>[0-9])?", "finds the repeat '' in reach_a"),
        ("(?P<task>x)?.*(?P<repeat>[0-9])", "finds no task in reach_0"),
        ("(?P<task>[a-z]+)_(?P<repeat>[0-9]+)", "finds the repeat '0' in reach_0"),
    ],
)
def test_tasks_and_repeats_are_those_that_a_diagnosis_reads(pattern: str, said: str) -> None:
    with pytest.raises(ConfigError, match=said):
        task_and_repeat(pattern, ["reach_a", "reach_0"])
    found = task_and_repeat("(?P<task>.+)_(?P<repeat>[0-9]+)", ["reach_01"])
    assert found == {"reach_01": {"task": "reach", "repeat": 1}}
