"""Joint angles of the model from rotations of segments.

Letters: T frames. Rotations (T, 3, 3) map from segment to thorax. The ten joint angles of a frame
are in the order of ``rotations.ANGLE_NAMES``, in radians.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.laboratory.markers.frames import unit
from scapulohumeral.model.rotations import (
    Array,
    continuous_yzy,
    joint_rotation,
    matrix_to_quaternion,
    quaternion_to_euler,
)
from scapulohumeral.model.tables import ModelTables

FULL_TURN = 2.0 * np.pi


def joint_angles(clavicle: Array, scapula: Array, humerus: Array, elbow: Array) -> Array:
    """Joint angles, continuous in time wherever the motion is.

    Parameters
    ----------
    clavicle, scapula, humerus : array, shape (T, 3, 3)      segments in the thorax
    elbow : array, shape (T,)                                elbow flexion [rad]

    Returns
    -------
    array, shape (T, 10)
    """
    sc = _yzx(clavicle)
    ac = _yzx(clavicle.swapaxes(1, 2) @ scapula)
    gh = matrix_to_quaternion(scapula.swapaxes(1, 2) @ humerus)
    angles = [sc, ac, _yzy(quaternion_to_euler(gh, "YZY")), elbow[:, None]]
    return np.concatenate(angles, axis=1)


def _yzx(matrix: Array) -> Array:
    return np.unwrap(quaternion_to_euler(matrix_to_quaternion(matrix), "YZX"), axis=0)


def _yzy(angles: Array) -> Array:
    """Y-Z-Y angles (T, 3) [rad], continuous in time, as tables hold them.

    The first frame has b >= 0 and outer angles within half a turn.
    """
    result = continuous_yzy(angles, angles[0])
    # Whole turns that the recording has wound up, as a raised and lowered arm does, mean nothing.
    result = result - FULL_TURN * np.round(result.mean(axis=0) / FULL_TURN) * [1, 0, 1]
    # Tables hold at most one turn; an arm that circles on and on jumps by a turn now and then.
    return np.where(np.abs(result) > FULL_TURN, np.fmod(result, FULL_TURN), result)


def elbow_flexion(tables: ModelTables, humerus: Array, forearm: Array) -> Array:
    """Elbow flexion of the model that points its ulna closest to where the recorded one points.

    The recorded direction may leave the plane in which the hinge of the model turns; the part along
    its axis is lost.

    Parameters
    ----------
    tables : ModelTables             joint hu, coordinate EL_x and markers EL, EM, US
    humerus : array, shape (T, 3, 3)
    forearm : array, shape (T, 3)    from the midpoint of the epicondyles to US, same axes as
                                     `humerus` maps to

    Returns
    -------
    array, shape (T,)                [rad]; negative in an elbow straighter than the model at zero
    """
    axis, straight, hinge = _elbow_of(tables)
    directions = unit(np.einsum("tji,tj->ti", humerus, forearm))
    model = straight - axis * (straight @ axis)
    angle = np.zeros(len(directions))
    # The hinge does not pass the midpoint of the epicondyles, by 8 mm, so the distance that belongs
    # to a direction depends on the angle: three rounds settle it to 1e-4 rad.
    for _ in range(3):
        wrist = hinge + Rotation.from_rotvec(angle[:, None] * axis).apply(straight)
        from_hinge = directions * np.linalg.norm(wrist, axis=1, keepdims=True) - hinge
        inside = from_hinge - np.outer(from_hinge @ axis, axis)
        angle = np.arctan2(np.cross(model, inside) @ axis, inside @ model)
    return angle


def _elbow_of(tables: ModelTables) -> tuple[Array, Array, Array]:
    """Axis of the elbow, hinge to US at zero flexion, epicondyles to hinge; humerus axes, (3,)."""
    joint = tables.joints["hu"]
    turn = joint_rotation(joint.orientation_rad)
    axis = turn @ np.array(tables.coordinates["EL_x"].axis)
    markers = {name: np.array(tables.markers[name].location_m) for name in ("EL", "EM", "US")}
    hinge = np.array(joint.location_m) - (markers["EL"] + markers["EM"]) / 2.0
    return unit(axis), turn @ markers["US"], hinge
