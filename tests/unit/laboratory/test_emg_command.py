"""Raw EMG by the command line to envelopes that a diagnosis reads."""

from collections.abc import Callable
from pathlib import Path

import made_recordings as made
import numpy as np
import pandas as pd
import pytest
import yaml

from scapulohumeral import cli
from scapulohumeral.emg.synthesis import emg_noise
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.recording.participant_file import read_participant_file
from scapulohumeral.gap.recording.trials import TrialEntry, read_trial
from scapulohumeral.laboratory.emg_files import read_emg_map

pytestmark = pytest.mark.unit
RATE_HZ = 2000.0
EMG_MAP = """schema: emg_map/1
channels:
  infra: {label: "EMG 3", muscles: [infra]}
  delt: {label: "EMG 5", muscles: [delt_scap]}
neighbours: [[infra, delt]]
"""
PARTICIPANT = """schema: participant/1
id: ann
side: right
model: {generic: true, body_mass_kg: 70, height_m: 1.75}
gravity_in_thorax_mps2: [0.0, -9.80665, 0.0]
"""


def noise(seconds: float, level: np.ndarray, seed: int) -> np.ndarray:
    """EMG-like noise (T,) [V] whose amplitude follows a level over the recording."""
    count = int(seconds * RATE_HZ)
    raw = emg_noise(count, 1, RATE_HZ, np.random.default_rng(seed))[:, 0]
    return 1e-4 * raw * np.interp(np.arange(count), np.linspace(0, count, len(level)), level)


def session(
    folder: Path, signal: np.ndarray, seconds: float, gains: tuple[float, float] = (1.0, 1.0)
) -> list[str]:
    """A trial with markers and EMG, two contractions of one channel each; arguments of `emg`.

    `gains` of the first channel in the two contractions.
    """
    points = made.marked(
        made.landmarks(made.arm_angles(int(seconds * made.RATE_HZ)), made.tables())
    )
    one, two = noise(6.0, np.ones(2), 1), noise(6.0, 0.2 * np.ones(2), 2)
    quiet = noise(seconds, np.ones(2), 4)
    made.write_c3d(folder / "reach_r1.c3d", points, analog={"EMG 3": signal, "EMG 5": quiet})
    held = {name: track[:600] for name, track in points.items()}
    volts = {"mvc1": (gains[0] * one, two), "mvc2": (gains[1] * two, one)}
    for name, (a, b) in volts.items():
        still = {key: np.repeat(track[:1], 600, axis=0) for key, track in held.items()}
        made.write_c3d(folder / f"{name}.c3d", still, analog={"EMG 3": a, "EMG 5": 2.0 * b})
    (folder / "emg.yaml").write_text(EMG_MAP, encoding="utf-8")
    mvc = [str(folder / "mvc1.c3d"), str(folder / "mvc2.c3d")]
    return [
        "emg", str(folder / "reach_r1.c3d"), "--mvc", *mvc, "--map", str(folder / "emg.yaml"),
        "--out", str(folder / "out"),
    ]  # fmt: skip


def test_another_clock_of_the_same_frames_is_told(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Markers exported as TRC keep the clock of the recording, of which this is a part."""
    arguments = session(tmp_path, noise(4.0, np.ones(4), 3), 4.0)
    points = made.marked(made.landmarks(made.arm_angles(400), made.tables()))
    made.write_trc(tmp_path / "reach_r1.trc", points, start_s=0.8)
    map_file = made.write_map(tmp_path / "map.yaml")
    convert = ["convert", str(tmp_path / "reach_r1.trc"), "--map", str(map_file)]
    assert cli.main([*convert, "--out", str(tmp_path / "out")]) == 0
    assert cli.main(arguments) == 0
    assert "clocks differ; write delay_s: -0.80 in the map" in capsys.readouterr().out


@pytest.mark.parametrize("column", ["time_s", "time"])
def test_a_motion_that_was_cut_at_its_beginning_is_told(
    column: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Both files begin at zero then, whatever was cut off."""
    arguments = session(tmp_path, noise(4.0, np.ones(4), 3), 4.0)
    (tmp_path / "out").mkdir()
    times = "\n".join(f"{0.01 * i:.2f},1.0" for i in range(160))
    (tmp_path / "out" / "reach_r1.csv").write_text(f"{column},SC_y\n{times}\n", encoding="utf-8")
    cli.main(arguments)
    said = "if the beginning of the motion was cut off, the EMG is late by up to 2.4"
    assert said in capsys.readouterr().out


def test_a_diagnosis_reads_what_was_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    level = np.array([0.1, 0.1, 0.5, 0.5, 0.1, 0.1])
    arguments = session(tmp_path, noise(4.0, level, 3), 4.0)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "participant.yaml").write_text(PARTICIPANT, encoding="utf-8")
    map_file = made.write_map(tmp_path / "map.yaml")
    trial = str(tmp_path / "reach_r1.c3d")
    assert cli.main(["convert", trial, "--map", str(map_file), "--out", str(tmp_path / "out")]) == 0
    capsys.readouterr()
    assert cli.main(arguments) == 0
    assert "clocks" not in capsys.readouterr().out
    read, _ = read_trial(tmp_path / "out" / "reach_r1.csv", TrialEntry())
    assert read.emg is not None
    assert read.emg.channels == ("EMG_delt", "EMG_infra")
    delt, infra = read.emg.values.T
    middle = np.abs(read.emg.time_s - 2.0) < 0.3
    # Each channel is scaled by the contraction that it was strongest in: 1 and 2 times 1e-4 V.
    assert infra[middle].mean() == pytest.approx(0.5, abs=0.06)
    assert delt[middle].mean() == pytest.approx(0.5, abs=0.06)
    file = read_participant_file(tmp_path / "out" / "participant.yaml", "published")
    assert file.participant.emg_channels == {"EMG_infra": ("infra",), "EMG_delt": ("delt_scap",)}
    assert file.participant.neighbours == (("EMG_infra", "EMG_delt"),)


