"""Whose trials a diagnosis is about, read from a participant file.

Two kinds of file are read: the short one of a diagnosis (`DIAGNOSIS_SCHEMA`: a scaled model by file
or by body size, EMG set-up, trial windows) and this study's own ``config/participants/*``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.documents import check_schema, read_mapping
from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.gap.recording.case import GapParticipant, ScaledModel
from scapulohumeral.gap.recording.participant_schema import DIAGNOSIS_SCHEMA, SCALED_FILE_SCHEMA
from scapulohumeral.gap.recording.trials import TrialEntry
from scapulohumeral.laboratory.participant import is_of_study
from scapulohumeral.model.participant_file import check_gravity
from scapulohumeral.model.participant_schema import PARTICIPANT_SCHEMA, SCALED_SEGMENTS
from scapulohumeral.model.tables import read_tables

FILE_NAME = "participant.yaml"
# Stature of an adult whose upper arm is as long as the humerus of the base model, 0.2908 m from
# head to elbow: upper arms are 0.1618 (281.7 of 1741 mm, men) and 0.1586 (275.1 of 1735 mm, women)
# of stature (de Leva 1996, tables 1 and 4); mean of both.
BASE_HEIGHT_M = 1.815


@dataclass(frozen=True)
class ParticipantFile:
    """A participant, what the file says of its trials by stem, and the file."""

    participant: GapParticipant
    trials: Mapping[str, TrialEntry]
    path: Path


def find_participant(tests: Sequence[Path]) -> Path:
    """``participant.yaml`` beside the test files, else one folder above.

    Raises
    ------
    ConfigError                      there is none, or test files have different ones
    DataError                        a test file is missing, so nothing is beside it
    """
    found = {_beside(path.resolve().parent) for path in tests}
    if len(found) > 1:
        raise ConfigError(
            f"test files have different participants: {', '.join(sorted(map(str, found)))}; "
            "expected one. Name it with --participant."
        )
    [path] = found
    if path is None:
        for test in tests:
            if not test.exists():
                raise DataError(f"{test}: no such file. Check the name.")
        raise ConfigError(
            f"no {FILE_NAME} in {tests[0].parent} or its parent. Name one with --participant."
        )
    return path


def by_file(
    references: Sequence[Path], file: ParticipantFile, masses: str
) -> list[tuple[ParticipantFile, list[Path]]]:
    """Reference trials by the participant file beside them, which says what their movements are.

    Parameters
    ----------
    references : trials; file : that of the test trials, and of those with none of their own
    masses : as for `read_participant_file`

    Raises
    ------
    ConfigError                      a file describes another person, model, posture or electrodes
    """
    found: dict[Path, list[Path]] = {}
    for path in references:
        found.setdefault(_beside(path.resolve().parent) or file.path, []).append(path)
    described = []
    for beside, paths in found.items():
        own = file if beside.samefile(file.path) else read_participant_file(beside, masses)
        _check_alike(own, file)
        described.append((own, paths))
    return described


def _check_alike(own: ParticipantFile, file: ParticipantFile) -> None:
    """Refuse a file of reference trials that contradicts that of the test trials.

    One of them may describe electrodes that the other does not.
    """
    one, other = own.participant, file.participant
    described = {
        "id": (one.id, other.id),
        **{
            f"model.{name}": (getattr(one.model, name), getattr(other.model, name))
            for name in (field.name for field in fields(ScaledModel))
        },
        "gravity_in_thorax_mps2": (one.gravity_mps2, other.gravity_mps2),
    }
    common = sorted(one.emg_channels.keys() & other.emg_channels.keys())
    if common:
        described["emg.unit"] = one.emg_unit, other.emg_unit
    for name in common:
        described[f"emg.channels.{name}"] = one.emg_channels[name], other.emg_channels[name]
    for key, (here, there) in described.items():
        if here != there:
            raise ConfigError(
                f"{own.path}, {key}: {here}; expected {there} as in {file.path}, since both sides "
                "are of one person. Name the participant of all trials with --participant."
            )


def _beside(folder: Path) -> Path | None:
    candidates = (folder / FILE_NAME, folder.parent / FILE_NAME)
    return next((path for path in candidates if path.is_file()), None)


def read_participant_file(path: Path, masses: str) -> ParticipantFile:
    """Read a participant file of either kind.

    Parameters
    ----------
    path : Path
    masses : "published" or "anthropometric": of a participant of the study, whose file leaves the
        choice to the configuration

    Raises
    ------
    ConfigError                      names file, key, and what was expected
    """
    document = _read_yaml(path)
    if is_of_study(document):
        _check(path, document, PARTICIPANT_SCHEMA)
        check_gravity(path, document["gravity_in_thorax_mps2"])
        return ParticipantFile(_study_participant(document, masses), {}, path)
    _check(path, document, DIAGNOSIS_SCHEMA)
    check_gravity(path, document["gravity_in_thorax_mps2"])
    emg = document.get("emg", {"channels": {}, "unit": "fraction_of_mvc"})
    channels = {name: tuple(groups) for name, groups in emg["channels"].items()}
    # Cross-talk has no direction: a pair that is named both ways is one.
    pairs = {frozenset(pair): tuple(pair) for pair in emg.get("neighbours", ())}
    neighbours = tuple(pairs.values())
    for name in {name for pair in neighbours for name in pair} - channels.keys():
        raise ConfigError(
            f"{path}, emg.neighbours: '{name}'; expected one of {', '.join(channels)}. "
            "Correct the name, or add the channel."
        )
    participant = GapParticipant(
        id=document["id"],
        side=document["side"],
        model=_model(path, document["model"]),
        gravity_mps2=tuple(map(float, document["gravity_in_thorax_mps2"])),
        emg_channels=channels,
        emg_unit=emg["unit"],
        neighbours=neighbours,
    )
    entries = {stem: _entry(path, stem, e) for stem, e in document.get("trials", {}).items()}
    return ParticipantFile(participant, entries, path)


def _study_participant(document: Mapping[str, Any], masses: Any) -> GapParticipant:
    model = ScaledModel(
        scale={segment: tuple(map(float, f)) for segment, f in document["scale"].items()},
        total_mass_kg=float(document["mass"]["published_total_kg"]),
        segment_mass_kg={},
        masses=masses,
        body_mass_kg=document["body_mass_kg"],
        height_m=document["height_m"],
        sex=document["sex"],
    )
    gravity = tuple(map(float, document["gravity_in_thorax_mps2"]))
    return GapParticipant(document["id"], document["side"], model, gravity, {}, "", ())


def _model(path: Path, entry: Mapping[str, Any]) -> ScaledModel:
    if "file" in entry:
        return read_scaled_model(path.parent / entry["file"])
    factor = entry["height_m"] / BASE_HEIGHT_M
    return ScaledModel(
        scale=dict.fromkeys(SCALED_SEGMENTS, (factor,) * 3),
        total_mass_kg=float(entry["body_mass_kg"]),
        segment_mass_kg={},
        masses="anthropometric",
        body_mass_kg=float(entry["body_mass_kg"]),
        height_m=float(entry["height_m"]),
        sex=entry.get("sex"),
    )


def read_scaled_model(path: Path) -> ScaledModel:
    """Scale factors and masses from a table of scaled segments, ``scaled_*.yaml``.

    Raises
    ------
    ConfigError                      names file, key, and what was expected
    """
    document = _read_yaml(path)
    _check(path, document, SCALED_FILE_SCHEMA)
    masses = {body["name"]: float(body["mass_kg"]) for body in document["bodies"]}
    names = {segment.removesuffix("_r"): segment for segment in SCALED_SEGMENTS}
    scale = {
        names.get(entry["segment"], entry["segment"]): tuple(map(float, entry["scale_xyz"]))
        for entry in document["segment_scale"]
    }
    for key, known in (("bodies", masses), ("segment_scale", scale)):
        missing = [segment for segment in SCALED_SEGMENTS if segment not in known]
        if missing:
            raise ConfigError(f"{path}, {key}: no {', '.join(missing)}; add the missing segments.")
    return ScaledModel(
        scale={segment: scale[segment] for segment in SCALED_SEGMENTS},
        total_mass_kg=sum(masses[segment] for segment in SCALED_SEGMENTS),
        segment_mass_kg={segment: masses[segment] for segment in SCALED_SEGMENTS},
        masses="published",
    )


def check_groups(participant: GapParticipant, tables: Path) -> None:
    """Refuse EMG channels of muscle groups that the model does not simulate.

    Raises
    ------
    ConfigError                      names channel, group, and the groups there are
    """
    groups = read_tables(tables).active_groups
    for channel, names in participant.emg_channels.items():
        for name in sorted(set(names) - set(groups)):
            raise ConfigError(
                f"participant {participant.id}, emg.channels.{channel}: no muscle group '{name}'; "
                f"expected one of {', '.join(groups)}. "
                "Correct the name."
            )


def _entry(path: Path, stem: str, entry: Mapping[str, Any]) -> TrialEntry:
    window = entry.get("window_s")
    if window is not None and window[0] >= window[1]:
        raise ConfigError(
            f"{path}, trials.{stem}.window_s: {window}; expected start before end. Exchange them."
        )
    bounds = window and (float(window[0]), float(window[1]))
    return TrialEntry(entry.get("task"), entry.get("repeat"), bounds)


def _read_yaml(path: Path) -> dict[str, Any]:
    remedy = "Check the name, and the line named."
    document = read_mapping(path, "'schema: participant/1' and others", remedy)
    try:
        _check_values(path, document, "")
    except RecursionError as error:
        raise ConfigError(f"{path}: an entry contains itself. Write it out.") from error
    return document


def _check_values(path: Path, value: Any, place: str) -> None:
    """Refuse .nan and .inf, and names that are no text: no schema has them out of bounds."""
    if isinstance(value, float) and not np.isfinite(value):
        raise ConfigError(f"{path}, {place}: {value}; expected a finite number. Correct the entry.")
    inner = value.items() if isinstance(value, dict) else ()
    items = enumerate(value) if isinstance(value, list) else inner
    for key, item in items:
        if isinstance(value, dict) and not isinstance(key, str):
            raise ConfigError(
                f"{path}, {place}: the name {key} is no text (YAML reads {type(key).__name__}); "
                f"expected text. Write it in quotes: '{key}'."
            )
        _check_values(path, item, f"{place}.{key}".removeprefix("."))


def _check(path: Path, document: Mapping[str, Any], schema: Mapping[str, Any]) -> None:
    check_schema(path, document, schema, "see the README, section 'Your own trials'")
