"""Whatever is wrong with a recording ends in an error or a warning that names it.

Every row of the table breaks one thing of a session that converts without a finding; `said` has to
appear in what the command prints, and the exit code says that something was refused or is faulty.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import made_recordings as made
import numpy as np
import pytest

from scapulohumeral import cli
from scapulohumeral.emg.synthesis import emg_noise

pytestmark = pytest.mark.unit
MODEL = made.tables()
Points = dict[str, np.ndarray]


@dataclass
class Session:
    """A session on disk before it is converted: what a break changes."""

    folder: Path
    points: Points
    map_text: str
    unit: str = "mm"
    suffix: str = ".c3d"
    tail: str = ""


@dataclass(frozen=True)
class Broken:
    """A way to break a session, what has to be said, and the exit code."""

    name: str
    change: Callable[[Session], None]
    said: str
    code: int = 2


def swap(a: str, b: str) -> Callable[[Session], None]:
    """Two markers carry each other's label."""

    def change(session: Session) -> None:
        session.points[a], session.points[b] = session.points[b], session.points[a]

    return change


def gap(name: str, frames: slice, value: float) -> Callable[[Session], None]:
    """A marker is not seen for some frames."""

    def change(session: Session) -> None:
        session.points[name][frames] = value

    return change


def edit(old: str, new: str) -> Callable[[Session], None]:
    """The map says something else."""

    def change(session: Session) -> None:
        assert old in session.map_text
        session.map_text = session.map_text.replace(old, new)

    return change


def turned_humerus(session: Session) -> None:
    """EL and EM exchanged, where no forearm contradicts them."""
    swap("EL", "EM")(session)
    edit(", US: mUS", "")(session)


def missing_marker(session: Session) -> None:
    """A landmark has no marker in the file."""
    del session.points["AI"]


def wrong_unit(session: Session) -> None:
    """Millimetres that the file calls metres."""
    session.unit = "m"
    session.points.update({name: 1e3 * p for name, p in session.points.items()})


def unknown_unit(session: Session) -> None:
    """A unit that nobody knows."""
    session.unit = "inch"


def left_arm(session: Session) -> None:
    """A left arm that the map calls a right one."""
    session.points.update({n: p * [-1, 1, 1] for n, p in session.points.items()})


def jump(session: Session) -> None:
    """Clavicle and scapula jump for one frame."""
    for name in ("AC", "AA", "TS", "AI"):
        session.points[name][60] += [0.0, 0.0, 0.06]


def elbow_jump(session: Session) -> None:
    """The marker of the wrist is elsewhere for one frame, about as far from the elbow."""
    points = session.points
    elbow = 0.5 * (points["EL"][60] + points["EM"][60])
    arm = elbow - points["GH"][60]
    length = np.linalg.norm(points["US"][60] - elbow)
    points["US"][60] = elbow + length * arm / np.linalg.norm(arm)


def ghost(session: Session) -> None:
    """A marker is metres away for one frame."""
    session.points["US"][60] += [0.0, 4.0, 0.0]


def one_frame_lost(session: Session) -> None:
    """C7 and IJ exchange labels in one frame."""
    points = session.points
    keep = points["IJ"][40].copy()
    points["IJ"][40] = points["C7"][40]
    points["C7"][40] = keep


def single_frame(session: Session) -> None:
    """The export holds a posture instead of the motion."""
    session.points.update({name: p[:1] for name, p in session.points.items()})


def loose_skin(session: Session) -> None:
    """The wrist slides along the forearm."""
    slide = 0.04 * np.sin(np.linspace(0, 20, made.FRAMES))[:, None]
    away = session.points["US"] - session.points["EL"]
    session.points["US"] += slide * away / np.linalg.norm(away, axis=1, keepdims=True)


def lying_down(session: Session) -> None:
    """The laboratory's up is not the person's."""
    session.map_text = session.map_text.replace('"+z"', '"+y"')


def uneven_time(session: Session) -> None:
    """A table whose rows without markers were dropped."""
    session.suffix, session.tail = ".csv", "uneven"


def text_cell(session: Session) -> None:
    """A word among numbers."""
    session.suffix, session.tail = ".csv", "word"


def wrong_rate(session: Session) -> None:
    """The header says another rate than the times."""
    session.suffix, session.tail = ".trc", "rate"


