"""An interactive 3-D view of solutions: bones, muscle lines and the glenohumeral force over time.

The picture is drawn by ``player.js`` on a plain canvas; data, script and style are part of the
page, so that it can be read without a network::

    healthy = build_scene(solution, record, thorax, "healthy")
    recorded = build_scene(solution, record, thorax, "recorded motion", recorded=True)
    html = player_html([healthy, recorded])

Letters: T frames, M muscles, S = 5 segments. Positions are in thorax axes: x to the right, y up,
z to the back.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import jinja2
import numpy as np
import sympy as sm

from scapulohumeral.dynamics.participant_parameters import elbow_axis, forearm_frames
from scapulohumeral.errors import DataError, ModelError
from scapulohumeral.model.rotations import (
    Array,
    make_continuous,
    matrix_to_quaternion,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from scapulohumeral.model.tables import Point
from scapulohumeral.model.thorax_clearance import segment_frames
from scapulohumeral.ocp.cost_terms import glenoid_rotation
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.stages.joint_loading import (
    ANTERIOR_POSTERIOR_LIMIT,
    glenohumeral_load,
    glenoid_angles,
    superior_inferior_limit,
)

SEGMENTS = ("thorax", "clavicle_r", "scapula_r", "humerus_r", "forearm")
MARKERS = (
    "IJ", "PX", "C7", "T8", "SC", "AC", "AA", "TS", "AI", "GH", "EL", "EM", "Capitulum",
    "US", "RS", "Wrist",
)  # fmt: skip
HEAD_SURFACE = "inf_sup_sub"
# Mass centre of the hand on the line from wrist to third knuckle (de Leva 1996, J Biomech 29:1223).
HAND_CENTRE_SHARE = 0.79
RIM_POINTS = 24
# Steps of the stored whole numbers: 0.1 mm, 0.1 N of a muscle, 1 N of the joint, 0.1 %BW.
LENGTH_STEP_M = 1e-4
FORCE_STEP_N = 0.1
REACTION_STEP_N = 1.0
PERCENT_STEP = 0.1
UNIT_STEP = 1.0 / 30000.0
ECCENTRICITY_STEP = 1e-3
LARGEST_ECCENTRICITY = 30.0


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
    landmarks : by name
    thorax : contact surface
    head_radius_m : of the humeral head; rim_m : (K, 3) rim of the glenoid, scapula axes
    muscles : M lines; activation, force_N : (T, M)
    reaction_N : (T, 3) force of the glenoid on the humeral head, scapula axes
    percent_body_weight : (T,) its size; eccentricity : (T,) [1], above one outside of the rim
    """

    label: str
    converged: bool
    time_s: Array
    origin_m: Array
    rotation: Array
    landmarks: dict[str, Point]
    thorax: Surface
    head_radius_m: float
    rim_m: Array
    muscles: tuple[MuscleLine, ...]
    activation: Array
    force_N: Array  # noqa: N815 - unit
    reaction_N: Array  # noqa: N815 - unit
    percent_body_weight: Array
    eccentricity: Array


def build_scene(
    solution: Solution,
    record: Mapping[str, Any],
    thorax: Mapping[str, Any],
    label: str,
    recorded: bool = False,
    every: int = 2,
) -> Scene:
    """Scene of a solution, or of the motion that was recorded for it.

    Parameters
    ----------
    solution : Solution              a failed one is shown with a warning
    record : model record "model/1"
    thorax : fitted thorax ellipsoid, keys ``centre_m`` and ``radii_m``
    label : str                      name in the list of motions
    recorded : bool                  show `reference_pose`: bones only, nobody has measured forces
    every : int                      take every so many nodes, and the last one

    Raises
    ------
    ModelError                       a muscle of the solution or a marker is not in the record
    """
    nodes = np.unique(np.append(np.arange(0, len(solution.time_s), every), -1 % len(solution.pose)))
    pose = solution.reference_pose if recorded else solution.pose
    origin, rotation = segment_poses(record, pose[nodes])
    surfaces = _surfaces(record)
    shown = slice(0, 0) if recorded else slice(None)
    reaction = solution.reaction_N[nodes] * (not recorded)
    load = glenohumeral_load(reaction, record)
    return Scene(
        label=label,
        converged=recorded or solution.header["status"] == "optimal",
        time_s=solution.time_s[nodes],
        origin_m=origin,
        rotation=rotation,
        landmarks=_landmarks(record),
        thorax=Surface("thorax", tuple(thorax["centre_m"]), tuple(thorax["radii_m"])),
        head_radius_m=surfaces[HEAD_SURFACE].radii_m[0],
        rim_m=_glenoid_rim(record, surfaces[HEAD_SURFACE].radii_m[0]),
        muscles=tuple(_line(record, str(name), surfaces) for name in solution.muscles[shown]),
        activation=solution.activation[nodes, shown],
        force_N=solution.muscle_force_N[nodes, shown],
        reaction_N=reaction,
        percent_body_weight=load.percent_body_weight,
        eccentricity=np.where(reaction.any(axis=1), load.eccentricity, 0.0),
    )


