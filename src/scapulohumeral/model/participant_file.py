"""The file ``participant.yaml``, read and checked without any recorded motion."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from scapulohumeral.documents import check_schema, read_yaml
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.participant_schema import PARTICIPANT_SCHEMA


def list_participants(directory: Path) -> tuple[str, ...]:
    """Names of the participants in a directory: its folders with a participant.yaml."""
    return tuple(sorted(path.parent.name for path in directory.glob("*/participant.yaml")))


def read_participant_file(directory: Path, name: str) -> dict[str, Any]:
    """Content of a participant's file.

    Parameters
    ----------
    directory : folder of all participants, e.g. config/participants
    name : the participant's own folder in it

    Raises
    ------
    ConfigError                      unknown participant, or participant.yaml is wrong
    """
    path = directory / name / "participant.yaml"
    if not path.is_file():
        raise ConfigError(
            f"participant '{name}': no {path}. Choose from "
            f"{', '.join(list_participants(directory)) or 'none'}, or add the file."
        )
    document = read_yaml(path, "Correct the line named.")
    usual = "see the comments in the other participants' files"
    check_schema(path, document, PARTICIPANT_SCHEMA, usual)
    if document["id"] != name:
        raise ConfigError(f"{path}, id: '{document['id']}'; expected '{name}' as the folder.")
    unknown = set(document.get("emg", {"trials": {}})["trials"]) - set(document["trials"])
    if unknown:
        raise ConfigError(
            f"{path}, emg.trials: {', '.join(sorted(unknown))}; expected names of its trials: "
            f"{', '.join(document['trials'])}. Correct the name, or add the recorded motion."
        )
    return document


def common_load(file: Path, loads_kg: Mapping[str, float]) -> float:
    """What the hand holds in trials that are followed in one motion [kg].

    Parameters
    ----------
    file : of the participant; loads_kg : by trial

    Raises
    ------
    ConfigError                      they differ
    """
    if len(set(loads_kg.values())) != 1:
        held = ", ".join(f"{trial} {load:g}" for trial, load in loads_kg.items())
        raise ConfigError(
            f"{file}, hand_load_kg: {held}; expected one load in trials that are followed in one "
            "motion. Correct them, or choose others in key 'planes' (--trials of scapulohumeral "
            "study)"
        )
    return next(iter(loads_kg.values()))