def test_channels_of_trials_that_were_processed_before_stay(tmp_path: Path) -> None:
    """A table that is gone, or other muscles under an electrode, are told by the last run."""
    arguments = session(tmp_path, noise(4.0, np.ones(2), 3), 4.0)
    out, map_file = tmp_path / "out", tmp_path / "emg.yaml"
    out.mkdir()
    file = out / "participant.yaml"
    file.write_text(PARTICIPANT, encoding="utf-8")
    assert cli.main(arguments) == 0
    later = EMG_MAP.replace("infra:", "teres:").replace("[infra]", "[supra]")
    later = later.replace("[[infra, delt]]", "[[teres, delt]]")
    map_file.write_text(later, encoding="utf-8")
    (out / "reach_r1_emg.csv").rename(out / "lift_r1_emg.csv")
    assert cli.main(arguments) == 0
    emg = yaml.safe_load(file.read_text(encoding="utf-8"))["emg"]
    every = {"EMG_infra": ["infra"], "EMG_delt": ["delt_scap"], "EMG_teres": ["supra"]}
    assert emg["channels"] == every
    assert emg["neighbours"] == [["EMG_teres", "EMG_delt"], ["EMG_infra", "EMG_delt"]]
    (out / "lift_r1_emg.csv").unlink()
    assert cli.main(arguments) == 0
    emg = yaml.safe_load(file.read_text(encoding="utf-8"))["emg"]
    assert emg["channels"].keys() == {"EMG_delt", "EMG_teres"}
    assert emg["neighbours"] == [["EMG_teres", "EMG_delt"]]


