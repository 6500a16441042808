"""Files of a participant become envelopes: measured EMG is used where participant.yaml names it."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from emg_study import CHANNELS, CONFIG, ENVELOPE, LIMITS, SIMULATION

from scapulohumeral.emg.envelope import read_envelopes
from scapulohumeral.emg.quality import refuse_rectified
from scapulohumeral.emg.recording import (
    Recording,
    read_recording,
    write_failed_recording,
    write_recording,
)
from scapulohumeral.emg.synthesis import random_stream, simulate_mvc, simulate_recording
from scapulohumeral.errors import ConfigError, DataError, SolveError
from scapulohumeral.model.participant import read_participant
from scapulohumeral.stages.emg_processing import EmgFiles, EmgSettings, process_emg

pytestmark = pytest.mark.unit

SETTINGS = EmgSettings(ENVELOPE, LIMITS)
ENTRY = "emg: {mvc: emg/mvc.csv, trials: {frontal: emg/frontal.csv}, delay_s: 0.25}\n"


@pytest.fixture
def participants(tmp_path: Path) -> Path:
    """A copy of the participants that a test may change."""
    return Path(shutil.copytree(CONFIG / "participants", tmp_path / "participants"))


def add_to_yaml(participants: Path, text: str) -> None:
    """Append to participant.yaml of par2."""
    with (participants / "par2" / "participant.yaml").open("a", encoding="utf-8") as handle:
        handle.write(text)


@pytest.fixture
def files(tmp_path: Path, participants: Path) -> EmgFiles:
    """Recordings of par2: infraspinatus at 0.4 from 2 s on."""
    time = np.array([0.0, 1.99, 2.01, 5.0])
    excitations = np.zeros((4, len(CHANNELS.names)))
    excitations[2:, CHANNELS.names.index("infraspinatus")] = 0.4
    raw = simulate_recording(time, excitations, CHANNELS, SIMULATION, random_stream(1, "raw"))
    mvc = simulate_mvc(CHANNELS, SIMULATION, random_stream(1, "mvc"))
    for name, recording in (("raw", raw), ("mvc", mvc)):
        write_recording(tmp_path / f"{name}.csv", recording)
    return EmgFiles(
        participant=participants / "par2" / "participant.yaml",
        channels=CONFIG / "emg" / "channels.csv",
        raw=tmp_path / "raw.csv",
        mvc=tmp_path / "mvc.csv",
    )


def onset(files: EmgFiles, folder: Path) -> float:
    """Time at which the envelope of infraspinatus passes half its level."""
    process_emg("frontal", files, SETTINGS, folder / "envelope.csv", folder / "quality.json")
    envelopes = read_envelopes(folder / "envelope.csv", CHANNELS.names)
    values = envelopes.values[:, CHANNELS.names.index("infraspinatus")]
    return float(envelopes.time_s[np.argmax(values > 0.2)])


def test_simulated_trial(files: EmgFiles, tmp_path: Path) -> None:
    assert onset(files, tmp_path) == pytest.approx(2.0, abs=0.08)
    quality = json.loads((tmp_path / "quality.json").read_text())
    assert quality["simulated"] is True
    assert quality["passed"] is True
    assert len(quality["checks"]) == 8 * (3 + 3 + 1)


def test_emg_that_could_not_be_simulated_stays_sealed(files: EmgFiles, tmp_path: Path) -> None:
    write_failed_recording(files.raw, CHANNELS.names, "no way, even if asked")
    envelope, quality = tmp_path / "envelope.csv", tmp_path / "quality.json"
    process_emg("frontal", files, SETTINGS, envelope, quality)
    with pytest.raises(SolveError, match="envelope.csv: no way, even if asked; there are no"):
        read_envelopes(envelope, CHANNELS.names)
    document = json.loads(quality.read_text())
    assert (document["simulated"], document["passed"]) == (True, False)
    assert document["failure"] == "no way, even if asked"


def test_measured_trial_is_shifted_by_its_delay(
    files: EmgFiles, participants: Path, tmp_path: Path
) -> None:
    before = onset(files, tmp_path)
    add_to_yaml(participants, ENTRY)
    assert onset(files, tmp_path) == before, "simulated signals have no delay"
    raw = read_recording(files.raw, CHANNELS.names)
    write_recording(files.raw, replace(raw, simulated=False))
    assert onset(files, tmp_path) == pytest.approx(before - 0.25, abs=0.011)


def test_trials_know_their_measured_emg(participants: Path) -> None:
    add_to_yaml(participants, ENTRY)
    participant = read_participant(participants, "par2")
    emg = participant.trial("frontal").emg
    assert emg.file == participants / "par2" / "emg" / "frontal.csv"
    assert emg.mvc_file == participants / "par2" / "emg" / "mvc.csv"
    assert emg.delay_s == 0.25
    assert participant.trial("scapular").emg is None


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("frontal:", "running:", "emg.trials: running; expected names of its trials: frontal"),
        (", delay_s: 0.25", "", "emg: 'delay_s' is a required property"),
        ("0.25", "soon", "emg.delay_s: 'soon' is not of type 'number'; expected: what the EMG"),
        ("mvc:", "maximum:", "emg.maximum: there is no such key"),
    ],
)
def test_wrong_entry_is_refused(participants: Path, old: str, new: str, message: str) -> None:
    add_to_yaml(participants, ENTRY.replace(old, new))
    with pytest.raises(ConfigError, match=message):
        read_participant(participants, "par2")


def test_poor_quality_is_reported_and_does_not_stop(files: EmgFiles, tmp_path: Path) -> None:
    strict = replace(SETTINGS, quality=replace(LIMITS, largest_envelope=0.1))
    process_emg("frontal", files, strict, tmp_path / "envelope.csv", tmp_path / "quality.json")
    quality = json.loads((tmp_path / "quality.json").read_text())
    failed = [entry["channel"] for entry in quality["checks"] if not entry["passed"]]
    assert quality["passed"] is False
    assert failed == ["infraspinatus"]


def _rectified(volts: np.ndarray) -> np.ndarray:
    return np.abs(volts)


def test_an_offset_of_the_converter_is_no_rectification() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.2, 4000)
    for volts, refused in ((1.65 + noise, False), (np.abs(noise), True), (noise, False)):
        recording = Recording(
            "raw.csv", CHANNELS.names[:1], 0.0, 1000.0, volts[:, None], simulated=False
        )
        if refused:
            with pytest.raises(DataError, match="It was rectified"):
                refuse_rectified(recording)
        else:
            refuse_rectified(recording)


def _dead(volts: np.ndarray) -> np.ndarray:
    return 1e-9 * volts


def _lost(volts: np.ndarray) -> np.ndarray:
    return np.where(np.arange(len(volts)) < len(volts) // 10, volts[0], volts)


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (_rectified, "no negative values; expected raw EMG"),
        (_dead, "dead .* V; the limit is"),
        (_lost, "one_value .* s; the limit is 0.1 s"),
    ],
)
def test_a_measured_channel_that_means_nothing_is_refused(
    files: EmgFiles, tmp_path: Path, spoil: Callable[[np.ndarray], np.ndarray], message: str
) -> None:
    raw = read_recording(files.raw, CHANNELS.names)
    volts = raw.volts.copy()
    volts[:, 2] = spoil(volts[:, 2])
    spoilt = replace(raw, volts=volts, simulated=False)
    write_recording(files.raw, spoilt)
    with pytest.raises(DataError, match=f"raw.csv, channel {CHANNELS.names[2]}: {message}"):
        process_emg("frontal", files, SETTINGS, tmp_path / "out.csv", tmp_path / "quality.json")
    assert not (tmp_path / "out.csv").exists()