def segment_poses(record: Mapping[str, Any], pose: Array) -> tuple[Array, Array]:
    """Forward kinematics of all segments.

    Parameters
    ----------
    record : model record "model/1"
    pose : array, shape (T, 13)      unit quaternions SC, AC, GH and elbow angle [rad]

    Returns
    -------
    origin : array, shape (T, S, 3)  [m] in thorax axes, in the order of ``SEGMENTS``
    rotation : array, shape (T, S, 4)
        unit quaternions, segment to thorax, continuous in time
    """
    frames = segment_frames(record, pose)
    origin, matrix = frames["humerus_r"]
    turn = quaternion_to_matrix(rotation_vector_to_quaternion(pose[:, 12:] * elbow_axis(record)))
    elbow = np.array(record["joints"]["hu"]["location_m"])
    frames["forearm"] = (origin + matrix @ elbow, matrix @ turn)
    quaternions = [make_continuous(matrix_to_quaternion(frames[s][1])) for s in SEGMENTS]
    return np.stack([frames[s][0] for s in SEGMENTS], 1), np.stack(quaternions, axis=1)


def positions(scene: Scene, points: Sequence[Point]) -> Array:
    """Positions (T, P, 3) [m] of P points of a scene in thorax axes."""
    columns = [SEGMENTS.index(point.segment) for point in points]
    matrices = quaternion_to_matrix(scene.rotation[:, columns])
    locations = np.array([point.location_m for point in points])
    return scene.origin_m[:, columns] + np.einsum("tpij,pj->tpi", matrices, locations)


def _point(record: Mapping[str, Any], body: str, location: Sequence[float]) -> Point:
    """A point of the model; those of ulna, radius and hand move with the forearm."""
    frames = forearm_frames(record)
    if body in frames:
        origin, rotation = frames[body]
        return Point("forearm", tuple(origin + rotation @ np.array(location)))
    return Point(body, tuple(location))


def _landmarks(record: Mapping[str, Any]) -> dict[str, Point]:
    markers = record["markers"]
    missing = [name for name in MARKERS if name not in markers]
    if missing:
        raise ModelError(
            f"model record of {record['participant']}, markers: no {', '.join(missing)}. Add them "
            "to markers.csv."
        )
    points = {m: _point(record, markers[m]["body"], markers[m]["location_m"]) for m in MARKERS}
    knuckle = np.array(record["segments"]["hand_r"]["com_m"]) / HAND_CENTRE_SHARE
    return {**points, "knuckle": _point(record, "hand_r", knuckle.tolist())}


def _surfaces(record: Mapping[str, Any]) -> dict[str, Surface]:
    """Spheres and ellipsoids of the model, whose axes are those of their segments."""
    return {
        w["name"]: Surface(
            w["body"],
            tuple(w["translation_m"]),
            tuple(w["dimensions_m"] * (3 if w["type"] == "sphere" else 1)),
        )
        for w in record["wrap_objects"]
        if w["type"] in ("sphere", "ellipsoid")
    }


def _line(record: Mapping[str, Any], name: str, surfaces: Mapping[str, Surface]) -> MuscleLine:
    muscles = {muscle["name"]: muscle for muscle in record["muscles"]}
    if name not in muscles:
        raise ModelError(
            f"solution, muscles: {name} is not in the model record of {record['participant']}. "
            "Use the record that the solution was made with."
        )
    muscle = muscles[name]
    points = tuple(_point(record, p["body"], p["location_m"]) for p in muscle["points"])
    wraps = tuple(surfaces[wrap] for wrap in muscle["wraps"] if wrap in surfaces)
    return MuscleLine(name, muscle["group"], points, wraps)