def test_emg_of_another_unit_is_not_mixed_with_shares_of_maximal_contractions(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = session(tmp_path, noise(4.0, np.ones(2), 3), 4.0)
    (tmp_path / "out").mkdir()
    other = PARTICIPANT + "emg: {unit: fraction_of_max, channels: {EMG_a: [infra]}}\n"
    file = tmp_path / "out" / "participant.yaml"
    file.write_text(other, encoding="utf-8")
    assert cli.main(arguments) == 2
    assert "emg.unit: fraction_of_max; expected fraction_of_mvc" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == other


def test_a_clipped_channel_is_named_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    clipped = np.clip(noise(4.0, np.ones(2), 3), -1.5e-4, 1.5e-4)
    assert cli.main(session(tmp_path, clipped, 4.0)) == 2
    said = capsys.readouterr().out
    assert "channel infra, trial: clipping" in said
    assert "(left out)" in said
    header = (tmp_path / "out" / "reach_r1_emg.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header == "time_s,EMG_delt,simulated"


def test_a_channel_that_no_contraction_holds_is_named_and_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(session(tmp_path, noise(4.0, np.ones(2), 3), 4.0, gains=(1e-3, 1e-3))) == 2
    said = capsys.readouterr().out
    assert "channel infra, mvc: dead" in said
    assert "(left out)" in said
    header = (tmp_path / "out" / "reach_r1_emg.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header == "time_s,EMG_delt,simulated"


def test_a_clipped_contraction_is_not_replaced_by_that_of_another_muscle(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its amplitude is a lower bound: the channel has no level, whatever other recordings show."""
    arguments = session(tmp_path, noise(4.0, np.ones(2), 3), 4.0)
    still = {
        key: np.repeat(track[:1], 600, axis=0)
        for key, track in made.marked(made.landmarks(made.arm_angles(), made.tables())).items()
    }
    loud = np.clip(noise(6.0, np.ones(2), 1), -2e-4, 2e-4)
    own = {"EMG 3": loud, "EMG 5": noise(6.0, np.ones(2), 5)}
    made.write_c3d(tmp_path / "mvc1.c3d", still, analog=own)
    assert cli.main(arguments) == 2
    said = capsys.readouterr().out
    assert "channel infra, mvc: clipping" in said
    assert "(left out)" in said
    header = (tmp_path / "out" / "reach_r1_emg.csv").read_text(encoding="utf-8").splitlines()[0]
    assert header == "time_s,EMG_delt,simulated"


@pytest.mark.parametrize("gain", [0.0, 1e-3])
def test_a_channel_is_scaled_by_the_contraction_that_holds_it(tmp_path: Path, gain: float) -> None:
    # The second contraction holds half of the amplitude of the trial.
    assert cli.main(session(tmp_path, noise(4.0, 0.4 * np.ones(2), 3), 4.0, gains=(gain, 1.0))) == 0
    table = pd.read_csv(tmp_path / "out" / "reach_r1_emg.csv")
    assert table.EMG_infra.mean() == pytest.approx(2.0, rel=0.2)


@pytest.mark.parametrize(
    ("spoil", "said"),
    [
        (np.abs, "channel infra: no negative values; expected raw EMG"),
        (lambda raw: np.where(np.arange(len(raw)) < 1000, 0.0, raw), "one_value 0.499 s"),
    ],
)
def test_what_is_no_raw_emg_is_said(
    spoil: Callable[[np.ndarray], np.ndarray],
    said: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    raw = spoil(noise(4.0, 0.2 * np.ones(2), 3))
    assert cli.main(session(tmp_path, raw, 4.0)) == 2
    captured = capsys.readouterr()
    assert said in captured.out + captured.err


def test_a_channel_that_all_contractions_are_silent_on_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(session(tmp_path, noise(4.0, np.ones(2), 3), 4.0, gains=(0.0, 0.0))) == 2
    assert "mvc1.c3d, mvc2.c3d, channel infra: silent" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("recordings", "said"),
    [
        (["a/lift.csv", "b/lift.csv"], "recordings named lift more than once"),
        (["out/lift.csv", "out/lift_emg.csv"], "lift_emg.csv: is read, and the result would"),
        (["lift.csv"], "lift_emg.csv: is there without lift_emg_quality.json"),
    ],
)
def test_recordings_and_tables_of_others_are_not_replaced(
    recordings: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Refused before anything is read: of all files only the one that would be lost is there."""
    raw = tmp_path / "out" / "lift_emg.csv"
    raw.parent.mkdir()
    raw.write_text("raw", encoding="utf-8")
    files = [str(tmp_path / name) for name in recordings]
    more = ["--mvc", "mvc.csv", "--map", "emg.yaml", "--out", str(raw.parent)]
    assert cli.main(["emg", *files, *more]) == 2
    assert said in capsys.readouterr().err
    assert raw.read_text(encoding="utf-8") == "raw"


def test_envelopes_of_an_earlier_run_do_not_outlive_a_refusal(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = session(tmp_path, noise(4.0, np.ones(2), 3), 4.0)
    assert cli.main(arguments) == 0
    (tmp_path / "reach_r1.c3d").write_bytes(b"not a recording")
    assert cli.main(arguments) == 2
    assert "refused   reach_r1" in capsys.readouterr().out
    assert not list((tmp_path / "out").glob("reach_r1_emg*"))


def test_a_participant_of_the_study_is_left_as_it_is(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "participant.yaml"
    file.write_text("schema: participant/1\nscale: {}\n", encoding="utf-8")
    arguments = ["lift.c3d", "--mvc", "mvc.c3d", "--map", "emg.yaml", "--out", str(tmp_path)]
    assert cli.main(["emg", *arguments]) == 2
    assert "participant.yaml: is of the study, which makes envelopes" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == "schema: participant/1\nscale: {}\n"


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"EMG 5"', '"EMG 3"', "channels: infra, delt have the label 'EMG 3'"),
        ("[[infra, delt]]", "[[infra, infra]]", "neighbours.0: .* expected: two different"),
        ("delt:", '"delt,1":', "channels: .* expected: a name without spaces, commas"),
        ("delt:", '"delt\\n":', "channels: .* expected: a name without spaces, commas"),
    ],
)
def test_a_map_counts_no_electrode_twice_and_names_columns(
    old: str, new: str, said: str, tmp_path: Path
) -> None:
    text = EMG_MAP.partition("neighbours")[0] if new.startswith('"delt') else EMG_MAP
    assert old in text
    (tmp_path / "emg.yaml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigError, match=said):
        read_emg_map(tmp_path / "emg.yaml")


def test_unknown_muscles_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = session(tmp_path, noise(4.0, np.ones(2), 3), 4.0)
    document = yaml.safe_load(EMG_MAP)
    document["channels"]["infra"]["muscles"] = ["infraspinatus"]
    (tmp_path / "emg.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    assert cli.main(arguments) == 2
    assert "infraspinatus; expected muscle groups" in capsys.readouterr().err
