"""Scenes of solutions for the 3-D view: bones, muscle lines and the glenohumeral force over time::

    healthy = build_scene(solution, record, thorax, "healthy")
    recorded = build_scene(solution, record, thorax, "recorded motion", recorded=True)
    html = player_html([healthy, recorded])

Letters: T frames, M muscles, S = 5 segments. Positions are in thorax axes: x to the right, y up,
z to the back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import sympy as sm

from scapulohumeral.dynamics.participant_parameters import elbow_axis, forearm_frames
from scapulohumeral.errors import ModelError
from scapulohumeral.model.muscle_paths.thorax_clearance import segment_frames
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import (
    Array,
    make_continuous,
    matrix_to_quaternion,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from scapulohumeral.model.tables import Point
from scapulohumeral.ocp.cost_terms import glenoid_rotation
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.player.scene import SEGMENTS, MuscleLine, Scene, Surface
from scapulohumeral.quantities.joint_loading import (
    ANTERIOR_POSTERIOR_LIMIT,
    glenohumeral_load,
    glenoid_angles,
    superior_inferior_limit,
)

MARKERS = (
    "IJ", "PX", "C7", "T8", "SC", "AC", "AA", "TS", "AI", "GH", "EL", "EM", "Capitulum",
    "US", "RS", "Wrist",
)  # fmt: skip
HEAD_SURFACE = "inf_sup_sub"
# Mass centre of the hand on the line from wrist to third knuckle (de Leva 1996, J Biomech 29:1223).
HAND_CENTRE_SHARE = 0.79
RIM_POINTS = 24


def build_scene(
    solution: Solution,
    record: ModelRecord,
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
        converged=recorded or solution.optimal,
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


def segment_poses(record: ModelRecord, pose: Array) -> tuple[Array, Array]:
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
    elbow = np.array(record.joints["hu"].location_m)
    frames["forearm"] = (origin + matrix @ elbow, matrix @ turn)
    quaternions = [make_continuous(matrix_to_quaternion(frames[s][1])) for s in SEGMENTS]
    return np.stack([frames[s][0] for s in SEGMENTS], 1), np.stack(quaternions, axis=1)


def _point(record: ModelRecord, body: str, location: Sequence[float]) -> Point:
    """A point of the model; those of ulna, radius and hand move with the forearm."""
    frames = forearm_frames(record)
    if body in frames:
        origin, rotation = frames[body]
        return Point("forearm", tuple(origin + rotation @ np.array(location)))
    return Point(body, tuple(location))


def _landmarks(record: ModelRecord) -> dict[str, Point]:
    markers = record.markers
    missing = [name for name in MARKERS if name not in markers]
    if missing:
        raise ModelError(
            f"model record of {record.participant}, markers: no {', '.join(missing)}. Add them "
            "to markers.csv."
        )
    points = {m: _point(record, markers[m].body, markers[m].location_m) for m in MARKERS}
    knuckle = np.array(record.segments["hand_r"].com_m) / HAND_CENTRE_SHARE
    return {**points, "knuckle": _point(record, "hand_r", knuckle.tolist())}


def _surfaces(record: ModelRecord) -> dict[str, Surface]:
    """Spheres and ellipsoids of the model, whose axes are those of their segments."""
    return {
        w.name: Surface(
            w.body,
            tuple(w.translation_m),
            tuple(w.dimensions_m * (3 if w.type == "sphere" else 1)),
        )
        for w in record.wrap_objects
        if w.type in ("sphere", "ellipsoid")
    }


def _line(record: ModelRecord, name: str, surfaces: Mapping[str, Surface]) -> MuscleLine:
    muscles = {muscle.name: muscle for muscle in record.muscles}
    if name not in muscles:
        raise ModelError(
            f"solution, muscles: {name} is not in the model record of {record.participant}. "
            "Use the record that the solution was made with."
        )
    muscle = muscles[name]
    points = tuple(_point(record, p.body, p.location_m) for p in muscle.points)
    wraps = tuple(surfaces[wrap] for wrap in muscle.wraps if wrap in surfaces)
    return MuscleLine(name, muscle.group, points, wraps)


def _glenoid_rim(record: ModelRecord, head_radius: float) -> Array:
    """Rim of the glenoid (K, 3) [m], scapula axes, in the plane that touches the humeral head.

    A force through the centre of the head passes this ellipse inside where its shear over
    compression is within the limits of `joint_loading`.
    """
    axes = np.array(glenoid_rotation(*map(sm.Float, glenoid_angles(record))), dtype=float)
    angle = np.linspace(0.0, 2.0 * np.pi, RIM_POINTS, endpoint=False)
    shear = np.outer(np.cos(angle), superior_inferior_limit(record) * axes[:, 1])
    shear += np.outer(np.sin(angle), ANTERIOR_POSTERIOR_LIMIT * axes[:, 2])
    return np.array(record.joints["gh1"].location_m) + head_radius * (shear - axes[:, 0])
