"""The stated accuracy of envelopes is measured again."""

from dataclasses import replace

import numpy as np
import pytest
from emg_study import CHANNELS, ENVELOPE, SIMULATION

from scapulohumeral.emg.accuracy import (
    CORRELATION_TIME_S,
    GAINS,
    REST_LEVEL,
    channel_gain,
    correlation_time_s,
    noise_sd,
)
from scapulohumeral.emg.envelope import linear_envelope, mvc_amplitudes
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.emg.synthesis import random_stream, simulate_mvc, simulate_recording

pytestmark = pytest.mark.unit

FULL = SIMULATION.full_rms_v * np.sqrt(2.0 / np.pi)
SECONDS = 30.0


def constant_envelopes(level: float, settings: EnvelopeSettings = ENVELOPE) -> np.ndarray:
    """Envelopes of a constant excitation over the true amplitude of full excitation."""
    excitations = np.full((2, len(CHANNELS.names)), level)
    raw = simulate_recording(
        np.array([0.0, SECONDS]), excitations, CHANNELS, SIMULATION, random_stream(7, str(level))
    )
    return linear_envelope(raw, settings)[1000:-1000] / FULL


@pytest.mark.parametrize("level", [0.05, 0.2, 1.0])
def test_noise_of_a_sample(level: float) -> None:
    measured = constant_envelopes(level).std(axis=0)
    expected = noise_sd(np.array(level), ENVELOPE)
    # Each channel holds 250 independent samples, so its own estimate is within 4.5 %.
    assert np.sqrt(np.mean(measured**2)) == pytest.approx(expected, rel=0.06)


def test_noise_of_a_narrower_envelope() -> None:
    settings = replace(ENVELOPE, cutoff_hz=2.0)
    measured = constant_envelopes(0.2, settings).std(axis=0)
    assert np.sqrt(np.mean(measured**2)) == pytest.approx(
        float(noise_sd(np.array(0.2), settings)), rel=0.08
    )
    assert correlation_time_s(settings) == 2.0 * CORRELATION_TIME_S


def test_correlation_time() -> None:
    """Area of the autocorrelation of the noise, from lags of at most 0.5 s."""
    noise = constant_envelopes(0.2)[::20]
    noise = noise - noise.mean(axis=0)
    lags = [np.mean(noise[: len(noise) - lag] * noise[lag:]) for lag in range(51)]
    area = 2.0 * np.trapezoid(np.array(lags) / lags[0], dx=20 / SIMULATION.rate_hz)
    assert area == pytest.approx(correlation_time_s(ENVELOPE), rel=0.25)


def test_level_at_rest() -> None:
    assert constant_envelopes(0.0).mean() == pytest.approx(REST_LEVEL, rel=0.05)


@pytest.mark.parametrize("window_s", GAINS)
def test_gain_of_a_channel(window_s: float) -> None:
    """MVCs of 12 participants: channels read low by what the MVC reads high."""
    settings = replace(ENVELOPE, mvc_window_s=window_s)
    true = constant_envelopes(1.0).mean() * FULL
    gains = true / np.array(
        [
            mvc_amplitudes(simulate_mvc(CHANNELS, SIMULATION, random_stream(k, "mvc")), settings)
            for k in range(12)
        ]
    )
    bias, sd = channel_gain(settings)
    assert gains.mean() - 1.0 == pytest.approx(bias, abs=0.008)
    assert gains.std() == pytest.approx(sd, rel=0.3)
