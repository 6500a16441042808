"""From raw EMG to envelopes as fractions of the maximal voluntary contraction (MVC).

Band-pass, full-wave rectification and low-pass as in the paper (section on data processing):
Butterworth filters run forwards and backwards (see `model.smoothing`), with half power (-3 dB) at
the frequencies of the configuration. Both ends are mirrored, so that an envelope keeps its level.

Letters: T samples of the recording, R samples of the envelope, C channels, N times asked for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import butter

from scapulohumeral.emg.recording import Recording
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.emg.signal_table import read_signals, write_failed_signals, write_signals
from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array
from scapulohumeral.model.smoothing import (
    CORNER_FACTOR,
    FILTER_ORDER,
    both_ways,
    low_pass,
    pass_corner,
)


@dataclass(frozen=True, eq=False)
class Envelopes:
    """Processed EMG on the kinematic time base.

    Attributes
    ----------
    channels : (C,)
    time_s : (R,) multiples of the sampling interval
    values : (R, C) fractions of MVC, not negative
    simulated : whether no electrode has seen the signals
    """

    channels: tuple[str, ...]
    time_s: Array
    values: Array
    simulated: bool

    def at(self, time_s: Array) -> Array:
        """Values at other times, shape (N, C), by linear interpolation.

        Whole sampling intervals begin after the recording does and end before it: at both ends the
        value is held for one of them.

        Raises
        ------
        DataError                        if a time is not covered
        """
        first, last = self.time_s[[0, -1]]
        interval = self.time_s[1] - first
        if time_s.min() <= first - interval or time_s.max() >= last + interval:
            raise DataError(
                f"EMG is known from {first:.3f} to {last:.3f} s; asked for {time_s.min():.3f} to "
                f"{time_s.max():.3f} s. Record EMG longer than the motion, or correct emg.delay_s."
            )
        return np.column_stack([np.interp(time_s, self.time_s, column) for column in self.values.T])


def normalised_envelopes(
    raw: Recording, mvc: Recording, settings: EnvelopeSettings, delay_s: float = 0.0
) -> Envelopes:
    """Process a raw recording.

    Parameters
    ----------
    raw : Recording                  the trial
    mvc : Recording                  maximal contraction of every channel, in any order; the
                                     sampling rate may differ from that of the trial
    settings : EnvelopeSettings
    delay_s : what the EMG clock shows when the kinematic clock shows zero

    Raises
    ------
    DataError                        a sampling rate too low for the band, channels that differ, or
                                     an MVC that is zero
    """
    if raw.channels != mvc.channels:
        raise DataError(
            f"{mvc.source}: channels {', '.join(mvc.channels)}; expected those of {raw.source}: "
            f"{', '.join(raw.channels)}. Read both with the same list."
        )
    amplitudes = mvc_amplitudes(mvc, settings)
    refuse_silent(mvc.source, mvc.channels, amplitudes)
    return scaled_envelopes(raw, amplitudes, settings, delay_s, mvc.simulated)


def scaled_envelopes(
    raw: Recording,
    amplitudes_v: Array,
    settings: EnvelopeSettings,
    delay_s: float,
    simulated: bool = False,
) -> Envelopes:
    """Process a raw recording by amplitudes (C,) [V] of maximal contractions, all above zero.

    `simulated`: whether the contractions are; the rest is that of :func:`normalised_envelopes`.
    """
    share = linear_envelope(raw, settings) / amplitudes_v
    clock = raw.time_s - delay_s
    # Tolerance of rounded time stamps, in samples of the envelope.
    first = math.ceil(clock[0] * settings.rate_hz - 1e-3)
    last = math.floor(clock[-1] * settings.rate_hz + 1e-3)
    time = np.arange(first, last + 1) / settings.rate_hz
    values = np.column_stack([np.interp(time, clock, column) for column in share.T])
    return Envelopes(raw.channels, time, values, raw.simulated or simulated)


def band_passed(recording: Recording, settings: EnvelopeSettings) -> Array:
    """Raw EMG without offset, movement artefacts and noise outside its band: (T, C) volts.

    Raises
    ------
    DataError                        sampled too slowly for the band
    """
    highest = settings.band_high_hz
    if recording.rate_hz <= 2.0 * highest:
        raise DataError(
            f"{recording.source}: sampled at {recording.rate_hz:.1f} Hz; a band up to "
            f"{highest:.0f} Hz needs more than {2 * highest:.0f} Hz. Record faster (2,000 Hz is "
            "usual), or lower emg.envelope.band_high_hz."
        )
    edges = [
        pass_corner(settings.band_low_hz, recording.rate_hz, 1.0 / CORNER_FACTOR),
        pass_corner(highest, recording.rate_hz),
    ]
    sections = butter(FILTER_ORDER, edges, "bandpass", fs=recording.rate_hz, output="sos")
    return both_ways(sections, recording.volts, recording.rate_hz, "even")


def linear_envelope(recording: Recording, settings: EnvelopeSettings) -> Array:
    """Mean rectified amplitude over time: (T, C) volts, not negative.

    The low-pass swings below zero beside a sudden onset; an amplitude cannot.
    """
    rectified = np.abs(band_passed(recording, settings))
    return np.maximum(low_passed(rectified, recording.rate_hz, settings), 0.0)


def low_passed(signals: Array, rate_hz: float, settings: EnvelopeSettings) -> Array:
    """Signals (T, ...) through the low-pass that makes an envelope, whatever their sampling rate.

    An excitation has to pass it before it is compared with an envelope.
    """
    return low_pass(signals, rate_hz, settings.cutoff_hz, "even")


def mvc_amplitudes(mvc: Recording, settings: EnvelopeSettings) -> Array:
    """Amplitude of each channel in its maximal voluntary contraction: (C,) volts.

    Raises
    ------
    DataError                        a recording shorter than the window
    """
    envelope = linear_envelope(mvc, settings)
    window = max(1, round(settings.mvc_window_s * mvc.rate_hz))
    if window > len(envelope):
        raise DataError(
            f"{mvc.source}: {len(envelope) / mvc.rate_hz:.2f} s, shorter than "
            f"emg.envelope.mvc_window_s: {settings.mvc_window_s} s. Shorten the window."
        )
    sums = np.cumsum(np.vstack([np.zeros(len(mvc.channels)), envelope]), axis=0)
    return ((sums[window:] - sums[:-window]) / window).max(axis=0)


def refuse_silent(source: str, channels: Sequence[str], amplitudes_v: Array) -> None:
    """Refuse amplitudes (C,) [V] of maximal contractions that nothing can be scaled by.

    Raises
    ------
    DataError                        names what was recorded and the channel
    """
    for name, amplitude in zip(channels, amplitudes_v, strict=True):
        if not amplitude > 0.0:
            raise DataError(
                f"{source}, channel {name}: silent; expected a maximal contraction. "
                "Check the electrode, and repeat the recording."
            )


def write_envelopes(path: Path, envelopes: Envelopes) -> None:
    """Write envelopes as CSV: time_s, <channel>_mvc (fraction of MVC), simulated."""
    columns = [f"{name}_mvc" for name in envelopes.channels]
    write_signals(path, columns, envelopes.time_s, envelopes.values, envelopes.simulated)


def write_failed_envelopes(path: Path, channels: Sequence[str], reason: str) -> None:
    """Write what stands for envelopes whose recording could not be simulated."""
    write_failed_signals(path, [f"{name}_mvc" for name in channels], reason)


def read_envelopes(path: Path, channels: Sequence[str]) -> Envelopes:
    """Read envelopes that `write_envelopes` wrote.

    Raises
    ------
    DataError                        missing column or number; names file, row and column
    SolveError                       envelopes of what could not be simulated
    """
    time, values, simulated = read_signals(path, [f"{name}_mvc" for name in channels])
    return Envelopes(tuple(channels), time, values, simulated)
