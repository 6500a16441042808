"""The model as tables: reading and validation of ``config/model``.

Lengths in m, angles in rad, masses in kg, forces in N, all in the axes of the named segment.
Axes of the thorax: x to the right, y up, z to the back. ``config/model/README.md`` describes every
column and its source.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from scapulohumeral.errors import ModelError
from scapulohumeral.model.constants import Constants, read_constants
from scapulohumeral.model.csv_table import Row, number, read_rows

Vector = tuple[float, ...]

GROUND = "ground"
PATH_POINTS, PATH_WRAPS, WRAP_OBJECTS = "path_points.csv", "path_wraps.csv", "wrap_objects.csv"
WRAP_DIMENSIONS = {
    "ellipsoid": ("radius_x_m", "radius_y_m", "radius_z_m"),
    "sphere": ("radius_m",),
    "cylinder": ("radius_m", "length_m"),
}
# A path that may wrap as a whole.
NO_LIMIT = -1
POSITIVE_COLUMNS = (
    "max_isometric_force_N",
    "optimal_fibre_length_m",
    "tendon_slack_length_m",
    "activation_time_s",
    "deactivation_time_s",
)
INERTIA_COLUMNS = tuple(f"inertia_{axes}_kgm2" for axes in ("xx", "yy", "zz", "xy", "xz", "yz"))


@dataclass(frozen=True)
class Segment:
    """A body; inertia (xx, yy, zz, xy, xz, yz) about the mass centre; massless if intermediate."""

    name: str
    mass_kg: float
    com_m: Vector
    inertia_kgm2: Vector


@dataclass(frozen=True)
class Joint:
    """A joint: "rotation" about the axes of its coordinates, or "weld".

    The parent frame of the joint sits at `location_m` in the parent, turned by `orientation_rad`
    (body-fixed x-y-z, as OpenSim has them); the child frame is the frame of the child segment.
    """

    name: str
    kind: str
    parent: str
    child: str
    location_m: Vector
    orientation_rad: Vector


@dataclass(frozen=True)
class Coordinate:
    """A rotation about `axis`, in the parent frame of its joint."""

    name: str
    joint: str
    axis: Vector
    default_rad: float
    min_rad: float
    max_rad: float


@dataclass(frozen=True)
class WrapObject:
    """A wrapping surface; `dimensions_m` in the order of ``WRAP_DIMENSIONS[kind]``."""

    name: str
    kind: str
    segment: str
    translation_m: Vector
    rotation_rad: Vector
    quadrant: str
    dimensions_m: Vector


@dataclass(frozen=True)
class Point:
    """A point fixed in a segment: a path point or a marker."""

    segment: str
    location_m: Vector


@dataclass(frozen=True)
class PathWrap:
    """Use of a wrap object by a muscle, between two of its path points (-1: no limit)."""

    wrap_object: str
    method: str
    first_point: int
    last_point: int


@dataclass(frozen=True)
class Muscle:
    """A muscle element with its path."""

    name: str
    group: str
    max_isometric_force_N: float
    optimal_fibre_length_m: float
    tendon_slack_length_m: float
    pennation_rad: float
    activation_time_s: float
    deactivation_time_s: float
    points: tuple[Point, ...]
    wraps: tuple[PathWrap, ...]


@dataclass(frozen=True)
class Fibre:
    """Optimal length and strength of a muscle element."""

    optimal_fibre_length_m: float
    max_isometric_force_N: float


@dataclass(frozen=True)
class Paths:
    """Paths of some muscles, and wrapping surfaces."""

    points: Mapping[str, Sequence[Point]]
    wraps: Mapping[str, Sequence[PathWrap]]
    wrap_objects: Mapping[str, WrapObject]


@dataclass(frozen=True)
class ModelTables:
    """All tables of the model, by name, in the order of the files.

    `constants` has the values of constants.yaml; `excluded_muscles` the reason for each muscle
    element that is left out of the simulations. `published_fibres` and `published_paths` are those
    that the authors of the paper set by hand, for the base model.
    """

    segments: Mapping[str, Segment]
    joints: Mapping[str, Joint]
    coordinates: Mapping[str, Coordinate]
    wrap_objects: Mapping[str, WrapObject]
    muscles: Mapping[str, Muscle]
    markers: Mapping[str, Point]
    published_fibres: Mapping[str, Fibre]
    published_paths: Paths
    constants: Constants
    excluded_muscles: Mapping[str, str]

    @property
    def active_muscles(self) -> tuple[str, ...]:
        """Names of the muscle elements that are simulated, in the order of the table."""
        return tuple(name for name in self.muscles if name not in self.excluded_muscles)

    @property
    def active_groups(self) -> tuple[str, ...]:
        """Names of the groups of these elements, in alphabetical order."""
        return tuple(sorted({self.muscles[name].group for name in self.active_muscles}))

    def with_published_paths(self) -> ModelTables:
        """The same tables with the paths that the authors of the paper set by hand."""
        paths = self.published_paths
        return replace(
            self,
            wrap_objects={**self.wrap_objects, **paths.wrap_objects},
            muscles={
                name: replace(
                    muscle,
                    points=tuple(paths.points.get(name, muscle.points)),
                    wraps=tuple(paths.wraps.get(name, muscle.wraps)),
                )
                for name, muscle in self.muscles.items()
            },
        )


class _Table:
    """Cells of one CSV file, with conversions that know their place."""

    def __init__(self, path: Path, key: str, columns: tuple[str, ...]) -> None:
        self.path = path
        self.key = key
        self.rows = list(enumerate(read_rows(path, (key, *columns)), start=2))

    def unique(self) -> None:
        counts = Counter(row[self.key] for _, row in self.rows)
        repeated = [name for name, count in counts.items() if count > 1]
        if repeated:
            raise ModelError(
                f"{self.path}, column {self.key}: {', '.join(repeated)} more than once. "
                "Keep one row per name."
            )

    def number(self, row: tuple[int, Row], column: str) -> float:
        return number(self.path, row[0], row[1], column)

    def numbers(self, row: tuple[int, Row], *columns: str) -> Vector:
        return tuple(self.number(row, column) for column in columns)

    def vector(self, row: tuple[int, Row], pattern: str) -> Vector:
        return self.numbers(row, *(pattern.format(axis) for axis in "xyz"))


def read_tables(directory: Path) -> ModelTables:
    """Read and validate the tables of the model.

    Parameters
    ----------
    directory : Path                 with segments.csv, joints.csv, ... and constants.yaml

    Raises
    ------
    DataError                        a file, column or cell cannot be read
    ModelError                       the tables contradict each other, or a value is unphysical
    """
    constants, excluded = read_constants(directory / "constants.yaml")
    tables = ModelTables(
        segments=_read_segments(directory / "segments.csv"),
        joints=_read_joints(directory / "joints.csv"),
        coordinates=_read_coordinates(directory / "coordinates.csv"),
        wrap_objects=_read_wrap_objects(directory / WRAP_OBJECTS),
        muscles=_read_muscles(directory),
        markers=_read_markers(directory / "markers.csv"),
        published_fibres=_read_published_fibres(directory / "published_fibres.csv"),
        published_paths=_read_paths(directory / "published_paths"),
        constants=constants,
        excluded_muscles=excluded,
    )
    _check_references(tables, directory)
    _check_wraps(tables, directory)
    _check_values(tables, directory)
    return tables


def _read_segments(path: Path) -> dict[str, Segment]:
    table = _Table(path, "segment", ("mass_kg", "com_x_m", *INERTIA_COLUMNS))
    table.unique()
    return {
        row[1]["segment"]: Segment(
            row[1]["segment"],
            table.number(row, "mass_kg"),
            table.vector(row, "com_{}_m"),
            table.numbers(row, *INERTIA_COLUMNS),
        )
        for row in table.rows
    }


def _read_joints(path: Path) -> dict[str, Joint]:
    table = _Table(path, "joint", ("type", "parent", "child", "location_x_m"))
    table.unique()
    return {
        row[1]["joint"]: Joint(
            row[1]["joint"],
            row[1]["type"],
            row[1]["parent"],
            row[1]["child"],
            table.vector(row, "location_{}_m"),
            table.vector(row, "orientation_{}_rad"),
        )
        for row in table.rows
    }


def _read_coordinates(path: Path) -> dict[str, Coordinate]:
    limits = ("default_rad", "min_rad", "max_rad")
    table = _Table(path, "coordinate", ("joint", "axis_x", "axis_y", "axis_z", *limits))
    table.unique()
    return {
        row[1]["coordinate"]: Coordinate(
            row[1]["coordinate"],
            row[1]["joint"],
            table.vector(row, "axis_{}"),
            *table.numbers(row, *limits),
        )
        for row in table.rows
    }


def _read_wrap_objects(path: Path) -> dict[str, WrapObject]:
    table = _Table(path, "wrap_object", ("type", "segment", "quadrant"))
    table.unique()
    objects = {}
    for row in table.rows:
        name, kind = row[1]["wrap_object"], row[1]["type"]
        if kind not in WRAP_DIMENSIONS:
            raise ModelError(
                f"{path}, row {row[0]}, column type: '{kind}'; "
                f"expected one of {', '.join(WRAP_DIMENSIONS)}."
            )
        objects[name] = WrapObject(
            name,
            kind,
            row[1]["segment"],
            table.vector(row, "translation_{}_m"),
            table.vector(row, "rotation_{}_rad"),
            row[1]["quadrant"],
            table.numbers(row, *WRAP_DIMENSIONS[kind]),
        )
    return objects


def _read_muscles(directory: Path) -> dict[str, Muscle]:
    quantities = (
        "max_isometric_force_N",
        "optimal_fibre_length_m",
        "tendon_slack_length_m",
        "pennation_rad",
        "activation_time_s",
        "deactivation_time_s",
    )
    table = _Table(directory / "muscles.csv", "muscle", ("group", *quantities))
    table.unique()
    points = _read_path_points(directory / PATH_POINTS)
    wraps = _read_path_wraps(directory / PATH_WRAPS)
    names = {row["muscle"] for _, row in table.rows}
    for file, paths in ((PATH_POINTS, points), (PATH_WRAPS, wraps)):
        _require(paths, names, f"{directory / file}, column muscle", "muscles.csv")
    return {
        row[1]["muscle"]: Muscle(
            name=row[1]["muscle"],
            group=row[1]["group"],
            **{quantity: table.number(row, quantity) for quantity in quantities},
            points=tuple(points.get(row[1]["muscle"], ())),
            wraps=tuple(wraps.get(row[1]["muscle"], ())),
        )
        for row in table.rows
    }


def _read_paths(directory: Path) -> Paths:
    return Paths(
        points=_read_path_points(directory / PATH_POINTS),
        wraps=_read_path_wraps(directory / PATH_WRAPS),
        wrap_objects=_read_wrap_objects(directory / WRAP_OBJECTS),
    )


def _read_path_points(path: Path) -> dict[str, list[Point]]:
    table = _Table(path, "muscle", ("point", "segment", "x_m", "y_m", "z_m"))
    points: dict[str, list[Point]] = {}
    for row in table.rows:
        path_of_muscle = points.setdefault(row[1]["muscle"], [])
        path_of_muscle.append(Point(row[1]["segment"], table.vector(row, "{}_m")))
        if table.numbers(row, "point") != (len(path_of_muscle),):
            raise ModelError(
                f"{path}, row {row[0]}, column point: {row[1]['point']}, expected "
                f"{len(path_of_muscle)}. Number the points of a muscle from origin to insertion."
            )
    return points


def _read_path_wraps(path: Path) -> dict[str, list[PathWrap]]:
    table = _Table(path, "muscle", ("wrap_object", "method", "first_point", "last_point"))
    wraps: dict[str, list[PathWrap]] = {}
    for row in table.rows:
        first, last = table.numbers(row, "first_point", "last_point")
        wrap = PathWrap(row[1]["wrap_object"], row[1]["method"], int(first), int(last))
        wraps.setdefault(row[1]["muscle"], []).append(wrap)
    return wraps


def _read_markers(path: Path) -> dict[str, Point]:
    table = _Table(path, "marker", ("segment", "x_m", "y_m", "z_m"))
    table.unique()
    return {
        row[1]["marker"]: Point(row[1]["segment"], table.vector(row, "{}_m")) for row in table.rows
    }


def _read_published_fibres(path: Path) -> dict[str, Fibre]:
    columns = ("optimal_fibre_length_m", "max_isometric_force_N")
    table = _Table(path, "muscle", columns)
    table.unique()
    return {row[1]["muscle"]: Fibre(*table.numbers(row, *columns)) for row in table.rows}


def _require(names: Any, known: Any, place: str, table: str) -> None:
    unknown = sorted(set(names) - set(known))
    if unknown:
        raise ModelError(
            f"{place}: {', '.join(unknown)} not in {table}, which has {', '.join(sorted(known))}."
        )


def _check_references(tables: ModelTables, directory: Path) -> None:
    frames = {GROUND, *tables.segments}
    segments = "segments.csv"
    muscles = tables.muscles.values()
    users = {
        "joints.csv, column parent": {joint.parent for joint in tables.joints.values()},
        "joints.csv, column child": {joint.child for joint in tables.joints.values()},
        "wrap_objects.csv, column segment": {w.segment for w in tables.wrap_objects.values()},
        "path_points.csv, column segment": {p.segment for m in muscles for p in m.points},
        "markers.csv, column segment": {marker.segment for marker in tables.markers.values()},
    }
    for place, names in users.items():
        _require(names, frames, f"{directory}/{place}", segments)
    joints = {coordinate.joint for coordinate in tables.coordinates.values()}
    _require(joints, tables.joints, f"{directory}/coordinates.csv, column joint", "joints.csv")
    wraps = {wrap.wrap_object for muscle in muscles for wrap in muscle.wraps}
    place = f"{directory}/path_wraps.csv, column wrap_object"
    _require(wraps, tables.wrap_objects, place, "wrap_objects.csv")
    place = f"{directory}/constants.yaml, excluded_muscles"
    _require(tables.excluded_muscles, tables.muscles, place, "muscles.csv")
    place = f"{directory}/published_fibres.csv, column muscle"
    _require(tables.published_fibres, tables.muscles, place, "muscles.csv")
    constants = f"{directory}/constants.yaml"
    suspending = tables.constants.fibre_adjustment.suspending_muscles
    place = f"{constants}, fibre_adjustment.suspending_muscles"
    _require(suspending, {muscle.group for muscle in muscles}, place, "muscles.csv, column group")
    touching = tables.constants.scapulothoracic_contact.points
    place = f"{constants}, scapulothoracic_contact.points"
    _require(touching, tables.markers, place, "markers.csv")
    paths, place = tables.published_paths, f"{directory}/published_paths"
    for file, edited in ((PATH_POINTS, paths.points), (PATH_WRAPS, paths.wraps)):
        _require(edited, tables.muscles, f"{place}/{file}, column muscle", "muscles.csv")
    surfaces = {**tables.wrap_objects, **paths.wrap_objects}
    used = {wrap.wrap_object for wraps in paths.wraps.values() for wrap in wraps}
    _require(used, surfaces, f"{place}/{PATH_WRAPS}, column wrap_object", WRAP_OBJECTS)
    children = Counter(joint.child for joint in tables.joints.values())
    for segment in tables.segments:
        if children[segment] != 1:
            raise ModelError(
                f"{directory}/joints.csv, column child: {segment} occurs {children[segment]} "
                "times. Each segment is the child of exactly one joint."
            )


def _check_wraps(tables: ModelTables, directory: Path) -> None:
    """Ranges of path points exist, and ellipsoids of the thorax stand as clearances assume."""
    with_published = tables.with_published_paths()
    for name, muscle in (*tables.muscles.items(), *with_published.muscles.items()):
        for wrap in muscle.wraps:
            for column in ("first_point", "last_point"):
                point, count = getattr(wrap, column), len(muscle.points)
                if point != NO_LIMIT and not 1 <= point <= count:
                    raise ModelError(
                        f"{directory}, {PATH_WRAPS}, muscle {name}, column {column}: {point}; its "
                        f"path has {count} points. Expected 1 to {count}, or {NO_LIMIT} for no "
                        "limit."
                    )
    for surface in with_published.wrap_objects.values():
        if (
            surface.kind == "ellipsoid"
            and surface.segment == "thorax"
            and any(surface.rotation_rad)
        ):
            raise ModelError(
                f"{directory}, {WRAP_OBJECTS}, wrap_object {surface.name}: turned by "
                f"{surface.rotation_rad} rad; how far muscles stay outside ellipsoids of the "
                "thorax is computed for upright ones. Expected rotation 0 0 0."
            )


def _check_values(tables: ModelTables, directory: Path) -> None:
    for segment in tables.segments.values():
        if segment.mass_kg < 0.0:
            raise ModelError(
                f"{directory}/segments.csv, segment {segment.name}: mass {segment.mass_kg} kg; "
                "expected 0 (an intermediate body) or more."
            )
    for muscle in tables.muscles.values():
        place = f"{directory}/muscles.csv, muscle {muscle.name}"
        if len(muscle.points) < 2:
            raise ModelError(f"{place}: {len(muscle.points)} rows in path_points.csv; need 2.")
        for column in POSITIVE_COLUMNS:
            if getattr(muscle, column) <= 0.0:
                raise ModelError(f"{place}, column {column}: {getattr(muscle, column)} is not > 0.")
        if not 0.0 <= muscle.pennation_rad < 0.5 * math.pi:
            raise ModelError(
                f"{place}, column pennation_rad: {muscle.pennation_rad}; expected 0 to pi / 2. "
                "Write radians."
            )
    for coordinate in tables.coordinates.values():
        if not coordinate.min_rad < coordinate.max_rad:
            raise ModelError(
                f"{directory}/coordinates.csv, coordinate {coordinate.name}: min_rad "
                f"{coordinate.min_rad} is not below max_rad {coordinate.max_rad}."
            )
