"""Orientations of segments over time, as inertial sensors and fluoroscopy give them, to a trial.

A table has a column of times and, per segment, a quaternion (``<name>_q0`` to ``<name>_q3``, scalar
first) or a rotation matrix (``<name>_r11`` to ``<name>_r33``, row by row); both map vectors from
the segment (or its sensor) to a frame that all segments share.

Letters: T frames.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.laboratory.markers.map_file import closed, read_map
from scapulohumeral.laboratory.trial import Segments
from scapulohumeral.model.csv_table import read_numbers, read_rows, uniform_rate
from scapulohumeral.model.motion import TIME_COLUMN
from scapulohumeral.model.rotations import Array, quaternion_to_matrix

SEGMENTS = ("thorax", "clavicle", "scapula", "humerus", "forearm")
# Columns are the axes of the model (x right, y up, z back) in those of the ISB (X front, Y up,
# Z right).
ISB_AXES = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
AXES = {"isb": ISB_AXES, "model": np.eye(3)}
# Rounded numbers of a table may leave a rotation by this much; a wrong order of columns leaves it
# by far more.
ROTATION_TOLERANCE = 0.02
# A clavicle that is turned by less about its own axis, in all frames, was not measured about it.
TURNED_RAD = np.deg2rad(0.5)
_QUATERNION = {
    "type": "array",
    "items": {"type": "number", "minimum": -1, "maximum": 1},
    "minItems": 4,
    "maxItems": 4,
}
ORIENTATION_MAP_SCHEMA = closed(
    {
        "schema": {"const": "orientation_map/1"},
        "side": {"enum": ["right", "left"], "description": "arm; left ones are mirrored"},
        "axes": {
            "enum": list(AXES),
            "description": "axes of the segments: isb (X front, Y up, Z right, of either arm) or "
            "model (x right, y up, z back). The clavicle of the ISB has a level X, so no axial "
            "rotation of its own: it gets that of DAS3, as one with landmarks does",
        },
        "segments": {
            "type": "object",
            "properties": {name: {"type": "string", "minLength": 1} for name in SEGMENTS},
            "required": ["thorax", "humerus"],
            "additionalProperties": False,
            "description": "segment: name in the columns; segments are " + ", ".join(SEGMENTS),
        },
        "sensor_in_segment": {
            "type": "object",
            "properties": dict.fromkeys(SEGMENTS, _QUATERNION),
            "additionalProperties": False,
            "description": "segment: [q0, q1, q2, q3] of its sensor in the segment; leave out "
            "where the table has the segments themselves",
        },
    },
    "keys schema, side, axes, segments, optionally sensor_in_segment",
    "schema",
    "side",
    "axes",
    "segments",
)


@dataclass(frozen=True, eq=False)
class OrientationMap:
    """Columns of segments.

    Attributes
    ----------
    path, side
    axes : (3, 3) axes of the model (columns) in those of the table's segments
    segments : segment -> name in the columns
    sensors : segment -> (3, 3) rotation from sensor to segment
    """

    path: Path
    side: str
    axes: Array
    segments: Mapping[str, str]
    sensors: Mapping[str, Array]


def read_orientation_map(path: Path) -> OrientationMap:
    """Read and check a map of orientations.

    Raises
    ------
    ConfigError                      names file, key, what was expected, and the remedy
    """
    document = read_map(path, ORIENTATION_MAP_SCHEMA)
    sensors = document.get("sensor_in_segment", {})
    _check_sensors(path, sensors, document["segments"])
    return OrientationMap(
        path=path,
        side=document["side"],
        axes=AXES[document["axes"]],
        segments=document["segments"],
        sensors={name: quaternion_to_matrix(np.array(q)) for name, q in sensors.items()},
    )


def _check_sensors(
    path: Path, sensors: Mapping[str, list[float]], segments: Mapping[str, str]
) -> None:
    """Refuse sensors of segments that are not read, and quaternions that are no rotation."""
    for name, quaternion in sensors.items():
        place = f"{path}, sensor_in_segment.{name}"
        if name not in segments:
            raise ConfigError(
                f"{place}: no such segment in segments; expected {', '.join(segments)}. Add its "
                "name in the columns, or leave the sensor out."
            )
        length = float(np.linalg.norm(quaternion))
        if abs(length - 1.0) > ROTATION_TOLERANCE:
            raise ConfigError(
                f"{place}: {quaternion} has length {length:.3g}; expected a quaternion of length "
                "one, scalar first. Correct the numbers."
            )


def read_orientations(path: Path, orientation_map: OrientationMap) -> Segments:
    """Segments of a table of orientations.

    The elbow angle comes from the direction of the forearm, whose y axis points from US to the
    elbow.

    Raises
    ------
    DataError                        a missing column, no number, uneven time, or columns that are
                                     no rotation; names file, row and column
    """
    header = tuple(read_rows(path, (TIME_COLUMN,))[0])
    time = read_numbers(path, (TIME_COLUMN,))[:, 0]
    rate = uniform_rate(path, TIME_COLUMN, time)
    laboratory = {
        segment: _rotation(path, header, name)
        @ orientation_map.sensors.get(segment, np.eye(3)).T
        @ orientation_map.axes
        for segment, name in orientation_map.segments.items()
    }
    thorax = laboratory["thorax"]
    inside = {name: thorax.swapaxes(1, 2) @ matrix for name, matrix in laboratory.items()}
    if orientation_map.side == "left":
        mirror = np.diag([-1.0, 1.0, 1.0])
        inside = {name: mirror @ matrix @ mirror for name, matrix in inside.items()}
    _check_side(path, inside.get("scapula"), orientation_map.side)
    clavicle = inside.get("clavicle")
    return Segments(
        # The times of the table may be rounded ones.
        time_s=time[0] + np.arange(len(time)) / rate,
        rate_hz=rate,
        thorax=thorax,
        clavicle=None if clavicle is None else clavicle[:, :, 0],
        clavicle_turned=clavicle if _is_turned(clavicle) else None,
        scapula=inside.get("scapula"),
        humerus=inside["humerus"],
        forearm=-inside["forearm"][:, :, 1] if "forearm" in inside else None,
    )


def _check_side(path: Path, scapula: Array | None, side: str) -> None:
    """Refuse a scapula (T, 3, 3) of the other arm, once left ones are mirrored.

    The x axis of a right scapula, along its spine, points to the right and forward (-z).

    Raises
    ------
    DataError                        names the side that would do
    """
    if scapula is not None and float(np.median(scapula[:, 2, 0])) > 0.0:
        other = {"right": "left", "left": "right"}[side]
        raise DataError(
            f"{path}: the spine of the scapula does not point forward, but to the back, as that of "
            f"the other arm does; side: {side} says otherwise. Write side: {other} in the map; if "
            "the side is right, correct axes or sensors of the scapula."
        )


def _is_turned(clavicle: Array | None) -> bool:
    """Whether the axial rotation of a clavicle (T, 3, 3) in the thorax was recorded.

    Wu et al. 2005 put one axis of the clavicle square to the vertical axis of the thorax, since two
    landmarks do not tell its axial rotation.
    """
    return clavicle is not None and bool(np.any(np.abs(clavicle[:, 1, 2]) > np.sin(TURNED_RAD)))


def _rotation(path: Path, header: tuple[str, ...], name: str) -> Array:
    """Rotation matrices (T, 3, 3) of a name in the columns."""
    quaternion = [f"{name}_q{i}" for i in range(4)]
    matrix = [f"{name}_r{i}{j}" for i in (1, 2, 3) for j in (1, 2, 3)]
    if all(column in header for column in matrix):
        found = read_numbers(path, matrix).reshape(-1, 3, 3)
        product = found @ found.swapaxes(1, 2)
        error = np.abs(product - np.eye(3)).max(axis=(1, 2))
        error = np.where(np.linalg.det(found) > 0.0, error, np.inf)
        _check_rotation(path, f"{name}_r11 to {name}_r33", error)
        left, _, right = np.linalg.svd(found)
        return np.asarray(left @ right)
    if not all(column in header for column in quaternion):
        raise DataError(
            f"{path}, row 1: no columns of '{name}'; expected {quaternion[0]} to {quaternion[3]}, "
            f"or {matrix[0]} to {matrix[-1]}; found {', '.join(header)}. Correct the map."
        )
    found = read_numbers(path, quaternion)
    _check_rotation(path, f"{name}_q0 to {name}_q3", np.abs(np.linalg.norm(found, axis=1) - 1.0))
    return quaternion_to_matrix(found)


def _check_rotation(path: Path, columns: str, error: Array) -> None:
    wrong = np.flatnonzero(error > ROTATION_TOLERANCE)
    if wrong.size:
        raise DataError(
            f"{path}, row {wrong[0] + 2}, columns {columns}: no rotation (off by "
            f"{error[wrong[0]]:.3g}); expected quaternions of length one, or right-handed matrices "
            "row by row. Check order and sign of the columns."
        )
