"""Places of landmarks in a motion of an OpenSim model, found in a process of its own.

``python -m scapulohumeral.laboratory.motions.opensim_process FOLDER`` reads
``FOLDER/request.json`` (model, motions, landmarks) and writes ``FOLDER/<number>.npz`` per motion.
opensim and casadi cannot share a process.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import opensim

from scapulohumeral.errors import REFUSED, DataError, ModelError, absent

SUFFIXES = (".mot", ".sto")


def run(folder: Path) -> None:
    """Write times, landmarks and refusals of all motions of a request.

    Raises
    ------
    ModelError                       the model cannot be read, or lacks a landmark
    """
    request = json.loads((folder / "request.json").read_text(encoding="utf-8"))
    opensim.Logger.setLevelString("Error")
    path = request["model"]
    try:
        model = opensim.Model(path)
        model.initSystem()
    except RuntimeError as error:
        raise ModelError(f"{path}: {_unreadable(error)} Correct the model.") from error
    stations = {
        name: station(model, path, name, place) for name, place in request["landmarks"].items()
    }
    for number, motion in enumerate(request["motions"]):
        try:
            # Coordinates that a motion lacks have the default of the model, not what the motion
            # before left.
            state = model.initSystem()
            arrays: dict[str, Any] = landmarks_over_time(model, state, Path(motion), stations)
        except DataError as error:
            arrays = {"refusal": np.array(str(error))}
        np.savez(folder / f"{number}.npz", **arrays)


def station(model: opensim.Model, path: str, name: str, place: Any) -> tuple[Any, opensim.Vec3]:
    """Frame and place in it [m] of a landmark: a marker of the model, or a point of a body.

    Raises
    ------
    ModelError                       no such marker or body
    """
    if isinstance(place, Mapping):
        bodies = model.getBodySet()
        if not bodies.contains(place["body"]):
            found = ", ".join(bodies.get(i).getName() for i in range(bodies.getSize()))
            raise ModelError(
                f"{path}: no body '{place['body']}' for {name}; found {found}. Correct the map."
            )
        return bodies.get(place["body"]), opensim.Vec3(*place["location_m"])
    markers = model.getMarkerSet()
    if not markers.contains(place):
        found = ", ".join(markers.get(i).getName() for i in range(markers.getSize())) or "none"
        raise ModelError(
            f"{path}: no marker '{place}' for {name}; found {found}. Correct the map, or write "
            f"{name}: {{body: ..., location_m: [x, y, z]}}."
        )
    marker = markers.get(place)
    return marker.getParentFrame(), marker.get_location()


def landmarks_over_time(
    model: opensim.Model,
    state: opensim.State,
    motion: Path,
    stations: Mapping[str, tuple[Any, opensim.Vec3]],
) -> dict[str, np.ndarray]:
    """Times (T,), landmarks (T, 3) [m] in ground, and coordinates that the motion does not hold.

    Raises
    ------
    DataError                        the motion cannot be read, or moves nothing of the model
    """
    if not motion.is_file():
        raise DataError(f"{motion}: {absent(motion)}. Check the name.")
    if motion.suffix.lower() not in SUFFIXES:
        raise DataError(
            f"{motion}: '{motion.suffix}'; expected {' or '.join(SUFFIXES)}, since the map is one "
            "of a model. Name a motion, or the map of what the file holds."
        )
    try:
        table = opensim.TimeSeriesTable(str(motion))
    except RuntimeError as error:
        raise DataError(f"{motion}: {_unreadable(error)} Export it again.") from error
    columns = _coordinates(model, table, motion)
    if _in_degrees(table, motion):
        model.getSimbodyEngine().convertDegreesToRadians(table)
    values = {c: table.getDependentColumn(label).to_numpy() for c, label in columns.items()}
    time = np.array(table.getIndependentColumn())
    for name, track in values.items():
        bad = np.flatnonzero(~np.isfinite(track))
        if bad.size:
            raise DataError(f"{motion}, data row {bad[0] + 1}, {name}: no number. Fill the gap.")
    points = {name: np.empty((len(time), 3)) for name in stations}
    for i in range(len(time)):
        _pose(model, state, {name: track[i] for name, track in values.items()})
        for name, (frame, place) in stations.items():
            points[name][i] = frame.findStationLocationInGround(state, place).to_numpy()
    every = [c.getName() for c in model.getComponentsList() if _is_coordinate(c)]
    missing = np.array([name for name in every if name not in columns])
    return {"time_s": time, "missing": missing, **points}


def _unreadable(error: RuntimeError) -> str:
    """What OpenSim says in several lines, in one: of messages only the last line is passed on."""
    return f"OpenSim cannot read it: {' '.join(str(error).split())}."


def _is_coordinate(component: Any) -> bool:
    return str(component.getConcreteClassName()) == "Coordinate"


def _coordinates(
    model: opensim.Model, table: opensim.TimeSeriesTable, motion: Path
) -> dict[str, str]:
    """Coordinates of the model -> columns of the motion, by name or by path of the state."""
    known = model.getCoordinateSet()
    found = {}
    for label in table.getColumnLabels():
        parts = label.split("/")
        name = parts[-2] if parts[-1] == "value" and len(parts) > 1 else label
        if known.contains(name):
            found[name] = label
    if not found:
        names = ", ".join(known.get(i).getName() for i in range(known.getSize()))
        raise DataError(
            f"{motion}: columns {', '.join(table.getColumnLabels())}; expected coordinates of the "
            f"model: {names}. Name the model that the motion was made with."
        )
    return found


def _in_degrees(table: opensim.TimeSeriesTable, motion: Path) -> bool:
    if not table.hasTableMetaDataKey("inDegrees"):
        raise DataError(f"{motion}, header: no inDegrees; write inDegrees=yes or inDegrees=no.")
    return str(table.getTableMetaDataAsString("inDegrees")).strip().lower() == "yes"


def _pose(model: opensim.Model, state: opensim.State, values: Mapping[str, float]) -> None:
    """Put the model where the motion says; constraints are taken as the motion fulfils them."""
    coordinates = model.getCoordinateSet()
    for name, value in values.items():
        coordinate = coordinates.get(name)
        if coordinate.getLocked(state):
            coordinate.setLocked(state, False)
        coordinate.setValue(state, float(value), False)
    model.realizePosition(state)


if __name__ == "__main__":
    try:
        run(Path(sys.argv[1]))
    except (DataError, ModelError) as error:
        print(error, file=sys.stderr)
        sys.exit(REFUSED)
