"""Quality of EMG recordings, channel by channel: clipping, mains hum, dead channel, above MVC.

Letters: T samples, C channels.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.signal import welch

from scapulohumeral.emg.envelope import Envelopes, band_passed
from scapulohumeral.emg.recording import Recording
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.errors import DataError
from scapulohumeral.model.rotations import Array

MAINS_HZ = (50.0, 60.0)
# Width of a line in the spectrum of a Hann window at 1 Hz resolution, and the part of the spectrum
# beside it that tells how much power would be there without hum [Hz].
LINE_HALF_WIDTH_HZ = 2.0
BESIDE_HZ = 8.0
# Samples this close to an extreme value count as clipped, as a share of the range: the step of a
# 12-bit converter is 0.00025.
RAIL_SHARE = 5e-4
# Samples that may repeat an extreme value by chance: of a second of noise at 1000 Hz and 100 steps
# from peak to peak, hardly ever more do.
BY_CHANCE = 4
# ASSUME: amplifiers that work never show one value for longer [s]; radio that is lost does.
LONGEST_ONE_VALUE_S = 0.1
# Least, middle and largest value of a signal, artefacts left out. ASSUME a raw signal reaches at
# least half as far below its median as above; a rectified one a fifth (normal distribution).
QUANTILES, ONE_SIDED = (0.001, 0.5, 0.999), 0.5
# What makes an envelope meaningless; above the MVC it is only too large.
SPOILING = ("clipping", "mains_hum", "dead", "one_value")


@dataclass(frozen=True)
class QualityLimits:
    """Largest or smallest values that pass: keys of `emg.quality` in the configuration.

    Attributes
    ----------
    clipped_share : largest share of samples at the extreme values [1]
    hum_share : largest share of the power that 50 or 60 Hz add [1]
    dead_rms_v : least root mean square of the band-passed signal [V]
    largest_envelope : largest envelope [fraction of MVC]
    """

    clipped_share: float
    hum_share: float
    dead_rms_v: float
    largest_envelope: float


@dataclass(frozen=True)
class Check:
    """One check of one channel; `recording` is "trial" or "mvc"."""

    recording: str
    channel: str
    check: str
    value: float
    threshold: float
    unit: str
    passed: bool


def check_recording(
    name: str, recording: Recording, settings: EnvelopeSettings, limits: QualityLimits
) -> list[Check]:
    """Clipping, mains hum and dead channels of a raw recording.

    Parameters
    ----------
    name : "trial" or "mvc"
    recording, settings, limits

    Raises
    ------
    DataError                        if the sampling rate is too low for the band
    """
    band = band_passed(recording, settings)
    rms = np.sqrt(np.mean(band**2, axis=0))
    measures = (
        ("clipping", clipped_share(recording.volts), limits.clipped_share, "1"),
        ("mains_hum", hum_share(band, recording.rate_hz), limits.hum_share, "1"),
    )
    checks = [
        Check(name, channel, check, float(value), limit, unit, bool(value <= limit))
        for check, values, limit, unit in measures
        for channel, value in zip(recording.channels, values, strict=True)
    ]
    return checks + [
        Check(name, channel, "dead", float(v), limits.dead_rms_v, "V", bool(v >= limits.dead_rms_v))
        for channel, v in zip(recording.channels, rms, strict=True)
    ]


def check_one_value(name: str, recording: Recording) -> list[Check]:
    """How long each channel of a raw recording shows one and the same value at most.

    `name` is "trial" or "mvc".
    """
    checks = []
    for channel, volts in zip(recording.channels, recording.volts.T, strict=True):
        changes = np.flatnonzero(np.diff(volts))
        ends = np.concatenate([[-1], changes, [len(volts) - 1]])
        longest, limit = float(np.diff(ends).max() - 1) / recording.rate_hz, LONGEST_ONE_VALUE_S
        checks.append(Check(name, channel, "one_value", longest, limit, "s", longest <= limit))
    return checks


def spoilt_channels(checks: Sequence[Check]) -> dict[str, Check]:
    """Channels of a recording that mean nothing -> the first check that says so."""
    return {
        check.channel: check
        for check in reversed(checks)
        if not check.passed and check.check in SPOILING
    }


def refuse_rectified(recording: Recording) -> None:
    """Refuse signals that never go below rest: no band-pass makes raw EMG of them again.

    Raw EMG lies about its median, whatever offset the converter adds. What was rectified has its
    least value, zero, close below it.

    Raises
    ------
    DataError                        names file and channel
    """
    for name, volts in zip(recording.channels, recording.volts.T, strict=True):
        low, middle, high = np.quantile(volts, QUANTILES)
        if volts.min() >= 0.0 and middle - low < ONE_SIDED * (high - middle):
            raise DataError(
                f"{recording.source}, channel {name}: no negative values; expected raw EMG. It was "
                "rectified: export the signal before any processing."
            )


def check_envelopes(envelopes: Envelopes, limits: QualityLimits) -> list[Check]:
    """Whether a trial exceeds the maximal voluntary contraction, which is then none."""
    limit = limits.largest_envelope
    return [
        Check("trial", channel, "above_mvc", float(peak), limit, "fraction of MVC", peak <= limit)
        for channel, peak in zip(
            envelopes.channels, envelopes.values.max(axis=0).tolist(), strict=True
        )
    ]


def write_quality(path: Path, checks: Sequence[Check], simulated: bool, failure: str = "") -> None:
    """Write checks as JSON, schema "emg_quality/1"; `passed` says whether all passed.

    `failure`: why there is no recording to check, because it could not be simulated.
    """
    document = {
        "schema": "emg_quality/1",
        "simulated": simulated,
        "passed": not failure and all(check.passed for check in checks),
        "checks": [asdict(check) for check in checks],
    }
    if failure:
        document["failure"] = failure
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def clipped_share(volts: Array) -> Array:
    """Share of samples that repeat the largest and smallest value: (C,).

    An amplifier out of range repeats its extreme values; noise reaches them once, and once more by
    chance of digitisation. Zero for a constant channel, which is dead rather than clipped.
    """
    low, high = volts.min(axis=0), volts.max(axis=0)
    margin = RAIL_SHARE * (high - low)
    at_rail = (volts <= low + margin) | (volts >= high - margin)
    repeats = at_rail.sum(axis=0) - 2
    return np.where((high > low) & (repeats > BY_CHANCE), repeats / len(volts), 0.0)


def hum_share(band: Array, rate_hz: float) -> Array:
    """Share of power that the mains line adds to band-passed EMG, the larger of 50 and 60 Hz: (C,).

    EMG has power at these frequencies too; what the neighbouring frequencies have is subtracted.
    Harmonics of the line are not counted.
    """
    frequency, power = welch(band, rate_hz, nperseg=min(round(rate_hz), len(band)), axis=0)
    total = power.sum(axis=0)
    shares = []
    for mains in MAINS_HZ:
        distance = np.abs(frequency - mains)
        line = distance <= LINE_HALF_WIDTH_HZ
        beside = ~line & (distance <= BESIDE_HZ)
        excess = power[line].sum(axis=0) - line.sum() * power[beside].mean(axis=0)
        shares.append(np.divide(excess, total, out=np.zeros_like(total), where=total > 0.0))
    return np.maximum(np.max(shares, axis=0), 0.0)
