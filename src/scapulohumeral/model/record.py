"""The model of a participant as plain data, "model/1": all that equations and muscles need.

Lengths are in m, angles in rad, in the axes of the segment named. Rules that cannot import opensim
read what the rule that builds the model has written.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from scapulohumeral.documents import read_json, typed
from scapulohumeral.errors import ModelError
from scapulohumeral.model.choices import ModelChoices
from scapulohumeral.model.constants import Closed, Constants, Real, Vector3
from scapulohumeral.model.participant import Ellipsoid
from scapulohumeral.model.tables import Vector

REMEDY = "Build the model of the participant again."

Positive = Annotated[Real, Field(gt=0)]


@dataclass(frozen=True)
class SegmentRecord(Closed):
    """Mass, mass centre and inertia (xx yy zz xy xz yz) about it, segment axes."""

    mass_kg: Annotated[Real, Field(ge=0)]
    com_m: Vector3
    inertia_kgm2: tuple[Real, Real, Real, Real, Real, Real]


@dataclass(frozen=True)
class JointRecord(Closed):
    """Where a joint is in its parent; orientation by body-fixed x-y-z angles."""

    parent: str
    child: str
    location_m: Vector3
    orientation_rad: Vector3


@dataclass(frozen=True)
class CoordinateRecord(Closed):
    """Range of a coordinate."""

    min_rad: Real
    max_rad: Real
    default_rad: Real


@dataclass(frozen=True)
class PointRecord(Closed):
    """A point fixed in a body: a marker, or one of a muscle's path."""

    body: str
    location_m: Vector3


@dataclass(frozen=True)
class ConoidRecord(Closed):
    """The conoid ligament: its ends, stiffness, and length at rest."""

    origin_body: str
    origin_m: Vector3
    insertion_body: str
    insertion_m: Vector3
    stiffness_N_per_m: Positive
    eps_m: Positive
    length_m: Positive


@dataclass(frozen=True)
class MuscleRecord(Closed):
    """A muscle element: strength, lengths, activation, and its path from origin to insertion.

    `group` is the muscle that it is an element of; `wraps` names surfaces in their order.
    """

    name: str
    group: str
    max_isometric_force_N: Positive
    optimal_fibre_length_m: Positive
    tendon_slack_length_m: Positive
    activation_time_s: Positive
    deactivation_time_s: Positive
    points: tuple[PointRecord, ...]
    wraps: tuple[str, ...]


@dataclass(frozen=True)
class WrapRecord(Closed):
    """A surface that muscles wrap over.

    `dimensions_m` are radii of an ellipsoid, radius of a sphere, or radius and length of a
    cylinder; `scaled_dimensions_m` those of an ellipsoid before any flattening.
    """

    name: str
    type: Annotated[str, Field(pattern="^(ellipsoid|sphere|cylinder)$")]
    body: str
    translation_m: Vector3
    rotation_rad: Vector3
    quadrant: str
    dimensions_m: tuple[Positive, ...]
    scaled_dimensions_m: tuple[Positive, Positive, Positive] | None


@dataclass(frozen=True)
class ModelRecord(Closed):
    """The model of a participant.

    `muscles` are the elements simulated, in order; `girdle_range_rad` the least and largest angle
    of the coordinates of SC and AC; `axes` those of elbow flexion and pronation.
    """

    schema: Literal["model/1"]
    participant: str
    masses: str
    choices: ModelChoices
    body_mass_kg: Positive
    body_mass_source: str
    gravity_mps2: Vector3
    segments: dict[str, SegmentRecord]
    joints: dict[str, JointRecord]
    axes: dict[str, Vector3]
    coordinates: dict[str, CoordinateRecord]
    girdle_range_rad: dict[str, tuple[Real, Real]]
    pronation_rad: Real
    markers: dict[str, PointRecord]
    conoid: ConoidRecord
    muscles: tuple[MuscleRecord, ...]
    wrap_objects: tuple[WrapRecord, ...]
    published_thorax_ellipsoid: Ellipsoid | None
    constants: Constants

    def with_masses(self, mass_kg: Mapping[str, float]) -> ModelRecord:
        """The model with other masses of some segments [kg]; inertia follows in proportion."""
        segments = dict(self.segments)
        for name, mass in mass_kg.items():
            own = segments[name]
            ratio = mass / own.mass_kg
            xx, yy, zz, xy, xz, yz = (ratio * value for value in own.inertia_kgm2)
            segments[name] = SegmentRecord(mass, own.com_m, (xx, yy, zz, xy, xz, yz))
        return replace(self, segments=segments)

    def with_surface(self, name: str, dimensions_m: Vector) -> ModelRecord:
        """The model with another size of a surface that muscles wrap over."""
        surfaces = tuple(
            replace(w, dimensions_m=dimensions_m) if w.name == name else w
            for w in self.wrap_objects
        )
        return replace(self, wrap_objects=surfaces)

    @property
    def muscle_names(self) -> tuple[str, ...]:
        """Names of the muscle elements."""
        return tuple(muscle.name for muscle in self.muscles)

    @property
    def muscle_groups(self) -> tuple[str, ...]:
        """Muscle that each element belongs to."""
        return tuple(muscle.group for muscle in self.muscles)


def read_record(path: Path) -> ModelRecord:
    """The model record in a file.

    Raises
    ------
    ModelError                       it cannot be read, or a key or value is refused
    """
    return typed(_adapter(), read_json(path, REMEDY, ModelError), path, REMEDY)


def write_record(record: ModelRecord, path: Path) -> None:
    """Write a model record as JSON."""
    path.write_text(json.dumps(asdict(record), indent=1) + "\n", encoding="utf-8")


@cache
def _adapter() -> TypeAdapter[ModelRecord]:
    return TypeAdapter(ModelRecord)
