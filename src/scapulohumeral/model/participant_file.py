"""The file ``participant.yaml``, read and checked without any recorded motion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.documents import check_schema, read_yaml
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.participant_schema import PARTICIPANT_SCHEMA

GRAVITY_MPS2 = 9.80665
# Gravity on the ground is 9.76 to 9.83 m/s^2; rounded values are within this share as well.
GRAVITY_TOLERANCE = 0.02


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
    check_gravity(path, document["gravity_in_thorax_mps2"])
    return document


def check_gravity(path: Path, gravity: Sequence[float]) -> None:
    """Refuse gravity of no place on earth, or that points up in the thorax.

    Lying is allowed, hanging upside down is not: upwards means a wrong sign or another vertical
    axis than y.

    Parameters
    ----------
    path : of the file; gravity : (3,) in axes of the thorax [m/s^2]

    Raises
    ------
    ConfigError                      names the file, what was expected, and the remedy
    """
    size = float(np.linalg.norm(gravity))
    if abs(size / GRAVITY_MPS2 - 1.0) > GRAVITY_TOLERANCE:
        raise ConfigError(
            f"{path}, gravity_in_thorax_mps2: {list(gravity)} has length {size:.3f}; expected "
            f"{GRAVITY_MPS2} within {GRAVITY_TOLERANCE:.0%}. Write m/s^2, in axes of the thorax."
        )
    if gravity[1] > 0.0:
        raise ConfigError(
            f"{path}, gravity_in_thorax_mps2: {list(gravity)} points up; expected a second "
            "component of 0 or less, as y of the thorax is up. Change the sign, or the axes."
        )


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
