"""Simulated EMG has the stated statistics, says that it is simulated, and can be repeated."""

from dataclasses import replace

import numpy as np
import pytest
from emg_study import CHANNELS, ENVELOPE, LIMITS, SIMULATION

from scapulohumeral.emg.envelope import mvc_amplitudes, normalised_envelopes
from scapulohumeral.emg.quality import check_envelopes, check_recording
from scapulohumeral.emg.synthesis import (
    MARGIN_S,
    emg_noise,
    random_stream,
    simulate_mvc,
    simulate_recording,
)
from scapulohumeral.errors import ConfigError, DataError

pytestmark = pytest.mark.unit

TIME = np.arange(0.0, 8.01, 0.04)


def elevation(scale: np.ndarray | float = 1.0) -> np.ndarray:
    """Excitations like those of raising and lowering an arm, shape (K, 8)."""
    rise = 0.5 - 0.5 * np.cos(2.0 * np.pi * TIME / TIME[-1])
    return (0.02 + 0.4 * rise)[:, None] * np.broadcast_to(scale, len(CHANNELS.names))


def simulate(excitations: np.ndarray, *names: str, **changes: float):
    """A simulated recording with changed settings."""
    settings = replace(SIMULATION, **changes)
    stream = random_stream(settings.seed, *names)
    return simulate_recording(TIME, excitations, CHANNELS, settings, stream)


def test_recording_is_marked_and_outlasts_the_motion() -> None:
    recording = simulate(elevation(), "par2", "frontal")
    assert recording.simulated
    assert recording.rate_hz == 2000.0
    assert recording.time_s[[0, -1]] == pytest.approx([-MARGIN_S, TIME[-1] + MARGIN_S])


def test_pipeline_recovers_the_excitation() -> None:
    """RMSE of an elevation: noise of 10.7 % of the excitation and gain of the channel."""
    mvc = simulate_mvc(CHANNELS, SIMULATION, random_stream(SIMULATION.seed, "par2", "mvc"))
    result = normalised_envelopes(simulate(elevation(), "par2", "frontal"), mvc, ENVELOPE)
    assert result.simulated
    error = result.at(TIME) - elevation()
    assert np.sqrt(np.mean(error**2, axis=0)).max() < 0.04
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert abs(error.mean()) < 0.01


def test_simulated_recordings_pass_the_quality_checks() -> None:
    mvc = simulate_mvc(CHANNELS, SIMULATION, random_stream(SIMULATION.seed, "par2", "mvc"))
    raw = simulate(elevation(), "par2", "frontal")
    checks = [
        *check_recording("trial", raw, ENVELOPE, LIMITS),
        *check_recording("mvc", mvc, ENVELOPE, LIMITS),
        *check_envelopes(normalised_envelopes(raw, mvc, ENVELOPE), LIMITS),
    ]
    assert all(check.passed for check in checks)


def test_noise_has_unit_variance_and_the_spectrum_of_emg() -> None:
    noise = emg_noise(40_000, 4, 2000.0, np.random.default_rng(1))
    np.testing.assert_allclose(noise.std(axis=0), 1.0, atol=0.03)
    power = np.abs(np.fft.rfft(noise, axis=0)) ** 2
    frequency = np.fft.rfftfreq(40_000, 1 / 2000.0)
    median = frequency[np.searchsorted(np.cumsum(power.sum(axis=1)) / power.sum(), 0.5)]
    assert 80.0 < median < 120.0  # of surface EMG of these muscles
    correlation = np.corrcoef(noise.T) - np.eye(4)
    assert np.abs(correlation).max() < 0.05


def test_cross_talk_reaches_neighbours_only() -> None:
    lateral = CHANNELS.names.index("lateral_deltoid")
    alone = np.zeros((len(TIME), len(CHANNELS.names)))
    alone[:, lateral] = 1.0
    rms = simulate(alone, "x", electrode_noise_v=0.0).volts.std(axis=0)
    own = SIMULATION.full_rms_v
    assert rms[lateral] == pytest.approx(own, rel=0.05)
    neighbours = CHANNELS.adjacency()[lateral]
    np.testing.assert_allclose(rms[neighbours], SIMULATION.cross_talk * own, rtol=0.05)
    others = ~neighbours
    others[lateral] = False
    assert not rms[others].any()


def test_silent_muscles_leave_electrode_noise() -> None:
    volts = simulate(0.0 * elevation(), "rest").volts
    np.testing.assert_allclose(volts.std(axis=0), SIMULATION.electrode_noise_v, rtol=0.03)


def test_mvc_of_every_channel_is_its_own_full_excitation() -> None:
    mvc = simulate_mvc(CHANNELS, SIMULATION, random_stream(1, "par2", "mvc"))
    assert mvc.simulated
    rectified = SIMULATION.full_rms_v * np.sqrt(2.0 / np.pi)
    np.testing.assert_allclose(mvc_amplitudes(mvc, ENVELOPE), rectified, rtol=0.08)


def test_weaker_contractions_are_smaller_by_as_much() -> None:
    mvc, weak = (
        mvc_amplitudes(simulate_mvc(CHANNELS, settings, random_stream(1, "par2", "mvc")), ENVELOPE)
        for settings in (SIMULATION, replace(SIMULATION, mvc_effort=0.8))
    )
    np.testing.assert_allclose(weak, 0.8 * mvc, rtol=0.01)
    with pytest.raises(ConfigError, match="mvc_effort: 0"):
        replace(SIMULATION, mvc_effort=0.0)


def test_same_seed_and_names_same_signals() -> None:
    first, again = (simulate(elevation(), "par2", "frontal").volts for _ in range(2))
    np.testing.assert_array_equal(first, again)
    for names, changes in ((("par2", "scapular"), {}), (("par2", "frontal"), {"seed": 2})):
        assert np.abs(simulate(elevation(), *names, **changes).volts - first).max() > 0.0


def test_wrong_excitations_and_settings_are_refused() -> None:
    wrong = elevation()
    wrong[3, 2] = 1.5
    with pytest.raises(DataError, match=r"lateral_deltoid, t = 0.120 s: excitation 1.5; exp"):
        simulate(wrong, "x")
    with pytest.raises(DataError, match=r"shape \(201, 7\); expected \(201 times, 8 channels\)"):
        simulate(elevation()[:, :7], "x")
    with pytest.raises(ConfigError, match="rate_hz: 500; the spectrum of EMG needs at least"):
        replace(SIMULATION, rate_hz=500)
