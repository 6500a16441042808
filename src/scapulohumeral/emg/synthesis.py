"""Raw EMG simulated from excitations, to enter the pipeline like a measured recording.

A channel is band-limited Gaussian noise, whose standard deviation follows the excitation (Shwedyk,
Balasubramanian, Scott 1977, IEEE Trans Biomed Eng 24: 417-424), plus what reaches the electrode
from neighbouring muscles and the noise of the electrode. The mean rectified amplitude is then
proportional to the excitation, so the envelope as a fraction of MVC estimates the excitation; how
well, is in :mod:`scapulohumeral.emg.accuracy`.

Everything made here is marked as simulated.

Letters: K knots of the excitations, T samples, C channels, F frequencies.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.emg.channels import Channels
from scapulohumeral.emg.recording import Recording
from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.rotations import Array

# Shape of the spectrum of surface EMG, whose largest power is near 70 Hz (Shwedyk et al. 1977,
# equation for the power spectrum; frequencies as usual in simulations of surface EMG, e.g. Farina,
# Merletti 2000, J Electromyogr Kinesiol 10: 337-349).
LOW_HZ = 60.0
HIGH_HZ = 120.0
# The recorder starts before the motion and stops after it [s], so that no end of a filter is seen.
MARGIN_S = 0.5
# Rise and fall of a maximal contraction, and rest before and after it [s].
MVC_RAMP_S = 0.5
MVC_REST_S = 0.25
# Solvers leave excitations outside their bounds by about their tolerance.
BOUND_TOLERANCE = 1e-3


@dataclass(frozen=True)
class SimulationSettings:
    """Simulated electrodes: keys of `emg.simulation` in the configuration.

    Attributes
    ----------
    rate_hz : sampling rate
    full_rms_v : root mean square of a channel at full excitation, without noise
    electrode_noise_v : root mean square of the noise of electrode and amplifier
    cross_talk : share of a neighbour's amplitude that reaches an electrode
    mvc_hold_s : how long a maximal contraction is held
    mvc_effort : excitation that is reached in it, 1 if it is maximal
    seed : of all random numbers
    """

    rate_hz: float
    full_rms_v: float
    electrode_noise_v: float
    cross_talk: float
    mvc_hold_s: float
    seed: int
    mvc_effort: float = 1.0

    def __post_init__(self) -> None:
        if self.rate_hz < 10.0 * HIGH_HZ:
            raise ConfigError(
                f"emg.simulation.rate_hz: {self.rate_hz}; the spectrum of EMG needs at least "
                f"{10 * HIGH_HZ:.0f} Hz."
            )
        if not 0.0 < self.mvc_effort <= 1.0:
            raise ConfigError(
                f"emg.simulation.mvc_effort: {self.mvc_effort}; expected more than 0, at most 1"
            )


def random_stream(seed: int, *names: str) -> np.random.Generator:
    """Random numbers of their own for each combination of names, e.g. participant and trial."""
    return np.random.default_rng([seed, *"/".join(names).encode()])


def simulate_recording(
    time_s: Array,
    excitations: Array,
    channels: Channels,
    settings: SimulationSettings,
    stream: np.random.Generator,
) -> Recording:
    """Raw EMG of a motion.

    Parameters
    ----------
    time_s : (K,) increasing, kinematic clock, which is also that of the recording
    excitations : (K, C) mean excitation of the elements of each channel, linear between knots and
        constant outside: the recording is longer by a margin at both ends
    channels : Channels              neighbours for cross-talk
    settings : SimulationSettings
    stream : random numbers, see `random_stream`

    Raises
    ------
    DataError                        an excitation outside 0 to 1
    """
    _check_excitations(time_s, excitations, channels)
    first = np.floor((time_s[0] - MARGIN_S) * settings.rate_hz)
    last = np.ceil((time_s[-1] + MARGIN_S) * settings.rate_hz)
    clock = np.arange(first, last + 1.0) / settings.rate_hz
    excited = np.column_stack([np.interp(clock, time_s, column) for column in excitations.T])
    # ASSUME the amplitude of surface EMG is proportional to the excitation of the elements that the
    # channel stands for, and that it has no electromechanical delay beyond activation dynamics.
    muscles = settings.full_rms_v * np.clip(excited, 0.0, 1.0)
    signals = muscles * emg_noise(clock.size, len(channels.names), settings.rate_hz, stream)
    signals += settings.cross_talk * signals @ channels.adjacency()
    signals += settings.electrode_noise_v * stream.standard_normal(signals.shape)
    return Recording("simulated EMG", channels.names, clock[0], settings.rate_hz, signals, True)


def simulate_mvc(
    channels: Channels, settings: SimulationSettings, stream: np.random.Generator
) -> Recording:
    """Raw EMG of maximal contractions, one muscle after the other with the others at rest.

    Parameters
    ----------
    channels, settings, stream       as `simulate_recording`
    """
    count = len(channels.names)
    block = np.cumsum([MVC_REST_S, MVC_RAMP_S, settings.mvc_hold_s, MVC_RAMP_S, MVC_REST_S])
    knots = np.concatenate([block[:4] + k * block[4] for k in range(count)])
    held = settings.mvc_effort
    excitations = np.kron(np.eye(count), np.array([[0.0], [held], [held], [0.0]]))
    return simulate_recording(knots, excitations, channels, settings, stream)


def emg_noise(samples: int, channels: int, rate_hz: float, stream: np.random.Generator) -> Array:
    """Gaussian noise with the spectrum of surface EMG: (T, C), independent, variance 1."""
    frequency = np.fft.rfftfreq(samples, 1.0 / rate_hz)[:, None]
    shape = HIGH_HZ**2 * frequency / (np.hypot(frequency, LOW_HZ) * (frequency**2 + HIGH_HZ**2))
    spectrum = np.fft.rfft(stream.standard_normal((samples, channels)), axis=0)
    # Frequencies inside the spectrum count twice: they stand for the negative ones too.
    twice = np.where((frequency > 0.0) & (frequency < 0.5 * rate_hz), 2.0, 1.0)
    variance = (twice * shape**2).sum() / samples
    return np.fft.irfft(shape / np.sqrt(variance) * spectrum, samples, axis=0)


def _check_excitations(time_s: Array, excitations: Array, channels: Channels) -> None:
    if excitations.shape != (len(time_s), len(channels.names)):
        raise DataError(
            f"excitations of shape {excitations.shape}; expected ({len(time_s)} times, "
            f"{len(channels.names)} channels). Average over the elements of each channel first."
        )
    faulty = np.argwhere(~(np.abs(excitations - 0.5) <= 0.5 + BOUND_TOLERANCE))
    if faulty.size:
        knot, channel = faulty[0]
        raise DataError(
            f"channel {channels.names[channel]}, t = {time_s[knot]:.3f} s: excitation "
            f"{excitations[knot, channel]:.4g}; expected 0 to 1. Check the solution it is from."
        )
