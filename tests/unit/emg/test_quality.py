"""Each defect of a recording is found in its channel, and a sound recording passes."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from emg_study import ENVELOPE, LIMITS, recording

from scapulohumeral.emg.envelope import Envelopes
from scapulohumeral.emg.quality import (
    check_envelopes,
    check_recording,
    clipped_share,
    write_quality,
)
from scapulohumeral.emg.recording import Recording
from scapulohumeral.emg.synthesis import emg_noise

pytestmark = pytest.mark.unit

TIME = np.arange(10_000) / 2000.0


@pytest.fixture
def sound() -> Recording:
    """Five seconds of three channels that nothing is wrong with, 0.1 mV."""
    noise = emg_noise(len(TIME), 3, 2000.0, np.random.default_rng(3))
    return recording(1e-4 * noise)


def with_channel(recording: Recording, volts: np.ndarray) -> Recording:
    """The recording with another signal in its second channel."""
    changed = recording.volts.copy()
    changed[:, 1] = volts
    return replace(recording, volts=changed)


def failures(recording: Recording) -> set[tuple[str, str]]:
    """Channel and name of the checks that failed."""
    checks = check_recording("trial", recording, ENVELOPE, LIMITS)
    return {(check.channel, check.check) for check in checks if not check.passed}


def test_sound_recording_passes(sound: Recording) -> None:
    assert not failures(sound)


def test_clipping_is_found(sound: Recording) -> None:
    clipped = with_channel(sound, np.clip(sound.volts[:, 1], -2.5e-4, 2.5e-4))
    assert failures(clipped) == {("channel_1", "clipping")}


@pytest.mark.parametrize("steps", [100, 400, None])
def test_a_short_recording_is_not_clipped_by_chance(steps: int | None) -> None:
    """Every signal has extreme values, and a converter of few steps repeats them."""
    volts = emg_noise(1000, 300, 1000.0, np.random.default_rng(4))
    if steps:
        volts = np.round(volts / np.ptp(volts, axis=0) * steps) / steps
    assert np.mean(clipped_share(volts) > LIMITS.clipped_share) < 0.01
    limit = np.quantile(np.abs(volts), 0.99, axis=0)
    assert np.all(clipped_share(np.clip(volts, -limit, limit)) > LIMITS.clipped_share)


@pytest.mark.parametrize("mains_hz", [50.0, 60.0])
def test_mains_hum_is_found_with_its_share(sound: Recording, mains_hz: float) -> None:
    hum = 1e-4 * np.sqrt(2.0 * 0.25) * np.sin(2.0 * np.pi * mains_hz * TIME)
    noisy = with_channel(sound, sound.volts[:, 1] + hum)
    assert failures(noisy) == {("channel_1", "mains_hum")}
    [check] = [c for c in check_recording("trial", noisy, ENVELOPE, LIMITS) if not c.passed]
    assert check.value == pytest.approx(0.2, abs=0.03)


@pytest.mark.parametrize("level", [0.0, 1.3])
def test_dead_channel_is_found(sound: Recording, level: float) -> None:
    dead = with_channel(sound, level + 2e-7 * np.random.default_rng(4).standard_normal(len(TIME)))
    assert ("channel_1", "dead") in failures(dead)


def test_constant_channel_is_dead_and_nothing_else(sound: Recording) -> None:
    assert failures(with_channel(sound, np.zeros(len(TIME)))) == {("channel_1", "dead")}


def test_envelope_above_mvc_is_found() -> None:
    values = np.array([[0.2, 0.9], [0.4, 1.1]])
    checks = check_envelopes(Envelopes(("a", "b"), np.array([0.0, 0.01]), values, False), LIMITS)
    assert [(check.channel, check.value, check.passed) for check in checks] == [
        ("a", 0.4, True),
        ("b", 1.1, False),
    ]


def test_json_holds_values_thresholds_and_verdict(tmp_path: Path, sound: Recording) -> None:
    checks = check_recording("mvc", with_channel(sound, 0.0 * TIME), ENVELOPE, LIMITS)
    write_quality(tmp_path / "quality.json", checks, simulated=True)
    document = json.loads((tmp_path / "quality.json").read_text())
    assert document["simulated"] is True
    assert document["passed"] is False
    [dead] = [entry for entry in document["checks"] if not entry["passed"]]
    assert dead == {
        "recording": "mvc",
        "channel": "channel_1",
        "check": "dead",
        "value": 0.0,
        "threshold": LIMITS.dead_rms_v,
        "unit": "V",
        "passed": False,
    }
