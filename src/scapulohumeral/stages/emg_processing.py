"""Process the raw EMG of one trial, measured or simulated: from files to files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from scapulohumeral.emg.channels import read_channels
from scapulohumeral.emg.envelope import (
    normalised_envelopes,
    write_envelopes,
    write_failed_envelopes,
)
from scapulohumeral.emg.quality import (
    Check,
    QualityLimits,
    check_envelopes,
    check_one_value,
    check_recording,
    refuse_rectified,
    spoilt_channels,
    write_quality,
)
from scapulohumeral.emg.recording import Recording, read_recording
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.emg.signal_table import signal_failure
from scapulohumeral.errors import DataError
from scapulohumeral.model.participant import participant_of


@dataclass(frozen=True)
class EmgFiles:
    """What envelopes are made from: `raw` is the recording of the trial, measured or simulated."""

    participant: Path
    channels: Path
    raw: Path
    mvc: Path


@dataclass(frozen=True)
class EmgSettings:
    """How EMG is processed, and what it has to pass."""

    envelope: EnvelopeSettings
    quality: QualityLimits


def process_emg(
    trial: str, files: EmgFiles, settings: EmgSettings, envelope: Path, quality: Path
) -> None:
    """Write envelopes on the kinematic time base, and the quality of the recordings.

    EMG that could not be simulated has neither: both files say why.

    Parameters
    ----------
    trial : str                      name of the trial in participant.yaml, which gives delay and
                                     labels of measured EMG; simulated EMG has neither
    files : EmgFiles
    settings : EmgSettings
    envelope : Path                  CSV to write: <channel>_mvc, fractions of MVC
    quality : Path                   JSON to write, schema "emg_quality/1"

    Raises
    ------
    DataError                        if a recording cannot be used. Measured EMG cannot where a
                                     channel is dead, clipped, rectified, or holds mains hum: a
                                     calibration would take it for what the muscle does. Envelopes
                                     above the maximal contraction are reported
    """
    measured = participant_of(files.participant).trial(trial).emg
    channels = read_channels(files.channels).names
    if failure := signal_failure(files.raw):
        write_failed_envelopes(envelope, channels, failure)
        write_quality(quality, [], simulated=True, failure=failure)
        return
    labels = measured.labels if measured else {}
    raw = read_recording(files.raw, channels, labels)
    mvc = read_recording(files.mvc, channels, labels)
    of_trial, of_mvc = (
        check_recording(name, recording, settings.envelope, settings.quality)
        for name, recording in (("trial", raw), ("mvc", mvc))
    )
    if not raw.simulated:
        # Nobody has to contract all muscles in each recording of maximal contractions.
        _refuse_spoilt(raw, [*of_trial, *check_one_value("trial", raw)])
        _refuse_spoilt(mvc, of_mvc)
    # The participant may have measured EMG, and a study beside it be of simulated signals.
    delay = measured.delay_s if measured and not raw.simulated else 0.0
    envelopes = normalised_envelopes(raw, mvc, settings.envelope, delay)
    write_envelopes(envelope, envelopes)
    checks = [*of_trial, *of_mvc, *check_envelopes(envelopes, settings.quality)]
    write_quality(quality, checks, envelopes.simulated)


def _refuse_spoilt(recording: Recording, checks: Sequence[Check]) -> None:
    """Refuse a measured recording with a channel that means nothing."""
    refuse_rectified(recording)
    for channel, check in spoilt_channels(checks).items():
        raise DataError(
            f"{recording.source}, channel {channel}: {check.check} {check.value:.3g} {check.unit}; "
            f"the limit is {check.threshold:g} {check.unit}. Record it again, or calibrate without "
            "this trial."
        )
