"""Raw EMG of own recordings to the envelopes that a diagnosis reads, by the study's own pipeline.

Letters: C channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from scapulohumeral.configuration.check import read_config
from scapulohumeral.emg.channels import neighbours_of
from scapulohumeral.emg.envelope import Envelopes, mvc_amplitudes, refuse_silent, scaled_envelopes
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
from scapulohumeral.emg.signal_table import write_signals
from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.laboratory.markers.map_file import closed, read_map
from scapulohumeral.laboratory.participant import (
    PARTICIPANT_FILE,
    is_of_study,
    participant_document,
)
from scapulohumeral.model.csv_table import first_line_names, read_numbers
from scapulohumeral.model.motion import TIME_COLUMN
from scapulohumeral.model.rotations import Array

# Ends of EMG and motion of the same frames differ by less: a frame, and a sample of the envelope.
SAME_CLOCK_S = 0.05
# Names become columns of a table: no separator, quote or line break.
_NAME = {
    "type": "string",
    "pattern": r'^[^/+ >,"\r\n]+$(?!\n)',
    "description": "a name without spaces, commas, quotes, line breaks, /, + and >",
}
EMG_MAP_SCHEMA = closed(
    {
        "schema": {"const": "emg_map/1"},
        "channels": {
            "type": "object",
            "minProperties": 1,
            "propertyNames": _NAME,
            "additionalProperties": closed(
                {
                    "label": {"type": "string", "minLength": 1},
                    "muscles": {
                        "type": "array",
                        "items": {"type": "string"},
                        "minItems": 1,
                        "description": "muscle groups of the model, as in config/model/muscles.csv",
                    },
                },
                "{label: of the analog channel, muscles: [groups under the electrode]}",
                "label",
                "muscles",
            ),
            "description": "channel: {label: ..., muscles: [...]}",
        },
        "neighbours": neighbours_of(_NAME),
        "delay_s": {
            "type": "number",
            "minimum": -600,
            "maximum": 600,
            "description": "what the EMG clock shows when the clock of the motion shows zero [s]",
        },
    },
    "keys schema, channels, optionally neighbours and delay_s",
    "schema",
    "channels",
)
# Of envelopes that are written here, as participant files of a diagnosis name it.
UNIT = "fraction_of_mvc"
# What to do about a participant file of a diagnosis that cannot be read.
MAKE_AGAIN = "Make it again: scapulohumeral convert."
# Above the MVC an envelope is only too large, unless it is by this much [fractions of MVC], which
# no weak contraction explains.
IMPOSSIBLE_SHARE = 3.0


@dataclass(frozen=True)
class EmgMap:
    """Channels of a laboratory.

    Attributes
    ----------
    path : file
    labels : channel -> label in the recordings
    muscles : channel -> muscle groups of the model under the electrode
    neighbours : pairs of channels
    delay_s : what the EMG clock shows when the clock of the motion shows zero
    """

    path: Path
    labels: Mapping[str, str]
    muscles: Mapping[str, tuple[str, ...]]
    neighbours: tuple[tuple[str, ...], ...]
    delay_s: float


@dataclass(frozen=True)
class EmgPipeline:
    """How EMG is processed and what it has to pass: sections of the study's configuration."""

    envelope: EnvelopeSettings
    quality: QualityLimits


@dataclass(frozen=True, eq=False)
class Contractions:
    """Maximal contractions.

    Attributes
    ----------
    amplitudes_v : (C,) of the best recording of each channel
    checks : of all recordings
    spoilt : channels that every recording spoils -> a check that says so
    simulated : whether no electrode has seen one of them
    """

    amplitudes_v: Array
    checks: tuple[Check, ...]
    spoilt: Mapping[str, Check]
    simulated: bool


@dataclass(frozen=True, eq=False)
class ProcessedTrial:
    """Envelopes of a trial, all checks, and channels whose envelopes mean nothing."""

    envelopes: Envelopes
    checks: tuple[Check, ...]
    spoilt: Mapping[str, Check]


def read_emg_map(path: Path) -> EmgMap:
    """Read and check a map of EMG channels.

    Raises
    ------
    ConfigError                      names file, key, what was expected, and the remedy
    """
    document = read_map(path, EMG_MAP_SCHEMA)
    channels = document["channels"]
    pairs = tuple(tuple(pair) for pair in document.get("neighbours", ()))
    unknown = sorted({name for pair in pairs for name in pair} - set(channels))
    if unknown:
        raise ConfigError(
            f"{path}, neighbours: {', '.join(unknown)}; expected channels: {', '.join(channels)}."
        )
    labels = {name: entry["label"] for name, entry in channels.items()}
    twice = [name for name, label in labels.items() if [*labels.values()].count(label) > 1]
    if twice:
        raise ConfigError(
            f"{path}, channels: {', '.join(twice)} have the label '{labels[twice[0]]}'; expected "
            "one channel per electrode. Name all muscles under it in one channel."
        )
    return EmgMap(
        path=path,
        labels=labels,
        muscles={name: tuple(entry["muscles"]) for name, entry in channels.items()},
        neighbours=pairs,
        delay_s=float(document.get("delay_s", 0.0)),
    )