def other_encoding(session: Session) -> None:
    """The header holds a path with an umlaut, as exported under Windows."""
    session.suffix, session.tail = ".trc", "encoding"


def cut_off(session: Session) -> None:
    """A copy that was broken off."""
    session.tail = "cut"


def empty_file(session: Session) -> None:
    """A file that is no recording."""
    session.tail = "empty"


def other_format(session: Session) -> None:
    """A format that nobody reads."""
    session.suffix, session.tail = ".csv", "suffix"


CLUSTER = "clusters: {{acromion: {{markers: [mAC, mAA, mTS], landmarks: [AI]}}}}\n".format()
TABLE = [
    Broken("missing landmark", missing_marker, "no marker 'mAI'; found"),
    Broken("misspelt landmark", edit("PX: mPX", "PY: mPX"), "landmarks.PY: there is no such"),
    Broken("landmark left out", edit("T8: mT8, ", ""), "'T8' is a required property"),
    Broken("marker used twice", edit("T8: mT8", "T8: mC7"), "mC7 is also C7"),
    Broken("part of a scapula", edit("AI: mAI,", ""), "no AI; expected all of AA, TS, AI"),
    Broken("swapped epicondyle", swap("EM", "AI"), "epicondyles_apart"),
    Broken("swapped thorax", swap("IJ", "C7"), "look for swapped markers IJ, C7"),
    Broken("swapped scapula", swap("AA", "TS"), "impossible_posture"),
    Broken("exchanged epicondyles, no forearm", turned_humerus, "impossible_posture: GH_yy"),
    Broken("swapped in one frame", one_frame_lost, "frame 41"),
    Broken("millimetres as metres", wrong_unit, "m apart with the unit 'm' of the file"),
    Broken("unknown unit", unknown_unit, "unit 'inch'; expected m, cm, mm"),
    Broken("left as right", left_arm, "Write side: left"),
    Broken("right as left", edit("side: right", "side: left"), "Write side: right"),
    Broken("long gap", gap("AI", slice(30, 60), np.nan), "marker mAI, frames 31 to 60: not seen"),
    Broken("gap at the end", gap("AI", slice(110, None), np.nan), "at the end of the recording"),
    Broken("zero-filled gap", gap("US", slice(30, 60), 0.0), "marker mUS, frames 31 to 60"),
    Broken("never seen", gap("US", slice(None), 0.0), "marker mUS: not seen in any of 120 frames"),
    Broken("one frame", single_frame, "trial.c3d: one frame, which is a posture and no motion"),
    Broken("clavicle jumps", jump, "clavicle_jumps"),
    Broken("elbow jumps", elbow_jump, "forearm_jumps"),
    Broken("ghost marker", ghost, "landmark_far_away: US is 4."),
    Broken("skin slides", loose_skin, "segment_length_varies: forearm", code=0),
    Broken("wrong vertical", lying_down, "thorax_tilted"),
    Broken("uneven rate", uneven_time, "column time_s: "),
    Broken("wrong rate", wrong_rate, "DataRate: 50 Hz, but the column Time has 100.00"),
    Broken("other encoding", other_encoding, "trial.trc: byte 25 is no text in UTF-8. Save"),
    Broken("text among numbers", text_cell, "row 10, column mIJ_z_mm: 'lost' is not a number"),
    Broken("cut off", cut_off, "frames, but the file says 120: it was cut off"),
    Broken("not a C3D file", empty_file, "not a C3D file"),
    Broken("unknown format", other_format, "'.xlsx'; expected .c3d, .trc or .csv"),
    Broken(
        "static missing",
        edit("glenohumeral:", f"static: none.c3d\n{CLUSTER}glenohumeral:"),
        "no such file; the marker map names it under static",
    ),
    Broken(
        "clusters without static",
        edit("glenohumeral:", f"{CLUSTER}glenohumeral:"),
        "expected the recording that shows clusters and landmarks together",
    ),
    Broken(
        "landmark in two clusters",
        edit(
            "glenohumeral:",
            "static: none.c3d\nclusters: {one: {markers: [mIJ, mPX, mC7], landmarks: [AA]}, "
            "two: {markers: [mT8, mSC, mAC], landmarks: [AA]}}\nglenohumeral:",
        ),
        "clusters.two: AA is carried by one, too",
    ),
    Broken(
        "centre without its landmarks",
        edit("method: marker", "method: meskers"),
        "meskers needs AC, AA, TS, AI, PC; no PC",
    ),
]


