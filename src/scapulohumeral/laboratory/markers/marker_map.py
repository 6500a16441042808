"""Which markers stand for which bony landmarks: the map that a laboratory writes once, as YAML."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from scapulohumeral.errors import ConfigError
from scapulohumeral.laboratory.markers.frames import HUMERUS, SCAPULA, THORAX
from scapulohumeral.laboratory.markers.map_file import AXES, closed, read_map

OPTIONAL_LANDMARKS = ("SC", "AC", "US", "RS", "PC")
LANDMARKS = (*THORAX, *SCAPULA, *HUMERUS, *OPTIONAL_LANDMARKS)
METHODS = ("marker", "meskers", "model", "functional")
_LABEL = {"type": "string", "minLength": 1}
_LABELS = {"type": "array", "items": _LABEL, "minItems": 1, "uniqueItems": True}
MAP_SCHEMA = closed(
    {
        "schema": {"const": "marker_map/1", "description": "schema: marker_map/1"},
        "side": {"enum": ["right", "left"], "description": "arm; left ones are mirrored"},
        "up": {"enum": list(AXES), "description": "axis of the laboratory that points up"},
        "landmarks": {
            "type": "object",
            "properties": {name: {"oneOf": [_LABEL, _LABELS]} for name in LANDMARKS},
            "required": [*THORAX, "EL", "EM"],
            "additionalProperties": False,
            "description": "landmark: marker, or landmark: [markers] for their mean; landmarks are "
            + ", ".join(LANDMARKS),
        },
        "glenohumeral": closed(
            {
                "method": {"enum": list(METHODS)},
                "trial": {**_LABEL, "description": "recording of a wide arm motion"},
                "markers": {**_LABELS, "description": "markers on the upper arm"},
            },
            "how the centre of the humeral head is found: {method: marker} (landmark GH), "
            "{method: meskers} (landmarks AC, AA, TS, AI, PC), {method: model} (AA, TS, AI), or "
            "{method: functional, trial: FILE, markers: [...]}",
            "method",
        ),
        "static": {**_LABEL, "description": "recording that calibrates clusters"},
        "clusters": {
            "type": "object",
            "additionalProperties": closed(
                {
                    "markers": {**_LABELS, "minItems": 3},
                    "landmarks": {
                        "type": "array",
                        "items": {"enum": list(LANDMARKS)},
                        "minItems": 1,
                    },
                },
                "{markers: [three or more], landmarks: [those that it carries]}",
                "markers",
                "landmarks",
            ),
            "description": "technical clusters by name",
        },
    },
    "keys schema, side, landmarks, glenohumeral, optionally up, static, clusters",
    "schema",
    "side",
    "landmarks",
    "glenohumeral",
)


@dataclass(frozen=True)
class Cluster:
    """Markers that move as one body, and landmarks whose place in it a static trial gives."""

    name: str
    markers: tuple[str, ...]
    landmarks: tuple[str, ...]


@dataclass(frozen=True)
class MarkerMap:
    """Markers of landmarks.

    Attributes
    ----------
    path : file that it was read from
    side : "right" or "left"
    up : laboratory axis that points up, or None: as the recording says
    landmarks : landmark -> markers whose mean it is
    method : how the glenohumeral centre is found, one of `METHODS`
    functional_trial : recording for the method "functional", else None
    functional_markers : its markers on the upper arm
    static : recording that calibrates clusters, or None
    clusters : technical clusters
    """

    path: Path
    side: str
    up: str | None
    landmarks: Mapping[str, tuple[str, ...]]
    method: str
    functional_trial: Path | None = None
    functional_markers: tuple[str, ...] = ()
    static: Path | None = None
    clusters: tuple[Cluster, ...] = field(default=())


def read_marker_map(path: Path) -> MarkerMap:
    """Read and check a marker map.

    Raises
    ------
    ConfigError                      names file, key, what was expected, and the remedy
    """
    document = read_map(path, MAP_SCHEMA)
    landmarks = {
        name: (markers,) if isinstance(markers, str) else tuple(markers)
        for name, markers in document["landmarks"].items()
    }
    centre = document["glenohumeral"]
    trial, static = centre.get("trial"), document.get("static")
    marker_map = MarkerMap(
        path=path,
        side=document["side"],
        up=document.get("up"),
        landmarks=landmarks,
        method=centre["method"],
        functional_trial=path.parent / trial if trial else None,
        functional_markers=tuple(centre.get("markers", ())),
        static=path.parent / static if static else None,
        clusters=tuple(
            Cluster(name, tuple(c["markers"]), tuple(c["landmarks"]))
            for name, c in document.get("clusters", {}).items()
        ),
    )
    _check_references(marker_map)
    return marker_map


def _check_references(marker_map: MarkerMap) -> None:
    path, landmarks = marker_map.path, marker_map.landmarks
    needed = {
        "marker": ("GH",),
        "meskers": ("AC", "AA", "TS", "AI", "PC"),
        "model": SCAPULA,
        "functional": SCAPULA,
    }[marker_map.method]
    missing = [name for name in needed if name not in landmarks]
    if missing:
        raise ConfigError(
            f"{path}, glenohumeral.method: {marker_map.method} needs {', '.join(needed)}; no "
            f"{', '.join(missing)} in landmarks. Map them, or choose another method."
        )
    partial = [name for name in SCAPULA if name not in landmarks]
    if 0 < len(partial) < len(SCAPULA):
        raise ConfigError(
            f"{path}, landmarks: no {', '.join(partial)}; expected all of {', '.join(SCAPULA)}, or "
            "none if the scapula is not measured. Add or remove the others."
        )
    if marker_map.method == "functional" and marker_map.functional_trial is None:
        raise ConfigError(
            f"{path}, glenohumeral.trial: missing; expected a recording of a wide arm motion."
        )
    if marker_map.clusters and marker_map.static is None:
        raise ConfigError(
            f"{path}, static: missing; expected the recording that shows clusters and landmarks "
            "together. Add static: FILE, or remove clusters."
        )
    _check_distinct(marker_map)


def _check_distinct(marker_map: MarkerMap) -> None:
    path, landmarks = marker_map.path, marker_map.landmarks
    alone: dict[tuple[str, ...], str] = {}
    for landmark, markers in landmarks.items():
        if markers in alone:
            raise ConfigError(
                f"{path}, landmarks.{landmark}: {', '.join(markers)} is also {alone[markers]}; "
                "expected another marker. Correct one of them."
            )
        alone[markers] = landmark
    carried: dict[str, str] = {}
    for cluster in marker_map.clusters:
        for name in cluster.landmarks:
            if name in carried:
                raise ConfigError(
                    f"{path}, clusters.{cluster.name}: {name} is carried by {carried[name]}, too; "
                    "expected one cluster. Remove it from the other."
                )
            carried[name] = cluster.name
        unknown = [name for name in cluster.landmarks if name not in landmarks]
        if unknown:
            raise ConfigError(
                f"{path}, clusters.{cluster.name}: {', '.join(unknown)} not in landmarks, which "
                "say where they are in the static trial. Add them there."
            )