def check_muscles(emg_map: EmgMap, groups: Sequence[str]) -> None:
    """Refuse muscle groups that the model does not simulate.

    Raises
    ------
    ConfigError                      names file, channel and the groups that there are
    """
    for channel, muscles in emg_map.muscles.items():
        unknown = [name for name in muscles if name not in groups]
        if unknown:
            raise ConfigError(
                f"{emg_map.path}, channels.{channel}.muscles: {', '.join(unknown)}; expected "
                f"muscle groups that the model simulates: {', '.join(sorted(set(groups)))}."
            )


def read_pipeline(config: Path) -> EmgPipeline:
    """Settings of the study's EMG pipeline from its configuration.

    Raises
    ------
    ConfigError                      the configuration cannot be read, or its schema refuses it
    """
    section = read_config(config)["emg"]
    return EmgPipeline(EnvelopeSettings(**section["envelope"]), QualityLimits(**section["quality"]))


def read_contractions(
    files: Sequence[Path], emg_map: EmgMap, pipeline: EmgPipeline
) -> Contractions:
    """Maximal contractions; a channel is scaled by its largest amplitude over those that hold it.

    Where none holds it, or a larger one was clipped, it is spoilt, and scaled by the largest of
    all.

    Raises
    ------
    DataError                        no recording, one that cannot be used, or a channel that is
                                     silent in all of them
    """
    if not files:
        raise DataError("no maximal contractions; expected a recording or more. Name them: --mvc.")
    recordings = tuple(_read(file, emg_map) for file in files)
    for recording in recordings:
        # Envelopes would be too large by a half or more, whatever the trials are.
        refuse_rectified(recording)
    checks = [
        [
            *check_recording("mvc", one, pipeline.envelope, pipeline.quality),
            *check_one_value("mvc", one),
        ]
        for one in recordings
    ]
    faults = [spoilt_channels(each) for each in checks]
    spoilt = {
        name: check for name, check in faults[0].items() if all(name in each for each in faults)
    }
    held = [[name in spoilt or name not in each for name in emg_map.labels] for each in faults]
    amplitudes = np.array([mvc_amplitudes(r, pipeline.envelope) for r in recordings])
    best = np.where(held, amplitudes, 0.0).max(axis=0)
    # A clipped amplitude is a lower bound: what is smaller is no maximum, and of another muscle.
    for i, each in enumerate(faults):
        for k, name in enumerate(emg_map.labels):
            clipped = name in each and each[name].check == "clipping"
            if clipped and name not in spoilt and amplitudes[i, k] > best[k]:
                spoilt[name] = each[name]
    best = np.where([name in spoilt for name in emg_map.labels], amplitudes.max(axis=0), best)
    refuse_silent(", ".join(file.name for file in files), tuple(emg_map.labels), best)
    return Contractions(
        amplitudes_v=best,
        checks=tuple(check for each in checks for check in each),
        spoilt=spoilt,
        simulated=any(recording.simulated for recording in recordings),
    )


def _read(file: Path, emg_map: EmgMap) -> Recording:
    """A recording by labels; in CSV files the columns are <label>_V."""
    if file.suffix.lower() == ".csv":
        recording = read_recording(file, tuple(emg_map.labels.values()))
        return replace(recording, channels=tuple(emg_map.labels))
    return read_recording(file, tuple(emg_map.labels), emg_map.labels)


def process_trial(
    file: Path, contractions: Contractions, emg_map: EmgMap, pipeline: EmgPipeline
) -> ProcessedTrial:
    """Envelopes of a trial as fractions of the maximal contraction, and all checks.

    Raises
    ------
    DataError                        the recording cannot be used
    """
    raw = _read(file, emg_map)
    refuse_rectified(raw)
    envelopes = scaled_envelopes(
        raw,
        contractions.amplitudes_v,
        pipeline.envelope,
        emg_map.delay_s,
        contractions.simulated,
    )
    own = check_recording("trial", raw, pipeline.envelope, pipeline.quality)
    own += check_one_value("trial", raw)
    above = check_envelopes(envelopes, pipeline.quality)
    impossible = {one.channel: one for one in above if one.value > IMPOSSIBLE_SHARE}
    return ProcessedTrial(
        envelopes=envelopes,
        checks=(*own, *contractions.checks, *above),
        spoilt={**impossible, **contractions.spoilt, **spoilt_channels(own)},
    )


def quality_path(table: Path) -> Path:
    """The quality beside a table of envelopes."""
    return table.with_name(f"{table.stem}_quality.json")


