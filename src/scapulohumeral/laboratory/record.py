"""What a conversion writes beside its page: the trial table and the record of what it rests on."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.checks import FAULT, Finding
from scapulohumeral.laboratory.markers.gaps import Gap
from scapulohumeral.laboratory.trial import MEASURED, Channel, Converted, provenance_of
from scapulohumeral.model.motion import ANGLE_COLUMNS, TIME_COLUMN, Motion
from scapulohumeral.model.rotations import ANGLE_NAMES
from scapulohumeral.provenance import file_hash

SCHEMA = "recording/1"
SUFFIX = ".recording.json"


@dataclass(frozen=True)
class Source:
    """Where a trial comes from.

    Attributes
    ----------
    file : recording
    kind : "markers", "opensim motion" or "orientations"
    files : further files that shaped it, such as the marker map or the model
    settings : what they say, in words or numbers
    gaps : filled gaps of markers
    lengths_m : segment -> (median, standard deviation) [m]
    gravity_mps2 : mean gravity in thorax axes, or None if nothing says where up is
    """

    file: Path
    kind: str
    files: tuple[Path, ...]
    settings: Mapping[str, Any]
    gaps: tuple[Gap, ...] = ()
    lengths_m: Mapping[str, tuple[float, float]] | None = None
    gravity_mps2: tuple[float, ...] | None = None


def write_trial(path: Path, trial: Converted | Motion) -> None:
    """Write the trial table: time_s and the ten joint angles in degrees."""
    table = np.column_stack([trial.time_s, np.rad2deg(trial.angles_rad)])
    header = ",".join([TIME_COLUMN, *ANGLE_COLUMNS])
    np.savetxt(
        path, table, fmt=["%.6f", *["%.5f"] * len(ANGLE_COLUMNS)], delimiter=",", header=header,
        comments="",
    )  # fmt: skip


def record_path(trial: Path) -> Path:
    """The record beside a trial table."""
    return trial.with_name(trial.stem + SUFFIX)


def write_record(
    path: Path, converted: Converted, source: Source, findings: Sequence[Finding], command: str
) -> None:
    """Write what a trial rests on as JSON, schema "recording/1".

    Parameters
    ----------
    path : Path                      as from `record_path`
    converted, source : the trial and where it comes from
    findings : of all checks
    command : that made it
    """
    document = {
        "schema": SCHEMA,
        "source": {"file": source.file.name, "sha256": file_hash(source.file), "kind": source.kind},
        "made_from": {file.name: file_hash(file) for file in source.files},
        "settings": dict(source.settings),
        "frames": len(converted.time_s),
        "rate_hz": converted.rate_hz,
        "smoothed_hz": converted.smoothed_hz,
        "usable": not any(finding.severity == FAULT for finding in findings),
        "findings": [asdict(finding) for finding in findings],
        "filled_gaps": [asdict(gap) for gap in source.gaps],
        "segment_lengths_mm": {
            name: {"median": round(1e3 * middle, 2), "standard_deviation": round(1e3 * spread, 2)}
            for name, (middle, spread) in (source.lengths_m or {}).items()
        },
        "gravity_in_thorax_mps2": source.gravity_mps2,
        "channels": provenance_of(converted.channels),
        "command": command,
        "version": metadata.version("scapulohumeral"),
    }
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def read_record(trial: Path) -> dict[str, Any]:
    """The record beside a trial table; empty if there is none.

    Raises
    ------
    DataError                        the record is no JSON
    """
    path = record_path(trial)
    if not path.is_file():
        return {}
    try:
        document: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        raise DataError(f"{path}: not JSON: {error}. Convert the recording again.") from error
    if not isinstance(document, dict):
        raise DataError(f"{path}: no keys; expected schema {SCHEMA}. Convert the recording again.")
    return document


def read_channels(trial: Path) -> dict[str, Channel]:
    """What the joint angles of a trial table rest on.

    Parameters
    ----------
    trial : Path                     table; without a record beside it all angles count as measured

    Returns
    -------
    dict                             joint angle -> Channel, in the order of ``ANGLE_NAMES``

    Raises
    ------
    DataError                        the record is not one, or lacks a joint angle
    """
    document = read_record(trial)
    if not document:
        return {name: Channel(MEASURED) for name in ANGLE_NAMES}
    channels = document.get("channels", {}) if document.get("schema") == SCHEMA else {}
    missing = [name for name in ANGLE_NAMES if name not in channels]
    if missing:
        raise DataError(
            f"{record_path(trial)}, channels: no {', '.join(missing)}; expected "
            f"schema {SCHEMA} with all joint angles. Convert the recording again, or "
            "remove the file if all were measured."
        )
    try:
        return {name: Channel(**channels[name]) for name in ANGLE_NAMES}
    except TypeError as error:
        raise DataError(
            f"{record_path(trial)}, channels: {error}; expected status, rule and uncertainty of "
            "each joint angle. Convert the recording again."
        ) from error
