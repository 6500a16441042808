"""The file ``participant.yaml``, read and checked without any recorded motion."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

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
    document = _document(path)
    if document["id"] != name:
        raise ConfigError(f"{path}, id: '{document['id']}'; expected '{name}' as the folder.")
    unknown = set(document.get("emg", {"trials": {}})["trials"]) - set(document["trials"])
    if unknown:
        raise ConfigError(
            f"{path}, emg.trials: {', '.join(sorted(unknown))}; expected names of its trials: "
            f"{', '.join(document['trials'])}. Correct the name, or add the recorded motion."
        )
    return document


def _document(path: Path) -> dict[str, Any]:
    try:
        document = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: not valid YAML: {error}. Correct the line named.") from error
    fault = best_match(Draft202012Validator(PARTICIPANT_SCHEMA).iter_errors(document))
    if fault is not None:
        place = ".".join(str(part) for part in fault.absolute_path) or "top level"
        hint = fault.schema.get("description", "see the comments in the other participants' files")
        raise ConfigError(f"{path}, {place}: {fault.message}; expected: {hint}. Correct the entry.")
    return document
