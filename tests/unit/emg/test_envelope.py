"""Filters have the stated corners and no delay; normalisation, alignment and resampling."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from emg_study import ENVELOPE, recording

from scapulohumeral.emg.envelope import (
    band_passed,
    linear_envelope,
    mvc_amplitudes,
    normalised_envelopes,
    read_envelopes,
    write_envelopes,
)
from scapulohumeral.errors import ConfigError, DataError

pytestmark = pytest.mark.unit

TIME = np.arange(0.0, 10.0, 1.0 / 2000.0)
CORE = slice(4000, 16000)  # 2 to 8 s: no end of a filter


def tone(frequency_hz: float, amplitude: float = 1.0) -> np.ndarray:
    """A sine at 2000 Hz, shape (20000, 1)."""
    return amplitude * np.sin(2.0 * np.pi * frequency_hz * TIME)[:, None]


@pytest.mark.parametrize(
    ("frequency_hz", "gain"),
    [(10.0, np.sqrt(0.5)), (400.0, np.sqrt(0.5)), (100.0, 1.0), (1.0, 0.0)],
)
def test_band_has_half_power_at_its_edges(frequency_hz: float, gain: float) -> None:
    signal = tone(frequency_hz)
    passed = band_passed(recording(signal), ENVELOPE)
    assert passed[CORE].std() / signal[CORE].std() == pytest.approx(gain, abs=0.01)


def test_envelope_has_half_power_at_its_cutoff() -> None:
    """A carrier whose amplitude swings at the cut-off."""
    swing = 1.0 + 0.5 * tone(ENVELOPE.cutoff_hz)
    envelope = linear_envelope(recording(swing * tone(150.0)), ENVELOPE)[CORE]
    expected = 0.5 * np.sqrt(0.5) * 2.0 / np.pi / np.sqrt(2.0)
    assert envelope.std() == pytest.approx(expected, rel=0.02)


def test_envelope_is_the_mean_rectified_amplitude_and_not_delayed() -> None:
    burst = np.exp(-0.5 * ((TIME - 5.0) / 0.3) ** 2)[:, None]
    envelope = linear_envelope(recording(0.001 * burst * tone(150.0)), ENVELOPE)[:, 0]
    assert TIME[envelope.argmax()] == pytest.approx(5.0, abs=0.005)
    assert envelope.max() == pytest.approx(0.001 * 2.0 / np.pi, rel=0.02)


def test_envelope_keeps_its_level_at_both_ends() -> None:
    envelope = linear_envelope(recording(tone(150.0)), ENVELOPE)
    np.testing.assert_allclose(envelope[[0, -1]], 2.0 / np.pi, rtol=0.05)


def test_offset_of_the_amplifier_does_not_count() -> None:
    plain = linear_envelope(recording(tone(150.0)), ENVELOPE)
    offset = linear_envelope(recording(3.0 + tone(150.0)), ENVELOPE)
    np.testing.assert_allclose(offset, plain, atol=1e-6)


def test_mvc_is_the_largest_mean_over_the_window() -> None:
    amplitude = np.select([(TIME > 2.0) & (TIME < 6.0), (TIME > 7.0) & (TIME < 7.2)], [0.5, 0.9])
    volts = amplitude[:, None] * tone(150.0)
    steady = mvc_amplitudes(recording(volts), ENVELOPE)
    assert steady == pytest.approx(0.5 * 2.0 / np.pi, rel=0.01)
    peak = mvc_amplitudes(recording(volts), replace(ENVELOPE, mvc_window_s=0.0))
    assert peak > 0.8 * 2.0 / np.pi


def test_envelopes_are_fractions_of_mvc_on_the_kinematic_time_base() -> None:
    amplitude = 0.2 + 0.2 * (TIME > 5.0)
    raw = recording(amplitude[:, None] * tone(150.0), start_s=100.0)
    mvc = recording(tone(120.0))
    result = normalised_envelopes(raw, mvc, ENVELOPE, delay_s=99.004)
    np.testing.assert_allclose(result.time_s * 100.0, np.arange(100, 1100), atol=1e-9)
    np.testing.assert_allclose(result.at(np.array([3.0, 9.0])), [[0.2], [0.4]], atol=0.002)
    half = np.interp(0.3, result.values[450:550, 0], result.time_s[450:550])
    assert half == pytest.approx(5.0 + 0.996, abs=0.005)


def test_rates_of_trial_and_mvc_may_differ() -> None:
    slower = np.arange(0.0, 10.0, 1.0 / 1200.0)
    mvc = recording(np.sin(2.0 * np.pi * 153.7 * slower)[:, None], rate_hz=1200.0)
    result = normalised_envelopes(recording(0.3 * tone(150.0)), mvc, ENVELOPE)
    assert result.at(np.array([5.0]))[0, 0] == pytest.approx(0.3, abs=0.003)


def test_csv_round_trip(tmp_path: Path) -> None:
    raw = recording(tone(150.0))
    result = normalised_envelopes(replace(raw, simulated=True), raw, ENVELOPE)
    write_envelopes(tmp_path / "envelope.csv", result)
    header = (tmp_path / "envelope.csv").read_text().splitlines()[0]
    assert header == "time_s,channel_0_mvc,simulated"
    again = read_envelopes(tmp_path / "envelope.csv", result.channels)
    np.testing.assert_allclose(again.values, result.values, rtol=1e-5)
    np.testing.assert_allclose(again.time_s, result.time_s, atol=1e-6)
    assert again.simulated


def test_wrong_recordings_are_refused() -> None:
    slow = recording(tone(100.0)[::3], rate_hz=2000.0 / 3.0)
    with pytest.raises(DataError, match=r"signal.csv: sampled at 666.7 Hz; a band up to 400 Hz"):
        linear_envelope(slow, ENVELOPE)
    with pytest.raises(DataError, match="channel channel_0: silent"):
        normalised_envelopes(recording(tone(150.0)), recording(0.0 * tone(150.0)), ENVELOPE)
    with pytest.raises(DataError, match=r"2.00 s, shorter than emg.envelope.mvc_window_s: 3.0"):
        mvc_amplitudes(recording(tone(150.0)[:4000]), ENVELOPE)
    with pytest.raises(DataError, match="channels channel_0, channel_1; expected those of"):
        normalised_envelopes(
            recording(tone(150.0)), recording(np.hstack([tone(150.0), tone(90.0)])), ENVELOPE
        )
    covered = normalised_envelopes(recording(tone(150.0)), recording(tone(150.0)), ENVELOPE)
    with pytest.raises(DataError, match="EMG is known from 0.000 to 9.990 s; asked for"):
        covered.at(np.array([5.0, 10.5]))


def test_a_motion_of_the_same_frames_is_covered() -> None:
    """EMG that starts between samples of its envelope, and a last frame that is rounded up."""
    raw = recording(tone(150.0), start_s=62.0 / 120.0)
    result = normalised_envelopes(raw, recording(tone(150.0)), ENVELOPE)
    assert result.time_s[0] > raw.time_s[0]
    ends = np.array([raw.time_s[0], np.nextafter(result.time_s[-1], 99.0)])
    np.testing.assert_array_equal(result.at(ends), result.values[[0, -1]])
    with pytest.raises(DataError, match="asked for"):
        result.at(result.time_s[:1] - 0.011)


def test_contradictory_settings_are_refused() -> None:
    with pytest.raises(ConfigError, match="expected them to increase"):
        replace(ENVELOPE, band_low_hz=500.0)
    with pytest.raises(ConfigError, match="at least four times cutoff_hz"):
        replace(ENVELOPE, rate_hz=10.0)
