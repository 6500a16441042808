"""A participant of the study with one elevation, recorded as a test says."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from places import REPOSITORY

from scapulohumeral.model.motion import ANGLE_COLUMNS

STEP_S = 0.02


def write_participant(
    folder: Path, angles: np.ndarray, step_s: float = STEP_S, **entry: Any
) -> Path:
    """Write participant.yaml and the joint angles (T, 10) [rad] of its only trial.

    `step_s`: time between frames; `entry`: further keys of the trial.
    """
    source = REPOSITORY / "config" / "participants" / "par2" / "participant.yaml"
    document = yaml.safe_load(source.read_text(encoding="utf-8"))
    trial = {"file": "frontal.csv", "hand_load_kg": 0.0, "published": None}
    document |= {"trials": {"frontal": trial | entry}, "published_predictions": {}}
    path = folder / "par2" / "participant.yaml"
    path.parent.mkdir(exist_ok=True)
    path.write_text(yaml.safe_dump(document), encoding="utf-8")
    table = np.column_stack([step_s * np.arange(len(angles)), np.rad2deg(angles)])
    header = ",".join(("time_s", *ANGLE_COLUMNS))
    np.savetxt(path.with_name("frontal.csv"), table, delimiter=",", header=header, comments="")
    return path