def convert(session: Session, *more: str) -> int:
    """Write the session and convert it by the command line; returns the exit code.

    `more`: further arguments of the command.
    """
    file = session.folder / f"trial{session.suffix}"
    made.WRITERS[session.suffix](file, made.marked(session.points), unit=session.unit)
    lines = file.read_text(encoding="utf-8").splitlines() if session.suffix == ".csv" else []
    if session.tail == "uneven":
        file.write_text("\n".join(lines[:40] + lines[60:]) + "\n", encoding="utf-8")
    elif session.tail == "word":
        lines[9] = lines[9].replace(lines[9].split(",")[3], "lost")
        file.write_text("\n".join(lines) + "\n", encoding="utf-8")
    elif session.tail == "rate":
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace("100.0\t", "50\t", 1), encoding="utf-8")
    elif session.tail == "encoding":
        file.write_bytes(file.read_bytes().replace(b"(X/Y/Z)\t", b"(X/Y/Z)\tM\xfcller", 1))
    elif session.tail == "cut":
        file.write_bytes(file.read_bytes()[: file.stat().st_size * 2 // 3])
    elif session.tail == "empty":
        file.write_bytes(b"")
    elif session.tail == "suffix":
        file = file.rename(file.with_suffix(".xlsx"))
    map_file = made.write_map(session.folder / "map.yaml", session.map_text)
    out = str(session.folder / "out")
    return cli.main(["convert", str(file), "--map", str(map_file), "--out", out, *more])


@pytest.fixture(name="session")
def session_fixture(tmp_path: Path) -> Session:
    """A session that nothing is wrong with."""
    points = {name: p.copy() for name, p in made.landmarks(made.arm_angles(), MODEL).items()}
    return Session(tmp_path, points, made.MAP.format(side="right"))


def test_the_sound_session_converts(session: Session, capsys: pytest.CaptureFixture[str]) -> None:
    assert convert(session) == 0
    said = capsys.readouterr().out
    assert "1 of 1 recordings converted without a fault" in said
    assert "note" not in said
    assert "fault " not in said


@pytest.mark.parametrize("broken", TABLE, ids=lambda broken: broken.name)
def test_broken_sessions_are_named(
    broken: Broken, session: Session, capsys: pytest.CaptureFixture[str]
) -> None:
    broken.change(session)
    assert convert(session) == broken.code
    captured = capsys.readouterr()
    assert broken.said in captured.out + captured.err
    table = session.folder / "out" / "trial.csv"
    assert table.exists() == (broken.code == 0)


def test_a_cut_off_that_is_too_high_for_one_recording_leaves_the_others(
    session: Session, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [session.folder / f"{name}.c3d" for name in ("slow", "trial")]
    for file, rate in zip(files, (10.0, made.RATE_HZ), strict=True):
        made.write_c3d(file, made.marked(session.points), rate_hz=rate)
    map_file = made.write_map(session.folder / "map.yaml", session.map_text)
    more = ["--map", str(map_file), "--out", str(session.folder / "out"), "--smooth-hz", "6"]
    assert cli.main(["convert", *map(str, files), *more]) == 2
    assert "refused   slow: cut-off 6.0 Hz; expected above 0 and below" in capsys.readouterr().out
    assert (session.folder / "out" / "trial.csv").exists()
    assert not (session.folder / "out" / "slow.csv").exists()


def test_without_a_sound_recording_there_is_no_participant_to_write(
    session: Session, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is the recording that is wrong, not the map or an option."""
    swap("IJ", "C7")(session)
    assert convert(session, "--body-mass", "70", "--height", "1.7") == 2
    captured = capsys.readouterr()
    assert "it needs a recording without a fault, see above" in captured.out
    assert "--body-mass" not in captured.out + captured.err
    assert "look at " in captured.out


def emg_arguments(folder: Path, contraction: np.ndarray) -> list[str]:
    """A trial and a contraction with one EMG channel; arguments of the command."""
    points = made.marked(made.landmarks(made.arm_angles(400), MODEL))
    trial = 1e-4 * emg_noise(8000, 1, 2000.0, np.random.default_rng(1))[:, 0]
    made.write_c3d(folder / "trial.c3d", points, analog={"EMG 3": trial})
    made.write_c3d(folder / "mvc.c3d", points, analog={"EMG 3": contraction})
    text = 'schema: emg_map/1\nchannels: {infra: {label: "EMG 3", muscles: [infra]}}\n'
    (folder / "emg.yaml").write_text(text, encoding="utf-8")
    files = {name: str(folder / name) for name in ("trial.c3d", "mvc.c3d", "emg.yaml", "out")}
    return [
        "emg", files["trial.c3d"], "--mvc", files["mvc.c3d"], "--map", files["emg.yaml"],
        "--out", files["out"],
    ]  # fmt: skip


EMG_TABLE = [
    ("rectified contraction", np.abs, "mvc.c3d, channel infra: no negative values", 2),
    ("silent contraction", lambda sound: np.zeros_like(sound), "silent", 2),
    ("clipped contraction", lambda sound: np.clip(sound, -2e-4, 2e-4), "mvc: clipping", 2),
    ("weak contraction", lambda sound: 0.4 * sound, "trial: above_mvc", 0),
    ("exchanged", lambda sound: 0.1 * sound, "are in different units, or exchanged", 2),
]


@pytest.mark.parametrize(("name", "change", "said", "code"), EMG_TABLE, ids=lambda v: str(v)[:20])
def test_broken_emg_is_named(
    name: str,
    change: Callable[[np.ndarray], np.ndarray],
    said: str,
    code: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    sound = 3e-4 * emg_noise(8000, 1, 2000.0, np.random.default_rng(2))[:, 0]
    assert cli.main(emg_arguments(tmp_path, change(sound))) == code, name
    captured = capsys.readouterr()
    assert said in captured.out + captured.err


SLIPS = [
    ("file as folder", ["--out", "TRIAL"], "--out "),
    ("folder below a file", ["--out", "TRIAL/out"], "--out "),
    ("mass without height", ["--body-mass", "70"], "--body-mass without --height"),
    ("height without mass", ["--height", "1.7"], "--height without --body-mass"),
    ("name without body", ["--id", "ann"], "--id without --body-mass and --height"),
    ("tasks without body", ["--tasks", "(?P<task>.)"], "--tasks without --body-mass and --height"),
    ("no cut-off", ["--smooth-hz", "0"], "--smooth-hz 0.0: expected above 0 Hz"),
    ("height in cm", ["--body-mass", "70", "--height", "170"], "--height 170.0: expected 1 to 2.5"),
]


@pytest.mark.parametrize(("name", "options", "said"), SLIPS, ids=[slip[0] for slip in SLIPS])
def test_slips_of_the_command_are_refused_before_anything_is_read(
    name: str,
    options: list[str],
    said: str,
    session: Session,
    capsys: pytest.CaptureFixture[str],
) -> None:
    made.write_c3d(session.folder / "trial.c3d", made.marked(session.points))
    trial, map_file = str(session.folder / "trial.c3d"), session.folder / "map.yaml"
    made.write_map(map_file, session.map_text)
    sound = ["--out", str(session.folder / "out")]
    given = [option.replace("TRIAL", trial) for option in options]
    # The last of two options counts.
    assert cli.main(["convert", trial, "--map", str(map_file), *sound, *given]) == 2, name
    captured = capsys.readouterr()
    assert f"Refused: {said}" in captured.err
    assert "1/1" not in captured.err
    assert not list(session.folder.rglob("*.csv"))


def test_other_commands_refuse_a_file_as_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sound = 3e-4 * emg_noise(8000, 1, 2000.0, np.random.default_rng(2))[:, 0]
    arguments = emg_arguments(tmp_path, sound)
    assert cli.main([*arguments, "--out", str(tmp_path / "emg.yaml")]) == 2
    assert f"Refused: --out {tmp_path / 'emg.yaml'}: File exists" in capsys.readouterr().err
    assert cli.main(["study", "--cores", "0", "--dry-run"]) == 2
    assert "Refused: --cores 0: expected 1 or more" in capsys.readouterr().err