def _glenoid_rim(record: Mapping[str, Any], head_radius: float) -> Array:
    """Rim of the glenoid (K, 3) [m], scapula axes, in the plane that touches the humeral head.

    A force through the centre of the head passes this ellipse inside where its shear over
    compression is within the limits of `joint_loading`.
    """
    axes = np.array(glenoid_rotation(*map(sm.Float, glenoid_angles(record))), dtype=float)
    angle = np.linspace(0.0, 2.0 * np.pi, RIM_POINTS, endpoint=False)
    shear = np.outer(np.cos(angle), superior_inferior_limit(record) * axes[:, 1])
    shear += np.outer(np.sin(angle), ANTERIOR_POSTERIOR_LIMIT * axes[:, 2])
    return np.array(record["joints"]["gh1"]["location_m"]) + head_radius * (shear - axes[:, 0])


def player_html(scenes: Sequence[Scene], groups: Mapping[str, str] | None = None) -> str:
    """HTML element that shows scenes; needs nothing but itself, several fit on one page.

    Parameters
    ----------
    scenes : the first is shown first; each other can be laid over it as a ghost
    groups : names of muscle groups for readers, by group; those not named appear as they are

    Raises
    ------
    DataError                        no scene, or numbers that are not finite or too large
    """
    if not scenes:
        raise DataError("player: no scene; expected one or more. Build one by build_scene.")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("scapulohumeral.report", "."),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
    )
    named = [_with_group_names(scene, groups or {}) for scene in scenes]
    data = json.dumps([_document(scene) for scene in named], separators=(",", ":"))
    # No label can end the script element that carries the data.
    return environment.get_template("player.html.j2").render(
        labels=[scene.label for scene in named],
        groups=list(dict.fromkeys(m.group for scene in named for m in scene.muscles)),
        data=data.replace("<", "\\u003c"),
    )


def _with_group_names(scene: Scene, groups: Mapping[str, str]) -> Scene:
    named = tuple(replace(m, group=groups.get(m.group, m.group)) for m in scene.muscles)
    return replace(scene, muscles=named)


def _document(scene: Scene) -> dict[str, Any]:
    """A scene for the script: whole numbers, long arrays as base64 text."""
    return {
        "label": scene.label,
        "converged": scene.converged,
        "time": np.round(scene.time_s - scene.time_s[0], 4).tolist(),
        "origin": _packed(scene.origin_m, LENGTH_STEP_M),
        "rotation": _packed(scene.rotation, UNIT_STEP),
        "activation": _packed(scene.activation, UNIT_STEP),
        "force": _packed(scene.force_N, FORCE_STEP_N),
        "reaction": _packed(scene.reaction_N, REACTION_STEP_N),
        "percent": _packed(scene.percent_body_weight, PERCENT_STEP),
        "eccentricity": _packed(
            np.minimum(scene.eccentricity, LARGEST_ECCENTRICITY), ECCENTRICITY_STEP
        ),
        "landmarks": {name: _place(point) for name, point in scene.landmarks.items()},
        "thorax": _ellipsoid(scene.thorax),
        "head": _whole([scene.head_radius_m])[0],
        "rim": [_place(Point("scapula_r", tuple(point))) for point in scene.rim_m],
        "muscles": [
            {
                "name": muscle.name,
                "group": muscle.group,
                "points": [_place(point) for point in muscle.points],
                "surfaces": [_ellipsoid(surface) for surface in muscle.surfaces],
            }
            for muscle in scene.muscles
        ],
    }


def _packed(values: Array, step: float) -> dict[str, Any]:
    """Numbers as whole multiples of a step, 16-bit little-endian in base64."""
    limit = np.iinfo(np.int16).max
    if values.size and not np.abs(values).max() <= limit * step:
        raise DataError(
            f"player: largest number {np.abs(values).max():g}, expected at most {limit * step:g}. "
            "Look at the solution that the scene is made from."
        )
    whole = np.round(values / step).astype("<i2")
    return {"step": step, "data": base64.b64encode(whole.tobytes()).decode()}


def _whole(lengths_m: Sequence[float]) -> list[int]:
    return [round(length / LENGTH_STEP_M) for length in lengths_m]


def _place(point: Point) -> list[int]:
    return [SEGMENTS.index(point.segment), *_whole(point.location_m)]


def _ellipsoid(surface: Surface) -> list[int]:
    return [SEGMENTS.index(surface.segment), *_whole(surface.centre_m), *_whole(surface.radii_m)]
