"""Bad input is refused with its place and a remedy: no traceback, no answer, nothing solved.

Each kind is a function that spoils a sound case in a folder and may give arguments to the command,
with what the refusal says of the place and of the remedy.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml
from gap_files import (
    elevation,
    finished_diagnosis,
    participant_document,
    write_csv,
    write_mot,
    write_participant,
)
from places import REPOSITORY

from scapulohumeral.gap import cli, pipeline
from scapulohumeral.gap.nominal import participant_model
from scapulohumeral.laboratory.record import record_path
from scapulohumeral.model.participant_schema import SCALED_SEGMENTS
from scapulohumeral.model.rotations import ANGLE_NAMES

pytestmark = pytest.mark.unit
FEWEST_KINDS = 60
REFUSED = 2
TEST, REFERENCE = "lift_r1.csv", "lift_r2.csv"


@dataclass(frozen=True)
class Bad:
    """A kind of bad input: what is done to a sound case, and what the refusal must say.

    `spoil` : gets the folder of the case; gives options that replace or follow the sound ones
    `place`, `remedy` : parts of the message
    """

    kind: str
    spoil: Callable[[Path], list[str] | None]
    place: str
    remedy: str


def table(change: Callable[[pd.DataFrame], pd.DataFrame]) -> Callable[[Path], None]:
    """Change the table of the test trial."""
    return lambda folder: void(write_csv(change(elevation()), folder / TEST))


def text(content: str | bytes, name: str = TEST) -> Callable[[Path], None]:
    """Replace a file, by default the test trial."""
    data = content.encode() if isinstance(content, str) else content
    return lambda folder: void((folder / name).write_bytes(data))


def companion(kind: str, **columns: object) -> Callable[[Path], None]:
    """Add a companion to the test trial."""
    return lambda folder: void(write_csv(pd.DataFrame(columns), folder / f"lift_r1_{kind}.csv"))


def person(**changes: object) -> Callable[[Path], None]:
    """Change the participant file."""
    return lambda folder: void(write_participant(folder, **changes))


def emg(**changes: object) -> Callable[[Path], None]:
    """Change the EMG set-up in the participant file."""
    return person(emg=participant_document()["emg"] | changes)


def size(**changes: object) -> Callable[[Path], None]:
    """Change the body size in the participant file."""
    return person(model=participant_document()["model"] | changes)


def scaled(change: Callable[[dict], object]) -> Callable[[Path], None]:
    """A participant scaled by a table of segments that is changed."""

    def spoil(folder: Path) -> None:
        document = {
            "bodies": [{"name": name, "mass_kg": 2.0} for name in SCALED_SEGMENTS],
            "segment_scale": [
                {"segment": name, "scale_xyz": [1.0, 1.1, 1.2]} for name in SCALED_SEGMENTS
            ],
        }
        change(document)
        (folder / "scaled.yaml").write_text(yaml.safe_dump(document))
        write_participant(folder, model={"file": "scaled.yaml"})

    return spoil


def asked(*options: str) -> Callable[[Path], list[str]]:
    """Further options of the command; FOLDER stands for the folder of the case."""
    return lambda folder: [option.replace("FOLDER", str(folder)) for option in options]


def configured(option: str, name: str, *keys: str, value: object) -> Callable[[Path], list[str]]:
    """A configuration file with one value replaced."""

    def spoil(folder: Path) -> list[str]:
        content = yaml.safe_load((REPOSITORY / "config" / name).read_text())
        part = content
        for key in keys[:-1]:
            part = part[key]
        part[keys[-1]] = value
        path = folder / "changed.yaml"
        path.write_text(yaml.safe_dump(content))
        return [option, str(path)]

    return spoil


def every(*spoils: Callable[[Path], list[str] | None]) -> Callable[[Path], list[str]]:
    """Several at once."""
    return lambda folder: [option for spoil in spoils for option in spoil(folder) or []]


def void(_: object) -> None:
    """Whatever a spoiling function gives is no option."""


def in_radians(trial: pd.DataFrame) -> pd.DataFrame:
    return trial.assign(**{name: np.deg2rad(trial[name]) for name in ANGLE_NAMES})


def cell(column: str, value: object) -> Callable[[pd.DataFrame], pd.DataFrame]:
    """A trial with another value in its third row, the fourth of the file."""
    return lambda trial: trial.assign(
        **{column: [value if i == 2 else old for i, old in enumerate(trial[column])]}
    )


def as_mot(unit: str, change=lambda trial: trial) -> Callable[[Path], list[str]]:
    """The test trial as .mot."""

    def spoil(folder: Path) -> list[str]:
        return ["TESTS", str(write_mot(change(elevation()), folder / "lift_r1.mot", unit))]

    return spoil


def trials(*names: str) -> Callable[[Path], list[str]]:
    """Other test files."""
    return lambda folder: ["TESTS", *(str(folder / name) for name in names)]


def folder_instead(name: str) -> Callable[[Path], None]:
    """A folder in the place of a file."""

    def spoil(folder: Path) -> None:
        (folder / name).unlink(missing_ok=True)
        (folder / name).mkdir(parents=True)

    return spoil


def link_to_nothing(folder: Path) -> None:
    (folder / TEST).unlink()
    (folder / TEST).symlink_to(folder / "gone.csv")


def without(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def renamed_reference(folder: Path) -> list[str]:
    (folder / REFERENCE).rename(folder / "push_r1.csv")
    return ["--reference", str(folder / "push_r1.csv")]


def strange_record(content: str) -> Callable[[Path], None]:
    return lambda folder: void(record_path(folder / TEST).write_text(content))


def two_people(folder: Path) -> list[str]:
    other = folder / "other"
    other.mkdir()
    write_participant(other)
    return ["TESTS", str(folder / TEST), str(write_csv(elevation(), other / "lift_r3.csv"))]


def other_reference(**changes: object) -> Callable[[Path], list[str]]:
    """A reference trial in a folder of its own, beside a participant file that is changed."""

    def spoil(folder: Path) -> list[str]:
        beside = folder / "elsewhere"
        beside.mkdir()
        write_participant(beside, **changes)
        return ["--reference", str(write_csv(elevation(peak_deg=58.0), beside / REFERENCE))]

    return spoil


def same_repeat(folder: Path) -> list[str]:
    """Two movements, of which the participant file says the same."""
    entry = {"task": "lift", "repeat": 1}
    write_participant(folder, trials={"lift_r1": entry, "reach_r3": entry})
    return ["TESTS", str(folder / TEST),
        str(write_csv(elevation(peak_deg=40.0), folder / "reach_r3.csv"))]  # fmt: skip


def study_participant(*keys: str, value: object) -> Callable[[Path], None]:
    """A participant file of the study with one value replaced."""

    def spoil(folder: Path) -> None:
        path = REPOSITORY / "config" / "participants" / "par2" / "participant.yaml"
        document = yaml.safe_load(path.read_text())
        part = document
        for key in keys[:-1]:
            part = part[key]
        part[keys[-1]] = value
        (folder / "participant.yaml").write_text(yaml.safe_dump(document))

    return spoil


CSV = elevation().to_csv(index=False)
HEADER, FIRST = CSV.split("\n")[:2]
TIME = elevation()["time"].to_numpy()
OTHER_RECORD = json.dumps(
    {"schema": "recording/1", "channels": {name: {"x": 1} for name in ANGLE_NAMES}}
)
PERSON = "participant.yaml"
GRAVITY = "participant.yaml, gravity_in_thorax_mps2"

KINDS = (
    # Files that are no tables.
    Bad("binary file", text(bytes(range(256)) * 40), TEST, "Save the table as text in UTF-8"),
    Bad("binary .mot", every(text(b"\x89\xff\x00" * 99, "a.mot"), trials("a.mot")),
        "a.mot", "Save the table as text in UTF-8"),
    Bad("UTF-16", text(CSV.encode("utf-16")), TEST, "Save the table as text in UTF-8"),
    Bad("zeros only", text(bytes(5000)), TEST, "Export it again"),
    Bad("empty file", text(""), TEST, "Export it again"),
    Bad("header only", text(HEADER + "\n"), TEST, "Export it again"),
    Bad("one endless cell", text(HEADER + "\n" + "1" * 200_000), TEST, "Save it as CSV again"),
    Bad("semicolons", text(CSV.replace(",", ";")), "row 1: cells are separated by semicolons",
        "commas between cells"),
    Bad("semicolons and decimal commas", text(CSV.replace(",", ";").replace(".", ",")),
        "row 1: cells are separated by semicolons", "decimal points"),
    Bad("tabs", text(CSV.replace(",", "\t")), "row 1: cells are separated by tabs", "commas"),
    Bad("title line", text("Session of Ann\n" + CSV), "row 1: 'Session of Ann' alone",
        "Remove title lines"),
    Bad("cut in a row", text(CSV[:-40]), "cells, expected 11", "Remove empty lines"),
    Bad("another suffix", every(text(CSV, "a.txt"), trials("a.txt")), "a.txt", "Export it as one"),
    Bad("missing file", without(TEST), TEST, "Check the name"),
    Bad("missing file in a folder without a participant", trials("../elsewhere/lift_r1.csv"),
        "elsewhere/lift_r1.csv: no such file", "Check the name"),
    Bad("folder as trial", folder_instead(TEST), TEST, "Check the name"),
    Bad("link to nothing", link_to_nothing, TEST, "Check the name"),
    # Columns and cells.
    Bad("missing column", table(lambda t: t.drop(columns="AC_z")),
        "row 1: missing column AC_z", "Rename or add"),
    Bad("column twice", text(CSV.replace("AC_z", "AC_x", 1)), "column AC_x", "Keep one"),
    Bad("column under two names", table(lambda t: t.assign(time_s=t.time)), "column time", "Keep"),
    Bad("text in a cell", table(cell("GH_z", "high")), "row 4, column GH_z", "decimal number"),
    Bad("comma as decimal point", text(HEADER + "\n" + FIRST.replace(".", ",")),
        "row 2", "stray commas"),
    Bad("NaN", table(cell("AC_y", "NaN")), "row 4, column AC_y", "Fill the gap"),
    Bad("infinity", table(cell("AC_y", "inf")), "row 4, column AC_y", "Fill the gap"),
    Bad("empty cell", table(cell("SC_x", "")), "row 4, column SC_x", "decimal number"),
    # Time.
    Bad("time that falls", table(lambda t: t.assign(time=t.time[::-1].to_numpy())),
        "row 3, column time", "Sort the rows"),
    Bad("time that stands", table(cell("time", TIME[1])), "row 4, column time", "more digits"),
    Bad("milliseconds", table(lambda t: t.assign(time=1000.0 * t.time)),
        f"{TEST}, column time", "divide by 1000"),
    Bad("gap of minutes", table(lambda t: t.assign(time=t.time + 300.0 * (t.time > 1.5))),
        "row 78, column time", "Make a trial of each part"),
    Bad("minutes", table(lambda t: t.assign(time=t.time / 60.0)), TEST, "Record at a higher"),
    Bad("too few frames", table(lambda t: t.iloc[::20]), f"{TEST}: 8 rows", "Record longer"),
    Bad("too short", table(lambda t: t.assign(time=t.time / 30.0)), TEST, "Record at a higher"),
    # Angles and movement.
    Bad("radians in .csv", table(in_radians), "columns AC_y, AC_z, AC_x", "Multiply by 180/pi"),
    Bad("radians called degrees in .mot", as_mot("yes", in_radians),
        "columns AC_y, AC_z, AC_x", "inDegrees=no"),
    Bad("degrees called radians in .mot", as_mot("no"), "column SC_y", "inDegrees=yes"),
    Bad("elbow bent the other way", table(lambda t: t.assign(EL_x=-t.EL_x - 60.0)),
        "column EL_x", "Check axes"),
    Bad("scapula in radians", table(lambda t: t.assign(
        **{name: np.deg2rad(t[name]) for name in ANGLE_NAMES if name.startswith(("SC_", "AC_"))})),
        "columns AC_y, AC_z, AC_x", "degrees in all columns"),
    Bad("elevation in radians", table(lambda t: t.assign(
        **{name: np.deg2rad(t[name]) for name in ANGLE_NAMES if name.startswith("GH_")})),
        f"{TEST}, columns SC_y to EL_x: no joint turns", "multiplied by 180/pi"),
    Bad("lost markers as zeros", table(lambda t: t.assign(
        **{name: np.where(t.index == 70, 0.0, t[name]) for name in ANGLE_NAMES})),
        "row 72: the clavicle", "Fill gaps"),
    Bad("lost markers as a number", table(lambda t: t.assign(
        GH_y=np.where(t.index == 70, -500.0, t.GH_y))), "row 72: the humerus", "Fill gaps"),
    Bad(".mot without unit", as_mot("perhaps"), "lift_r1.mot, header", "Add the line"),
    Bad(".mot without header", every(text(CSV, "a.mot"), trials("a.mot")), "endheader", "Export"),
    Bad("many turns", table(lambda t: t.assign(AC_y=t.AC_y + 1080.0)), "column AC_y", "full turns"),
    Bad("scapula turned over", table(lambda t: t.assign(AC_y=t.AC_y + 170.0)),
        "row 2, column AC_y", "Check axes, sequence and signs"),
    Bad("scapula tilted over", table(lambda t: t.assign(AC_z=t.AC_z + 170.0)),
        "row 2, column AC_", "Check axes, sequence and signs"),
    Bad("clavicle backwards", table(lambda t: t.assign(SC_y=t.SC_y + 180.0)),
        "row 2, column SC_y", "Check axes, sequence and signs"),
    Bad("scapula jumps once", table(cell("AC_x", 170.0)),
        "row 4: the scapula turns", "Fill gaps"),
    Bad("no movement", table(lambda t: t.assign(GH_z=20.0)), "no joint turns", "Leave the trial"),
    Bad("no movement but noise", table(lambda _: noisy_rest()),
        "no joint turns", "Leave the trial"),
    # EMG and joint force.
    Bad("EMG in percent", table(lambda t: t.assign(EMG_infra=55.0)),
        "row 2, column EMG_infra", "divide percent"),
    Bad("EMG in volts", table(lambda t: t.assign(EMG_infra=1e-4 * t.time)),
        "columns EMG_infra: at most 0.0003", "Divide volts"),
    Bad("EMG not rectified", table(lambda t: t.assign(EMG_infra=np.sin(70.0 * t.time))),
        "column EMG_infra", "Rectify"),
    Bad("EMG on another clock", companion("emg", time=TIME + 100.0, EMG_infra=0.1),
        "lift_r1_emg.csv", "one clock"),
    Bad("EMG in milliseconds", companion("emg", time=1000.0 * TIME, EMG_infra=0.1),
        "lift_r1_emg.csv, column time", "divide by 1000"),
    Bad("EMG of unknown channels", table(lambda t: t.assign(EMG_Infra=0.1)),
        f"{TEST}, columns EMG_Infra", "Rename the columns"),
    Bad("EMG in two places", every(table(lambda t: t.assign(EMG_infra=0.1)),
        companion("emg", time=TIME, EMG_infra=0.1)), "lift_r1_emg.csv", "Remove the columns"),
    Bad("EMG companion without EMG", companion("emg", time=TIME, infra=0.1),
        "lift_r1_emg.csv, row 1", "Correct the header"),
    Bad("binary EMG companion", text(b"\xff\xfe\x00" * 50, "lift_r1_emg.csv"),
        "lift_r1_emg.csv", "UTF-8"),
    Bad("force with two components", companion("force", time=TIME, GHF_x=1.0, GHF_y=1.0),
        "lift_r1_force.csv", "Add the missing"),
    Bad("force on another clock",
        companion("force", time=TIME + 9.0, GHF_x=1.0, GHF_y=1.0, GHF_z=1.0),
        "lift_r1_force.csv", "one clock"),
    Bad("force in millinewtons",
        companion("force", time=TIME, GHF_x=4.0e5, GHF_y=1.0e5, GHF_z=1.0),
        "lift_r1_force.csv, row 2, column GHF_x", "Convert the forces"),
    Bad("record of a conversion with other keys", strange_record(OTHER_RECORD),
        "lift_r1.recording.json, channels", "Convert the recording again"),
    Bad("record of a conversion that is none", strange_record('{"schema": "other"}'),
        "lift_r1.recording.json", "Convert the recording again"),
    Bad("record of a conversion that is a list", strange_record("[]"),
        "lift_r1.recording.json", "Convert the recording again"),
    # Participant.
    Bad("no participant file", without("participant.yaml"), "participant.yaml", "--participant"),
    Bad("two participants", two_people, "different participants", "--participant"),
    Bad("participant that is not there", asked("--participant", "FOLDER/who.yaml"),
        "who.yaml", "Check the name"),
    Bad("folder as participant", asked("--participant", "FOLDER"), "case", "Check the name"),
    Bad("participant in UTF-16", text("id: anna".encode("utf-16"), "participant.yaml"),
        "participant.yaml", "Save it as UTF-8"),
    Bad("participant that is no YAML", text("id: [anna", "participant.yaml"),
        "participant.yaml", "the line named"),
    Bad("key twice", text(yaml.safe_dump(participant_document()) + "side: right", PERSON),
        "key 'side' more than once", "the line named"),
    Bad("entry in itself", text("a: &a [*a]", PERSON), "participant.yaml", "Write it out"),
    Bad("participant without keys", text("anna", "participant.yaml"), "participant.yaml", "Add"),
    Bad("schema of another version", person(schema="participant/9"), "schema", "Correct the entry"),
    Bad("unknown key", person(height=1.8), "height: there is no such key", "Known are"),
    Bad("left arm", person(side="left"), "participant.yaml, side", "mirror left ones"),
    Bad("side that does not exist", person(side="top"), "participant.yaml, side", "Correct the"),
    Bad("negative mass", size(body_mass_kg=-80), "model", "Correct the entry"),
    Bad("height in cm", size(height_m=180), "model", "Correct the entry"),
    Bad("mass that is no number", size(body_mass_kg=float("nan")),
        "participant.yaml, model.body_mass_kg", "Correct the entry"),
    Bad("gravity up", person(gravity_in_thorax_mps2=[0.0, 9.80665, 0.0]), GRAVITY, "sign"),
    Bad("gravity in g", person(gravity_in_thorax_mps2=[0.0, -1.0, 0.0]), GRAVITY, "m/s^2"),
    Bad("gravity of the moon", person(gravity_in_thorax_mps2=[0.0, -1.62, 0.0]), GRAVITY, "m/s^2"),
    Bad("no gravity", person(gravity_in_thorax_mps2=[0, 0, 0]), GRAVITY, "m/s^2"),
    Bad("gravity in a plane", person(gravity_in_thorax_mps2=[0, -9.8]), GRAVITY, "Correct"),
    Bad("gravity up in a participant of the study",
        study_participant("gravity_in_thorax_mps2", value=[0.0, 9.80665, 0.0]), GRAVITY, "sign"),
    Bad("scale factor 0 in a participant of the study",
        study_participant("scale", "hand_r", value=[1.0, 0.0, 1.0]),
        "participant.yaml, scale.hand_r", "Correct the entry"),
    Bad("scaled model that is not there", person(model={"file": "no.yaml"}), "no.yaml", "Check"),
    Bad("segment without mass", scaled(lambda d: d["bodies"].pop()), "bodies", "add the missing"),
    Bad("scale factor 0", scaled(lambda d: d["segment_scale"][0].update(scale_xyz=[0, 1, 1])),
        "segment_scale.0.scale_xyz", "Correct the entry"),
    Bad("segment of a list as name", scaled(lambda d: d["bodies"][0].update(name=["hand_r"])),
        "bodies.0.name", "Correct the entry"),
    Bad("segment in grams", scaled(lambda d: d["bodies"][0].update(mass_kg=2000.0)),
        "bodies.0.mass_kg", "Correct the entry"),
    Bad("segment of negative mass", scaled(lambda d: d["bodies"][0].update(mass_kg=-1.0)),
        "bodies.0.mass_kg", "Correct the entry"),
    Bad("entry with the suffix of the file", person(trials={TEST: {"task": "reach"}}),
        f"trials.{TEST}: no such trial", "without the suffix"),
    Bad("entry in capital letters", person(trials={"Lift_R1": {"task": "reach"}}),
        "trials.Lift_R1: no such trial; expected 'lift_r1'", "Rename the entry"),
    Bad("number as the name of a trial", person(trials={101: {"task": "lift"}}),
        "participant.yaml, trials: the name 101 is no text (YAML reads int)", "in quotes: '101'"),
    Bad("reference of another person", other_reference(id="other"),
        "id: other; expected anna", "with --participant"),
    Bad("reference of another size",
        other_reference(model={"generic": True, "body_mass_kg": 80, "height_m": 1.9}),
        "elsewhere/participant.yaml, model.", "with --participant"),
    Bad("reference in another posture",
        other_reference(gravity_in_thorax_mps2=[9.80665, 0.0, 0.0]),
        "elsewhere/participant.yaml, gravity_in_thorax_mps2:", "with --participant"),
    Bad("reference with EMG of another unit",
        other_reference(emg={"channels": {"EMG_infra": ["infra"]}, "unit": "fraction_of_max"}),
        "elsewhere/participant.yaml, emg.unit: fraction_of_max", "with --participant"),
    Bad("reference with other electrodes",
        other_reference(emg={"channels": {"EMG_infra": ["supra"]}, "unit": "fraction_of_mvc"}),
        "elsewhere/participant.yaml, emg.channels.EMG_infra:", "with --participant"),
    Bad("task in capital letters", person(trials={"lift_r1": {"task": "Lift"}}),
        "tasks 'Lift' and 'lift' differ", "expected one name"),
    Bad("the same repeat twice", same_repeat, "repeat 1 of task 'lift', as is", "other tasks"),
    Bad("unknown muscle group", emg(channels={"EMG_infra": ["infraspinatus"]}),
        "emg.channels.EMG_infra", "Correct the name"),
    Bad("neighbour that is no channel", emg(neighbours=[["EMG_infra", "EMG_b"]]),
        "emg.neighbours", "add the channel"),
    Bad("channel as its own neighbour", emg(neighbours=[["EMG_infra", "EMG_infra"]]),
        "emg.neighbours.0", "two different channels"),
    Bad("channel of another name", emg(channels={"infra": ["infra"]}), "emg.channels", "EMG_"),
    Bad("EMG unit that does not exist", emg(unit="volt"), "emg.unit", "Correct the entry"),
    Bad("window reversed", person(trials={"lift_r1": {"window_s": [2.0, 1.0]}}),
        "trials.lift_r1.window_s", "Exchange"),
    Bad("window outside of the trial", person(trials={"lift_r1": {"window_s": [0.4, 99.0]}}),
        TEST, "Correct the window"),
    Bad("window without end", person(trials={"lift_r1": {"window_s": [0.4, float("inf")]}}),
        "trials.lift_r1.window_s.1", "Correct the entry"),
    Bad("window too short", person(trials={"lift_r1": {"window_s": [0.4, 0.41]}}),
        TEST, "give window_s"),
    Bad("repeat 0", person(trials={"lift_r1": {"repeat": 0}}),
        "trials.lift_r1.repeat", "Correct the entry"),
    # Case and command.
    Bad("no test file", lambda _: ["TESTS"], "TEST", "usage"),
    Bad("test as its own reference", asked("--reference", f"FOLDER/{TEST}"),
        TEST, "Leave it out on one side"),
    Bad("different tasks only", renamed_reference, "lift; of the reference trials: push", "Rename"),
    Bad("file as folder for the answer", asked("--out", f"FOLDER/{TEST}"),
        "--out", "Name another one"),
    Bad("folder for the answer below a file", asked("--out", f"FOLDER/{TEST}/out"),
        "--out", "Name another one"),
    Bad("folder for the answer nowhere", asked("--out", "/proc/none/out"),
        "--out", "Name another one"),
    Bad("folder in the place of the log", folder_instead("out/run.log"), "run.log", "remove what"),
    Bad("negative seed", asked("--seed", "-1"), "--seed -1", "Raise it"),
    Bad("seed that is no number", asked("--seed", "one"), "--seed", "usage"),
    Bad("no thread", asked("--threads", "0"), "--threads 0", "Raise it"),
    Bad("unknown view", asked("--view", "guess"), "--view", "choose from"),
    Bad("file as cache", asked("--cache", f"FOLDER/{TEST}"), "--cache", "Name another one"),
    # Configuration.
    Bad("configuration that is not there", asked("--config", "FOLDER/no.yaml"),
        "no.yaml", "Expected a YAML file"),
    Bad("binary configuration", every(text(b"\xff\xfe\x00", "b.yaml"),
        asked("--config", "FOLDER/b.yaml")), "b.yaml", "Save it as UTF-8"),
    Bad("slip in a key of the configuration",
        configured("--config", "config.yaml", "model", "mases", value="published"),
        "mases", "Did you mean 'masses'"),
    Bad("value of the configuration out of range",
        configured("--config", "config.yaml", "model", "masses", value="weighed"),
        "key 'model.masses'", "Write for example"),
    Bad("settings that are not there", asked("--settings", "FOLDER/no.yaml"),
        "no.yaml", "Expected a YAML file"),
    Bad("slip in a key of the settings",
        configured("--settings", "gap/settings.yaml", "itreations", value=3.0),
        "itreations", "Did you mean 'iterations'"),
    Bad("no repeats in the settings",
        configured("--settings", "gap/settings.yaml", "noise", "repeats", value=0.0),
        "key 'noise.repeats'", "Write for example"),
    Bad("number of the settings in quotes",
        configured("--settings", "gap/settings.yaml", "nodes", value="21"),
        "key 'nodes'", "Write for example"),
)  # fmt: skip


def noisy_rest() -> pd.DataFrame:
    """A held posture with the noise of markers, 0.3 deg."""
    rest = elevation(100.0, peak_deg=0.0)
    rng = np.random.default_rng(4)
    return rest.assign(
        **{name: rest[name] + 0.3 * rng.normal(size=len(rest)) for name in ANGLE_NAMES}
    )


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """A test and a reference trial of one task, and an answer of an earlier run."""
    folder = tmp_path / "case"
    folder.mkdir()
    write_participant(folder)
    for name, peak in ((TEST, 60.0), (REFERENCE, 62.0)):
        write_csv(elevation(peak_deg=peak), folder / name)
    (folder / "out").mkdir()
    return folder


@pytest.fixture
def reached(monkeypatch: pytest.MonkeyPatch) -> list:
    """Cases that got as far as a model; none is built, and nothing is solved."""
    cases: list = []

    def build(case, *_):
        cases.append(case)
        return SimpleNamespace(hash="m")

    monkeypatch.setattr(participant_model, "participant_model", build)
    monkeypatch.setattr(pipeline, "diagnose", lambda *_: finished_diagnosis())
    return cases


def diagnose(case: Path, options: list[str]) -> int:
    """Exit code of the command on a case; after TESTS come the test files."""
    trials, more = [str(case / TEST)], options
    if "TESTS" in options:
        start = options.index("TESTS")
        trials, more = options[start + 1 :], options[:start]
    if "--reference" not in more:
        more = ["--reference", str(case / REFERENCE), *more]
    if "--out" not in more:
        more = ["--out", str(case / "out"), *more]
    try:
        return cli.main(["gap", "diagnose", *trials, *more])
    except SystemExit as refusal:  # how argparse refuses
        return int(refusal.code or 0)


def test_the_sound_case_is_accepted(case: Path, reached: list) -> None:
    assert diagnose(case, []) == 0
    assert len(reached) == 1
    assert json.loads((case / "out" / "result.json").read_text())["status"] == "ok"


@pytest.mark.parametrize("bad", KINDS, ids=[bad.kind for bad in KINDS])
def test_bad_input_is_refused(
    bad: Bad, case: Path, reached: list, capsys: pytest.CaptureFixture[str]
) -> None:
    options = bad.spoil(case) or []
    assert diagnose(case, options) == REFUSED
    said = capsys.readouterr()
    assert "Traceback" not in said.err + said.out
    assert bad.place in said.err
    assert bad.remedy in said.err
    assert not reached
    assert not list(case.rglob("result.json"))
    assert not list(case.rglob("report.html"))


@pytest.mark.parametrize("spoil", [table(in_radians), asked("--seed", "-1")])
def test_a_refusal_leaves_no_answer_of_an_earlier_run(spoil, case: Path, reached: list) -> None:
    assert diagnose(case, []) == 0
    assert diagnose(case, spoil(case) or []) == REFUSED
    assert not (case / "out" / "result.json").exists()


def test_a_folder_with_files_that_no_diagnosis_wrote_is_refused(case, reached, capsys) -> None:
    out = case / "mine"
    (out / "curves").mkdir(parents=True)
    kept = write_csv(elevation(), out / "curves" / TEST)
    assert diagnose(case, ["--out", str(out)]) == REFUSED
    assert "holds curves/lift_r1.csv and no run.log" in capsys.readouterr().err
    assert kept.exists()
    (out / "run.log").touch()
    assert diagnose(case, ["--out", str(out), "--participant", str(case / PERSON),
        "TESTS", str(kept)]) == REFUSED  # fmt: skip
    assert "is read, and the result would replace it" in capsys.readouterr().err
    assert kept.exists()
    assert not reached


def test_a_file_that_may_not_be_read_is_refused(case, reached, capsys, monkeypatch) -> None:
    """Apart from the others: whoever may read everything needs a system that pretends."""

    read = Path.read_bytes

    def refuse(path: Path) -> bytes:
        if path.name != TEST:
            return read(path)
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "read_bytes", refuse)
    assert diagnose(case, []) == REFUSED
    assert f"{TEST}: Permission denied. Allow it to be read" in capsys.readouterr().err
    assert not reached


def test_no_kind_has_disappeared() -> None:
    assert len({bad.kind for bad in KINDS}) == len(KINDS)
    assert len(KINDS) >= FEWEST_KINDS
