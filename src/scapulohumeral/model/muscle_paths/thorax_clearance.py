"""How far muscle attachments stay outside the thorax surfaces that their muscles wrap over.

OpenSim stops wrapping as soon as an attachment is inside the surface: the path then runs straight
through the thorax and its length jumps by centimetres. Geometry is smooth only where every
attachment is outside. The measure is the level set of the ellipsoid, sum(((x - c) / a)^2) - 1:
positive outside, zero on the surface, -1 at the centre.

Letters: P poses of thirteen numbers, as in ``rotations``; `record` is a model record, "model/1".
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from scapulohumeral.model.constants import Vector3
from scapulohumeral.model.record import ModelRecord, WrapRecord
from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
    segment_orientations,
)

Frame = tuple[Array, Array]
# Long axis of the thorax in its own axes.
UPWARD = (0.0, 1.0, 0.0)
# Joint, segment that it moves, and where its quaternion begins in a pose.
CHAIN = (("sc1", "clavicle_r", 0), ("ac1", "scapula_r", 4), ("gh1", "humerus_r", 8))


def level_set(points: Array, centre: Array, radii: Array) -> Array:
    """Level set (...) [1] of an ellipsoid at points (..., 3) [m]: negative inside."""
    return np.sum(((points - centre) / radii) ** 2, axis=-1) - 1.0


def segment_frames(record: ModelRecord, poses: Array) -> dict[str, Frame]:
    """Where thorax, clavicle, scapula and humerus are, in thorax axes; as `chain_frames`."""
    return chain_frames({joint: record.joints[joint].location_m for joint, *_ in CHAIN}, poses)


def chain_frames(location_m: Mapping[str, Sequence[float]], poses: Array) -> dict[str, Frame]:
    """The same by where the joints of the chain are in their parents [m].

    Returns
    -------
    dict                             segment -> (origin (P, 3) [m], rotation matrix (P, 3, 3))
    """
    origin, matrix = np.zeros((len(poses), 3)), np.tile(np.eye(3), (len(poses), 1, 1))
    frames = {"thorax": (origin, matrix)}
    for joint, segment, start in CHAIN:
        origin = origin + matrix @ np.array(location_m[joint])
        matrix = matrix @ quaternion_to_matrix(poses[:, start : start + 4])
        frames[segment] = (origin, matrix)
    return frames


def attachment_levels(record: ModelRecord, poses: Array) -> dict[str, Array]:
    """Lowest level of the moving attachments of its muscles, for each ellipsoid of the thorax.

    Attachments on the thorax itself are left out: they do not move, and lie on the surface.

    Parameters
    ----------
    record : model record
    poses : array, shape (P, 13)

    Returns
    -------
    dict                             wrap object -> array (P,); only objects that muscles use
    """
    frames = segment_frames(record, poses)
    surfaces = {w.name: w for w in record.wrap_objects if w.body == "thorax"}
    levels: dict[str, Array] = {}
    for muscle in record.muscles:
        for name in surfaces.keys() & set(muscle.wraps):
            for point in muscle.points:
                if point.body != "thorax":
                    level = _level(surfaces[name], frames[point.body], point.location_m)
                    levels[name] = np.minimum(levels.get(name, level), level)
    return levels


def _level(surface: WrapRecord, frame: Frame, location: Vector3) -> Array:
    origin, matrix = frame
    position = origin + matrix @ np.array(location)
    return level_set(position, np.array(surface.translation_m), np.array(surface.dimensions_m))


def is_clear(record: ModelRecord, poses: Array, clearance: float = 0.0) -> np.ndarray:
    """Whether all attachments are outside the surfaces of the thorax, boolean array (P,).

    They are if their level is above `clearance` [1].
    """
    levels = attachment_levels(record, poses)
    return np.all([level > clearance for level in levels.values()], axis=0)


def arm_hanging(poses: Array) -> Array:
    """Poses (P, 13) whose arm hangs straight down: turned there by the shortest way.

    Clavicle and scapula stay, the long axis of the humerus becomes that of the thorax.
    """
    _, scapula, humerus = segment_orientations(poses).values()
    long_axis = quaternion_to_matrix(humerus)[:, :, 1]
    axis = np.cross(long_axis, UPWARD)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(sine, long_axis[:, 1:2])
    turn = rotation_vector_to_quaternion(angle * axis / np.maximum(sine, np.finfo(float).tiny))
    hanging = poses.copy()
    hanging[:, 8:12] = quaternion_multiply(
        quaternion_conjugate(scapula), quaternion_multiply(turn, humerus)
    )
    return hanging
