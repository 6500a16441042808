"""Bony landmarks over time, from the markers of a recording and the map of a laboratory.

Letters: T frames.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ConfigError, DataError, absent
from scapulohumeral.laboratory.markers.clusters import Carried, Template, carry, read_template
from scapulohumeral.laboratory.markers.files import Markers, read_markers
from scapulohumeral.laboratory.markers.frames import SCAPULA, scapula_frame, thorax_frame
from scapulohumeral.laboratory.markers.gaps import Gap, fill_gaps
from scapulohumeral.laboratory.markers.glenohumeral import (
    Centre,
    fit_centre,
    meskers_centre,
    model_centre,
)
from scapulohumeral.laboratory.markers.marker_map import MarkerMap
from scapulohumeral.model.rotations import Array
from scapulohumeral.model.tables import ModelTables

# Distance of IJ and C7 from children to the largest adults: beyond, the unit is not what it says.
CHEST_DEPTH_M = (0.05, 0.5)
# Landmarks that no joint angle needs: without them the picture shows less.
ONLY_DRAWN = ("RS",)


@dataclass(frozen=True, eq=False)
class Landmarks:
    """Landmarks of a right arm, left ones mirrored.

    Attributes
    ----------
    source : file
    time_s : (T,)
    rate_hz : frames per second
    first_frame : its number in the file; 1 where the format has none
    points : landmark -> (T, 3) [m], laboratory axes
    up : (3,) unit vector, or None if nothing says where up is
    unit : of lengths in the file
    gaps : filled gaps of markers
    centre : how the glenohumeral centre was found, in words
    missing : coordinates that a motion of an OpenSim model does not hold
    clusters : cluster -> what it carried
    """

    source: Path
    time_s: Array
    rate_hz: float
    first_frame: int
    points: Mapping[str, Array]
    up: Array | None
    unit: str
    gaps: tuple[Gap, ...]
    centre: str
    missing: tuple[str, ...] = ()
    clusters: Mapping[str, Carried] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Calibration:
    """What a map and its calibrating trials say once, for all recordings of a session.

    Attributes
    ----------
    marker_map, tables
    templates : of the clusters
    centre : fitted glenohumeral centre in scapula axes from AA, or None
    """

    marker_map: MarkerMap
    tables: ModelTables
    templates: tuple[Template, ...]
    centre: Centre | None


def calibrate(marker_map: MarkerMap, tables: ModelTables) -> Calibration:
    """Read the static trial of clusters and the trial of a functional centre, where there are any.

    Raises
    ------
    DataError                        one of them is missing or cannot be used
    """
    templates: tuple[Template, ...] = ()
    if marker_map.clusters and marker_map.static is not None:
        static = _read(marker_map.static, "static")
        templates = tuple(
            read_template(one, marker_map.landmarks, static) for one in marker_map.clusters
        )
    calibration = Calibration(marker_map, tables, templates, None)
    if marker_map.functional_trial is None:
        return calibration
    return Calibration(marker_map, tables, templates, _functional(calibration))


def _read(path: Path, key: str) -> Markers:
    if not path.is_file():
        raise DataError(
            f"{path}: {absent(path)}; the marker map names it under {key}. Correct the name, which "
            "counts from the folder of the map."
        )
    return read_markers(path)


def read_landmarks(path: Path, calibration: Calibration, posture: bool = False) -> Landmarks:
    """Landmarks of a recording, without GH if nothing gives it.

    Parameters
    ----------
    path : recording; calibration : of its session
    posture : whether one frame is enough

    Raises
    ------
    DataError                        a missing marker, a gap that cannot be filled, a wrong unit, an
                                     arm on the other side, landmarks on a line, or one frame; names
                                     file, marker, frame
    """
    markers = read_markers(path)
    if len(markers.points_m) < 2 and not posture:
        raise DataError(
            f"{path}: one frame, which is a posture and no motion; expected at least two. "
            "Export the whole recording, or name this one under static in the marker map."
        )
    points, gaps, clusters = _bony_points(markers, calibration)
    _check_size(markers, points)
    if calibration.marker_map.side == "left":
        points, up = _mirrored(points, _up(markers, calibration.marker_map))
    else:
        up = _up(markers, calibration.marker_map)
    try:
        thorax = thorax_frame(points, markers.first_frame)
        words = _add_centre(points, calibration, markers.first_frame)
    except DataError as error:
        raise DataError(f"{path}, {error}") from error
    _check_side(markers, calibration.marker_map, points, thorax)
    return Landmarks(
        source=path,
        time_s=markers.time_s,
        rate_hz=markers.rate_hz,
        first_frame=markers.first_frame,
        points=points,
        up=up,
        unit=markers.unit,
        gaps=gaps,
        centre=words,
        clusters=clusters,
    )


def _bony_points(
    markers: Markers, calibration: Calibration
) -> tuple[dict[str, Array], tuple[Gap, ...], dict[str, Carried]]:
    """Landmarks by markers of their own or by clusters, filled gaps, and what clusters carried."""
    filled: dict[str, Array] = {}
    gaps: list[Gap] = []

    def track(label: str) -> Array:
        if label not in filled:
            filled[label], found = fill_gaps(
                markers.source, label, markers.track(label), markers.rate_hz, markers.first_frame
            )
            gaps.extend(found)
        return filled[label]

    clusters = {one.name: carry(one, markers, track) for one in calibration.templates}
    carried = {name: p for one in clusters.values() for name, p in one.landmarks.items()}
    points: dict[str, Array] = {}
    needed_by = {"GH": "marker", "PC": "meskers"}
    for name, labels in calibration.marker_map.landmarks.items():
        if needed_by.get(name, calibration.marker_map.method) != calibration.marker_map.method:
            continue
        if name in carried:
            points[name] = carried[name]
            continue
        try:
            points[name] = _mean([track(label) for label in labels])
        except DataError:
            if name not in ONLY_DRAWN:
                raise
    return points, tuple(gaps), clusters


def _mean(tracks: Sequence[Array]) -> Array:
    return np.mean(tracks, axis=0)


def _check_size(markers: Markers, points: Mapping[str, Array]) -> None:
    depth = float(np.median(np.linalg.norm(points["IJ"] - points["C7"], axis=1)))
    low, high = CHEST_DEPTH_M
    if not low <= depth <= high:
        raise DataError(
            f"{markers.source}: IJ and C7 are {depth:g} m apart with the unit '{markers.unit}' of "
            f"the file; expected {low} to {high} m. Correct the unit in the file, or the map."
        )


def _up(markers: Markers, marker_map: MarkerMap) -> Array | None:
    text = marker_map.up or markers.up
    if text is None or len(text) != 2 or text[1] not in "xyz":
        return None
    return np.eye(3)["xyz".index(text[1])] * (-1.0 if text[0] == "-" else 1.0)


def _mirrored(
    points: Mapping[str, Array], up: Array | None
) -> tuple[dict[str, Array], Array | None]:
    """A left arm as a right one, mirrored at a plane that contains the vertical."""
    axis = 0 if up is None or up[0] == 0.0 else 1
    sign = np.ones(3)
    sign[axis] = -1.0
    return {name: point * sign for name, point in points.items()}, up


def _check_side(
    markers: Markers, marker_map: MarkerMap, points: Mapping[str, Array], thorax: Array
) -> None:
    """Refuse an arm that lies to the left of the thorax (T, 3, 3), once left arms are mirrored."""
    arm = _mean([points[name] for name in ("EL", "EM", *SCAPULA) if name in points])
    sideways = np.einsum("ti,ti->t", arm - points["IJ"], thorax[:, :, 0])
    if float(np.median(sideways)) < 0.0:
        other = {"right": "left", "left": "right"}[marker_map.side]
        raise DataError(
            f"{markers.source}: the arm lies {-1e3 * float(np.median(sideways)):.0f} mm to the "
            f"other side of the thorax than side: {marker_map.side} says. Write side: {other} in "
            "the marker map; if the side is right, look for swapped markers IJ, C7 or PX, T8."
        )


def _functional(calibration: Calibration) -> Centre:
    marker_map = calibration.marker_map
    path = marker_map.functional_trial
    if path is None:
        raise ConfigError(f"{marker_map.path}, glenohumeral.trial: missing. Name a recording.")
    markers = _read(path, "glenohumeral.trial")
    points, _, _ = _bony_points(markers, calibration)
    labels = marker_map.functional_markers
    tracks = {label: markers.points_m[:, markers.column(label)] for label in labels}
    tracks = tracks or {name: points[name] for name in ("EL", "EM")}
    if marker_map.side == "left":
        points = _mirrored(points, _up(markers, marker_map))[0]
        tracks = _mirrored(tracks, _up(markers, marker_map))[0]
    try:
        scapula = scapula_frame(points, markers.first_frame)
    except DataError as error:
        raise DataError(f"{path}, {error}") from error
    local = [np.einsum("tji,tj->ti", scapula, p - points["AA"]) for p in tracks.values()]
    seen = [p[np.isfinite(p).all(axis=1)] for p in local]
    unseen = [name for name, track in zip(tracks, seen, strict=True) if not len(track)]
    if unseen:
        raise DataError(
            f"{path}: {', '.join(unseen)} seen in no frame together with the scapula; expected "
            "them in glenohumeral.trial. Name other markers, or another trial."
        )
    return fit_centre(str(path), seen, tuple(tracks))


def _add_centre(points: dict[str, Array], calibration: Calibration, first_frame: int) -> str:
    """Put GH into the landmarks; returns how it was found, in words."""
    method = calibration.marker_map.method
    if method == "meskers":
        points["GH"] = meskers_centre(points)
        return "regression on AC, AA, TS, AI and PC (Meskers et al. 1998)"
    if method == "model":
        scapula = scapula_frame(points, first_frame)
        points["GH"] = model_centre(calibration.tables, points, scapula)
        return "centre of the model's scapula, scaled to the length from TS to AA"
    if calibration.centre is not None:
        centre = calibration.centre
        points["GH"] = points["AA"] + scapula_frame(points, first_frame) @ centre.position_m
        place = ", ".join(f"{1e3 * v:.1f}" for v in centre.position_m)
        fit = f"fit of spheres, {1e3 * centre.residual_m:.1f} mm RMS"
        return f"{fit}: ({place}) mm from AA in scapula axes"
    return "marker"