def write_emg(table: Path, trial: ProcessedTrial, keep_spoilt: bool) -> tuple[str, ...]:
    """Write ``STEM_emg.csv`` and its quality beside a trial table; returns the channels written.

    Parameters
    ----------
    table : Path                     CSV to write: time_s, EMG_<channel> as fractions of the MVC
    trial : what is written
    keep_spoilt : also write channels whose envelopes mean nothing

    Raises
    ------
    DataError                        no channel is left
    """
    envelopes, spoilt = trial.envelopes, {} if keep_spoilt else trial.spoilt
    kept = [i for i, name in enumerate(envelopes.channels) if name not in spoilt]
    write_quality(quality_path(table), trial.checks, envelopes.simulated)
    if not kept:
        raise DataError(
            f"no channel left; {describe(next(iter(spoilt.values())))}. Check amplifier and "
            "electrodes."
        )
    names = tuple(envelopes.channels[i] for i in kept)
    columns = [f"EMG_{name}" for name in names]
    write_signals(table, columns, envelopes.time_s, envelopes.values[:, kept], envelopes.simulated)
    return names


def clocks_apart(envelopes: Envelopes, table: Path, delay_s: float) -> str:
    """What is to be said of clocks of EMG and motion, empty if nothing.

    Both were cut at the same frames if both ends are apart by as much. A C3D file counts from its
    first frame, another export of the same trial may keep the clock of the whole recording.

    Parameters
    ----------
    envelopes : as processed with `delay_s`; table : of the trial, which need not be there
    """
    if not table.is_file():
        return ""
    # Tables of other programs may have the short name that a diagnosis takes, too.
    column = TIME_COLUMN if TIME_COLUMN in first_line_names(table) else "time"
    motion_s = read_numbers(table, (column,))[[0, -1], 0]
    apart = envelopes.time_s[[0, -1]] - motion_s
    both = (
        f"EMG from {envelopes.time_s[0]:.2f} s to {envelopes.time_s[-1]:.2f} s, {table.name} from "
        f"{motion_s[0]:.2f} s to {motion_s[1]:.2f} s"
    )
    if abs(np.diff(apart)[0]) > SAME_CLOCK_S:
        if apart[0] > SAME_CLOCK_S or apart[1] < -SAME_CLOCK_S:
            return f"{both}: a diagnosis needs EMG of the whole movement"
        if abs(apart[0]) <= SAME_CLOCK_S:
            return (
                f"{both}: both begin together and the EMG goes on; if the beginning of the motion "
                f"was cut off, the EMG is late by up to {apart[1]:.2f} s: cut both alike"
            )
        return ""
    if abs(apart.mean()) <= SAME_CLOCK_S:
        return ""
    return (
        f"{both}: if both are the same frames, their clocks differ; write delay_s: "
        f"{delay_s + apart.mean():.2f} in the map"
    )


def describe(check: Check) -> str:
    """A failed check in words."""
    unit = "" if check.unit == "1" else f" {check.unit}"
    words = (
        f"channel {check.channel}, {check.recording}: {check.check} {check.value:.3g}{unit}; "
        f"allowed {check.threshold:g}"
    )
    if check.check == "above_mvc" and check.value > IMPOSSIBLE_SHARE:
        words += "; trial and contraction are in different units, or exchanged"
    return words


def check_participant(folder: Path) -> None:
    """Refuse a participant file that does not go with shares of maximal voluntary contractions.

    Raises
    ------
    ConfigError                      the participant is of the study, which takes raw EMG and no
                                     envelopes, or has EMG of another unit
    """
    document = participant_document(folder, MAKE_AGAIN) or {}
    path = folder / PARTICIPANT_FILE
    if is_of_study(document):
        raise ConfigError(
            f"{path}: is of the study, which makes envelopes itself; expected the folder of "
            "converted trials as --out. Name raw recordings in this file under emg: mvc, trials "
            "and delay_s."
        )
    unit = _emg(document).get("unit", UNIT)
    if unit != UNIT:
        raise ConfigError(
            f"{path}, emg.unit: {unit}; expected {UNIT}, which envelopes written here are. Name "
            "another folder, or remove the entry emg if its trials are gone."
        )


def add_to_participant(folder: Path, emg_map: EmgMap, channels: Sequence[str]) -> Path | None:
    """Put the EMG set-up into the participant file of a diagnosis, where there is one.

    Channels that it had before stay as long as a table of the folder has them: trials may have been
    processed one after the other, and from other electrodes.
    """
    document = participant_document(folder, MAKE_AGAIN)
    if document is None:
        return None
    path = folder / PARTICIPANT_FILE
    text = path.read_text(encoding="utf-8")
    before = _emg(document)
    recorded = frozenset().union(*map(first_line_names, folder.glob("*.csv")))
    known = {
        **{name: own for name, own in before.get("channels", {}).items() if name in recorded},
        **{f"EMG_{name}": list(emg_map.muscles[name]) for name in channels},
    }
    pairs = [[f"EMG_{name}" for name in pair] for pair in emg_map.neighbours]
    pairs += [list(pair) for pair in before.get("neighbours", ()) if list(pair) not in pairs]
    document["emg"] = {
        "unit": UNIT,
        "channels": known,
        "neighbours": [pair for pair in pairs if set(pair) <= known.keys()],
    }
    comment = "".join(line for line in text.splitlines(keepends=True) if line.startswith("#"))
    body = yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=100)
    path.write_text(comment + body, encoding="utf-8")
    return path


def _emg(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """What a participant file says of EMG; nothing if it says it in no way that can be read."""
    entry = document.get("emg")
    return entry if isinstance(entry, Mapping) else {}
