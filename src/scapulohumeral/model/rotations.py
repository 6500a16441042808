"""Unit quaternions, rotation matrices and joint Euler angles.

Letters: T frames; ``...`` any number of leading axes, over which every function is vectorised.
Quaternions are scalar first. A joint quaternion q maps vectors from child to parent axes,
``v_parent = R(q) v_child``. Euler sequences are intrinsic (body-fixed) and written in capitals:
"YZX" stands for R = R_y(first) R_z(second) R_x(third). Angles are in radians.

A trial row has the ten joint angles of ``ANGLE_NAMES``; a pose has the thirteen numbers
(SC quaternion, AC quaternion, GH quaternion, elbow angle).
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
EulerSequence = Literal["YZX", "YZY"]

ANGLE_NAMES = (
    "SC_y", "SC_z", "SC_x", "AC_y", "AC_z", "AC_x", "GH_y", "GH_z", "GH_yy", "EL_x",
)  # fmt: skip
# Below this scipy takes the second angle of Y-Z-Y for zero.
LOCKED_RAD = 1e-7
JOINT_SEQUENCES: dict[str, EulerSequence] = {"SC": "YZX", "AC": "YZX", "GH": "YZY"}


def quaternion_multiply(p: ArrayLike, q: ArrayLike) -> Array:
    """Hamilton product p q: the rotation q followed by p, R(p q) = R(p) R(q).

    Parameters
    ----------
    p, q : array, shape (..., 4)    broadcast against each other

    Returns
    -------
    array, shape (..., 4)
    """
    p, q = np.asarray(p, float), np.asarray(q, float)
    p0, pv, q0, qv = p[..., :1], p[..., 1:], q[..., :1], q[..., 1:]
    scalar = p0 * q0 - np.sum(pv * qv, axis=-1, keepdims=True)
    return np.concatenate([scalar, p0 * qv + q0 * pv + np.cross(pv, qv)], axis=-1)


def quaternion_conjugate(q: ArrayLike) -> Array:
    """Conjugate of quaternions, shape (..., 4): the inverse rotation if they have unit norm."""
    return np.asarray(q, float) * np.array([1.0, -1.0, -1.0, -1.0])


def quaternion_to_matrix(q: ArrayLike) -> Array:
    """Rotation matrices, shape (..., 3, 3), of quaternions (..., 4), which are normalised first."""
    q = np.asarray(q, float)
    matrix = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True).as_matrix()
    return matrix.reshape(*q.shape[:-1], 3, 3)


def axis_rotation(axis: Array, angle: float) -> Array:
    """Matrix (3, 3) of a rotation by an angle [rad] about an axis (3,) of any length."""
    half = 0.5 * angle
    unit = axis / np.linalg.norm(axis)
    return quaternion_to_matrix(np.array([np.cos(half), *(np.sin(half) * unit)]))


def joint_rotation(orientation_rad: ArrayLike) -> Array:
    """Matrix (3, 3) from a joint's frame to its parent body, by the angles (3,) of a model file.

    They are body-fixed x-y-z, as OpenSim has them: R = R_x(first) R_y(second) R_z(third).
    """
    matrix = np.eye(3)
    for axis, angle in zip(np.eye(3), np.asarray(orientation_rad, float), strict=True):
        matrix = matrix @ axis_rotation(axis, angle)
    return matrix


def matrix_to_quaternion(matrix: ArrayLike) -> Array:
    """Unit quaternions, shape (..., 4), scalar part >= 0, of rotation matrices (..., 3, 3)."""
    matrix = np.asarray(matrix, float)
    rotation = Rotation.from_matrix(matrix.reshape(-1, 3, 3))
    return rotation.as_quat(canonical=True, scalar_first=True).reshape(*matrix.shape[:-2], 4)


def rotation_vector_to_quaternion(vector: ArrayLike) -> Array:
    """Unit quaternions, shape (..., 4), of rotation vectors (..., 3) [rad]."""
    vector = np.asarray(vector, float)
    rotation = Rotation.from_rotvec(vector.reshape(-1, 3))
    return rotation.as_quat(scalar_first=True).reshape(*vector.shape[:-1], 4)


def euler_to_quaternion(angles: ArrayLike, sequence: EulerSequence) -> Array:
    """Unit quaternions of intrinsic Euler angles.

    Parameters
    ----------
    angles : array, shape (..., 3)   [rad], in the order of `sequence`
    sequence : "YZX" (SC, AC) or "YZY" (GH)

    Returns
    -------
    array, shape (..., 4)
    """
    angles = np.asarray(angles, float)
    rotation = Rotation.from_euler(sequence, angles.reshape(-1, 3))
    return rotation.as_quat(scalar_first=True).reshape(*angles.shape[:-1], 4)


def quaternion_to_euler(q: ArrayLike, sequence: EulerSequence) -> Array:
    """Intrinsic Euler angles of quaternions: the inverse of `euler_to_quaternion`.

    Branch: for "YZX" the second angle lies in [-pi/2, pi/2], for "YZY" in [0, pi]; the others lie
    in [-pi, pi]. At gimbal lock the third angle is set to zero, and scipy warns.

    Parameters
    ----------
    q : array, shape (..., 4)
    sequence : "YZX" or "YZY"

    Returns
    -------
    array, shape (..., 3)            [rad]
    """
    q = np.asarray(q, float)
    rotation = Rotation.from_quat(q.reshape(-1, 4), scalar_first=True)
    return rotation.as_euler(sequence).reshape(*q.shape[:-1], 3)


def euler_rate_jacobian(angles: ArrayLike, sequence: EulerSequence) -> Array:
    """Map J from Euler angle rates to angular velocity in child axes, omega = J d(angles)/dt.

    The columns are the axes of the three rotations, seen from the child.

    Parameters
    ----------
    angles : array, shape (..., 3)   [rad], in the order of `sequence`
    sequence : "YZX" or "YZY"

    Returns
    -------
    array, shape (..., 3, 3)         singular where the angles are at gimbal lock
    """
    angles = np.asarray(angles, float)
    axes = [np.eye(3)["XYZ".index(axis)] for axis in sequence]
    flat = angles.reshape(-1, 3)
    after = [
        Rotation.from_euler(sequence[1:], flat[:, 1:]),
        Rotation.from_euler(sequence[2:], flat[:, 2:]),
        Rotation.identity(len(flat)),
    ]
    columns = [turn.apply(axis, inverse=True) for turn, axis in zip(after, axes, strict=True)]
    return np.stack(columns, axis=-1).reshape(*angles.shape[:-1], 3, 3)


def make_continuous(q: ArrayLike) -> Array:
    """Choose signs so that consecutive quaternions in time are nearest: q and -q are one rotation.

    Parameters
    ----------
    q : array, shape (T, ..., 4)     time on the first axis; the first frame keeps its sign

    Returns
    -------
    array, shape (T, ..., 4)
    """
    q = np.asarray(q, float)
    agreement = np.sum(q[1:] * q[:-1], axis=-1, keepdims=True)
    signs = np.cumprod(np.where(agreement < 0.0, -1.0, 1.0), axis=0)
    return np.concatenate([q[:1], signs * q[1:]], axis=0)


def relative_angle(q1: ArrayLike, q2: ArrayLike) -> Array:
    """Angle in [0, pi] of the rotation between quaternions (..., 4), independent of their signs."""
    difference = quaternion_multiply(quaternion_conjugate(q1), q2)
    vector = np.linalg.norm(difference[..., 1:], axis=-1)
    # atan2 keeps its accuracy for small angles, where arccos of the scalar part loses half of it.
    return 2.0 * np.arctan2(vector, np.abs(difference[..., 0]))


def trial_to_pose(angles: ArrayLike) -> Array:
    """Poses of a recorded trial, with quaternions continuous in time.

    Of both signs of a joint's quaternions the one with more positive scalar parts is taken, so that
    poses do not depend on how often the Euler angles were wrapped: muscle lengths are polynomials
    of one sign, and meaningless for the other.

    Parameters
    ----------
    angles : array, shape (T, 10)    [rad], in the order of `ANGLE_NAMES`

    Returns
    -------
    array, shape (T, 13)             SC, AC, GH quaternions and elbow angle [rad]
    """
    angles = np.asarray(angles, float)
    quaternions = [
        make_continuous(euler_to_quaternion(angles[:, 3 * i : 3 * i + 3], sequence))
        for i, sequence in enumerate(JOINT_SEQUENCES.values())
    ]
    joints = (-q if q[:, 0].sum() < 0.0 else q for q in quaternions)
    return np.concatenate([*joints, angles[:, 9:]], axis=1)


def pose_to_trial(pose: ArrayLike) -> Array:
    """Joint Euler angles, shape (T, 10) [rad], of poses (T, 13): the inverse of `trial_to_pose`."""
    pose = np.asarray(pose, float)
    angles = [
        quaternion_to_euler(pose[:, 4 * i : 4 * i + 4], sequence)
        for i, sequence in enumerate(JOINT_SEQUENCES.values())
    ]
    return np.concatenate([*angles, pose[:, 12:]], axis=1)


def continuous_yzy(angles: Array, start: Array) -> Array:
    """Y-Z-Y angles without the jumps between their two forms and between turns.

    (a, b, c) and (a + pi, -b, c + pi) are one rotation. Every frame takes the form and the turns
    nearest to the frame before it. Where b is zero a + c alone is known, and a - c stays as it was.
    Where b passes zero closely the outer angles still turn quickly: that is gimbal lock.

    Parameters
    ----------
    angles : array, shape (T, 3)     [rad]
    start : array, shape (3,)        the first frame is taken nearest to these angles

    Returns
    -------
    array, shape (T, 3)
    """
    result = np.empty_like(angles)
    before = start
    for frame, first in enumerate(angles):
        if abs(first[1]) < LOCKED_RAD:
            a, _, c = before - first
            first = first + [(a - c) / 2.0, 0.0, (c - a) / 2.0]
        forms = (first, first * [1.0, -1.0, 1.0] + [np.pi, 0.0, np.pi])
        near = [form - _turns(form - before) for form in forms]
        before = near[int(np.argmin([np.sum((form - before) ** 2) for form in near]))]
        result[frame] = before
    return result


def continuous_angles(angles: Array, start: Array) -> Array:
    """Joint angles (T, 10) [rad], of all that are the same pose those nearest to the frame before.

    Parameters
    ----------
    angles : array, shape (T, 10)
    start : array, shape (10,)       the first frame is taken nearest to these angles
    """
    result = np.unwrap(np.concatenate([start[None], angles]), axis=0)[1:]
    result[:, 6:9] = continuous_yzy(angles[:, 6:9], start[6:9])
    return result


def _turns(angles: Array) -> Array:
    """Whole turns nearest to angles [rad]."""
    return 2.0 * np.pi * np.round(angles / (2.0 * np.pi))


def positive_pose(pose: Array) -> Array:
    """Poses (..., 13) whose quaternions have scalar parts >= 0."""
    positive = pose.copy()
    for first in range(0, 12, 4):
        positive[..., first : first + 4] *= np.where(pose[..., first, None] < 0.0, -1.0, 1.0)
    return positive


def unit_pose(pose: Array) -> Array:
    """Poses (N, 13) whose quaternions have unit norm, as interpolated ones have not."""
    unit = pose.copy()
    for first in range(0, 12, 4):
        unit[:, first : first + 4] /= np.linalg.norm(pose[:, first : first + 4], axis=1)[:, None]
    return unit


def segment_orientations(pose: Array) -> dict[str, Array]:
    """Quaternions (..., 4) of clavicle, scapula and humerus in the thorax, for poses (..., 13)."""
    scapula = quaternion_multiply(pose[..., 0:4], pose[..., 4:8])
    return {
        "clavicle": pose[..., 0:4],
        "scapula": scapula,
        "humerus": quaternion_multiply(scapula, pose[..., 8:12]),
    }


def with_girdle(pose: Array, nodes: Array, girdle: Array) -> Array:
    """Poses (N, 13) with another girdle under the same humerus.

    Parameters
    ----------
    pose : (N, 13)
    nodes, girdle : quaternions (K, 8) of SC and AC, and the nodes (K,) at which they are known;
        between them they change evenly
    """
    known = np.hstack([make_continuous(girdle[:, joint]) for joint in (slice(0, 4), slice(4, 8))])
    every = np.arange(len(pose))
    evenly = [np.interp(every, nodes, column) for column in known.T]
    other = unit_pose(np.column_stack([*evenly, pose[:, 8:]]))
    blade = segment_orientations(other)["scapula"]
    humerus = segment_orientations(pose)["humerus"]
    other[:, 8:12] = make_continuous(quaternion_multiply(quaternion_conjugate(blade), humerus))
    return other


def girdle_turned(pose: Array, clavicle: Array, scapula: Array) -> Array:
    """Poses (N, 13) with clavicle and scapula turned under the same humerus.

    Parameters
    ----------
    pose : (N, 13)
    clavicle, scapula : (3,) or (N, 3) rotation vectors of the orientation in the thorax, own axes
        [rad]
    """
    before = segment_orientations(pose)
    collar = quaternion_multiply(before["clavicle"], rotation_vector_to_quaternion(clavicle))
    blade = quaternion_multiply(before["scapula"], rotation_vector_to_quaternion(scapula))
    turned = pose.copy()
    turned[:, 0:4] = collar
    turned[:, 4:8] = quaternion_multiply(quaternion_conjugate(collar), blade)
    turned[:, 8:12] = quaternion_multiply(quaternion_conjugate(blade), before["humerus"])
    return turned
