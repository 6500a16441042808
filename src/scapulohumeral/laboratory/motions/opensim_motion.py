"""Motions of other OpenSim models, as inverse kinematics makes them, to landmarks of a trial.

Landmarks are markers of that model or points of its bodies, named by a map. From there on a motion
is a recording of markers without gaps.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.errors import DataError, ModelError, absent
from scapulohumeral.laboratory.markers.frames import HUMERUS, THORAX
from scapulohumeral.laboratory.markers.landmarks import Landmarks
from scapulohumeral.laboratory.markers.map_file import AXES, closed, read_map
from scapulohumeral.laboratory.markers.marker_map import LANDMARKS
from scapulohumeral.model.csv_table import uniform_rate

PROCESS = "scapulohumeral.laboratory.motions.opensim_process"
_PLACE = {
    "oneOf": [
        {"type": "string", "minLength": 1},
        closed(
            {
                "body": {"type": "string", "minLength": 1},
                "location_m": {
                    "type": "array",
                    "items": {"type": "number", "minimum": -2, "maximum": 2},
                    "minItems": 3,
                    "maxItems": 3,
                },
            },
            "a marker of the model, or {body: NAME, location_m: [x, y, z]}",
            "body",
            "location_m",
        ),
    ],
    "description": "a marker of the model, or {body: NAME, location_m: [x, y, z]}",
}
MODEL_MAP_SCHEMA = closed(
    {
        "schema": {"const": "model_map/1"},
        "side": {"enum": ["right", "left"], "description": "arm; left ones are mirrored"},
        "up": {"enum": list(AXES), "description": "axis of the model's ground that points up"},
        "landmarks": {
            "type": "object",
            "properties": dict.fromkeys(LANDMARKS, _PLACE),
            "required": [*THORAX, *HUMERUS],
            "additionalProperties": False,
            "description": "landmark: place; landmarks are " + ", ".join(LANDMARKS),
        },
    },
    "keys schema, side, landmarks, optionally up (else +y)",
    "schema",
    "side",
    "landmarks",
)


@dataclass(frozen=True)
class ModelMap:
    """Landmarks of another model: names of its markers, or bodies with places in them [m]."""

    path: Path
    side: str
    up: str
    landmarks: Mapping[str, Any]


def read_model_map(path: Path) -> ModelMap:
    """Read and check the map of a model.

    Raises
    ------
    ConfigError                      names file, key, what was expected, and the remedy
    """
    document = read_map(path, MODEL_MAP_SCHEMA)
    return ModelMap(path, document["side"], document.get("up", "+y"), document["landmarks"])


def read_motions(
    files: Sequence[Path], model: Path, model_map: ModelMap
) -> list[Landmarks | DataError]:
    """Landmarks of motions, or why a motion cannot be used.

    Parameters
    ----------
    files : .mot or .sto
    model : .osim that they were made with
    model_map : ModelMap

    Raises
    ------
    ModelError                       the model cannot be read, or lacks a landmark
    """
    if not model.is_file():
        raise ModelError(f"{model}: {absent(model)}. Name the model that the motions belong to.")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        request = {
            "model": str(model.resolve()),
            "motions": [str(file.resolve()) for file in files],
            "landmarks": dict(model_map.landmarks),
        }
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        command = [sys.executable, "-m", PROCESS, name]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            last = done.stderr.strip().splitlines()
            raise ModelError(last[-1] if last else f"{model}: OpenSim stopped without a word.")
        return [_motion(file, folder / f"{i}.npz", model_map) for i, file in enumerate(files)]


def _motion(file: Path, found: Path, model_map: ModelMap) -> Landmarks | DataError:
    with np.load(found, allow_pickle=False) as arrays:
        if "refusal" in arrays:
            return DataError(str(arrays["refusal"]))
        time = arrays["time_s"]
        points = {name: arrays[name] for name in model_map.landmarks}
        missing = tuple(arrays["missing"].tolist())
    try:
        rate = uniform_rate(file, "time", time, first_row=1)
    except DataError as error:
        return error
    up = np.eye(3)["xyz".index(model_map.up[1])] * (-1.0 if model_map.up[0] == "-" else 1.0)
    if model_map.side == "left":
        sign = np.ones(3)
        sign[0 if up[0] == 0.0 else 1] = -1.0
        points = {name: point * sign for name, point in points.items()}
    # The times of the motion may be rounded ones.
    time = time[0] + np.arange(len(time)) / rate
    return Landmarks(file, time, rate, 1, points, up, "m", (), "landmark GH of the model", missing)
