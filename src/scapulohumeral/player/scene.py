"""What a 3-D view shows: segments, landmarks, muscle lines and the glenohumeral force over time.

Letters: T frames, M muscles, S = 5 segments. Positions are in thorax axes: x to the right, y up,
z to the back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from scapulohumeral.model.rotations import Array, quaternion_to_matrix
from scapulohumeral.model.tables import Point

SEGMENTS = ("thorax", "clavicle_r", "scapula_r", "humerus_r", "forearm")


@dataclass(frozen=True)
class Surface:
    """An ellipsoid over which muscles are drawn: segment, centre and half axes [m] in its axes."""

    segment: str
    centre_m: tuple[float, ...]
    radii_m: tuple[float, ...]


@dataclass(frozen=True)
class MuscleLine:
    """A muscle element: path points from origin to insertion, and the surfaces in its way."""

    name: str
    group: str
    points: tuple[Point, ...]
    surfaces: tuple[Surface, ...]


@dataclass(frozen=True, eq=False)
class Scene:
    """One motion to look at.

    Attributes
    ----------
    label : what the motion is; converged : whether the solve behind it ended optimal
    time_s : (T,)
    origin_m : (T, S, 3), rotation : (T, S, 4) segments in the thorax, unit quaternions
    landmarks : by name, fixed in their segments; bones whose landmarks are missing are not drawn
    thorax : contact surface, or None
    head_radius_m : of the humeral head; rim_m : (K, 3) rim of the glenoid, scapula axes
    muscles : M lines; activation, force_N : (T, M)
    reaction_N : (T, 3) force of the glenoid on the humeral head, scapula axes
    percent_body_weight : (T,) its size; eccentricity : (T,) [1], above one outside of the rim
    measured_m : recorded landmarks by name, (T, 3): dots beside the bones, which are rigid
    """

    label: str
    converged: bool
    time_s: Array
    origin_m: Array
    rotation: Array
    landmarks: dict[str, Point]
    thorax: Surface | None
    head_radius_m: float
    rim_m: Array
    muscles: tuple[MuscleLine, ...]
    activation: Array
    force_N: Array  # noqa: N815 - unit
    reaction_N: Array  # noqa: N815 - unit
    percent_body_weight: Array
    eccentricity: Array
    measured_m: Mapping[str, Array] = field(default_factory=dict)


def positions(scene: Scene, points: Sequence[Point]) -> Array:
    """Positions (T, P, 3) [m] of P points of a scene in thorax axes."""
    columns = [SEGMENTS.index(point.segment) for point in points]
    matrices = quaternion_to_matrix(scene.rotation[:, columns])
    locations = np.array([point.location_m for point in points])
    return scene.origin_m[:, columns] + np.einsum("tpij,pj->tpi", matrices, locations)
