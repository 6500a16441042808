"""The arm of each simulation: skeleton parameters, muscles, and forces that the model lacks.

Letters: N simulations, P dynamics parameters, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import unpack
from simulated_persons.muscles import Muscles

REACTIONS = slice(10, 13)


@dataclass(frozen=True, eq=False)
class ExtraTorques:
    """Passive torques outside the model, each zero by default.

    Attributes
    ----------
    capsule_Nm : (N,) scale of an exponential glenohumeral torque beyond `capsule_onset_rad`
    capsule_onset_rad : (N,) elevation of the humerus against the scapula at which it starts
    elbow_spring_Nm_rad, elbow_rest_rad : (N,) spring across the elbow (splint)
    friction_Nm : (N,) Coulomb friction of the glenohumeral joint, smooth below 0.2 rad/s
    arm_force_N : (N, 3) force on the forearm in thorax axes; arm_force_share : (N,) of the way from
        the elbow to the hand at which it acts
    """

    capsule_Nm: np.ndarray  # noqa: N815 - unit
    capsule_onset_rad: np.ndarray
    elbow_spring_Nm_rad: np.ndarray  # noqa: N815 - unit
    elbow_rest_rad: np.ndarray
    friction_Nm: np.ndarray  # noqa: N815 - unit
    arm_force_N: np.ndarray  # noqa: N815 - unit
    arm_force_share: np.ndarray


@dataclass(frozen=True, eq=False)
class Body:
    """Bodies of N simulations of one participant.

    Attributes
    ----------
    forces : equations of motion and muscle paths
    parameters : (N, P); muscles : parameters of (N, M)
    extra : torques that the model lacks
    """

    forces: MuscleForces
    parameters: np.ndarray
    muscles: Muscles
    extra: ExtraTorques


CAPSULE_RATE = 6.0  # 1/rad: stiffens e-fold every 10 deg
FRICTION_SPEED = 0.2


def no_extra_torques(count: int) -> ExtraTorques:
    """Extra torques of zero for a number of simulations."""
    zero = np.zeros(count)
    nowhere = np.zeros((count, 3))
    return ExtraTorques(
        zero, np.full(count, 1.2), zero, np.full(count, 0.3), zero, nowhere, np.ones(count)
    )


def extra_torques(body: Body, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Torques (N, 10) of `Body.extra` on the speeds, for q (N, 13) and u (N, 10)."""
    extra, torque = body.extra, np.zeros_like(u)
    a, b, c, d = q[:, 8:12].T
    # Upward axis of the scapula in the humerus: elevation turns it away from the humerus' own.
    up = np.stack([2 * (b * c + a * d), a**2 - b**2 + c**2 - d**2, 2 * (c * d - a * b)], axis=1)
    swing = np.stack([-up[:, 2], np.zeros_like(a), up[:, 0]], axis=1)
    sine = np.maximum(np.linalg.norm(swing, axis=1), 1e-6)
    beyond = np.clip(np.arctan2(sine, up[:, 1]) - extra.capsule_onset_rad, 0.0, 0.6)
    capsule = extra.capsule_Nm * np.expm1(CAPSULE_RATE * beyond)
    torque[:, 6:9] -= (capsule / sine)[:, None] * swing
    torque[:, 6:9] -= extra.friction_Nm[:, None] * np.tanh(u[:, 6:9] / FRICTION_SPEED)
    torque[:, 9] -= extra.elbow_spring_Nm_rad * (q[:, 12] - extra.elbow_rest_rad)
    return torque


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Equations of motion at one state: mass du/dt = load + damping du + stiffness dx + muscles.

    mass (N, 10, 10); load (N, 13), auxiliary rows last; damping, stiffness (N, 10, 10).
    """

    mass: np.ndarray
    load: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray


def linearise(body: Body, q: np.ndarray, u: np.ndarray) -> Linearisation:
    """Linearisation of the skeleton, muscles left out."""
    dynamics = body.forces.dynamics
    z = np.hstack([q, u, np.zeros((len(q), 13))])
    slopes = _evaluate(body, "jacobian", z).reshape(len(q), z.shape[1], 13).transpose(0, 2, 1)
    load = skeleton_load(body, q, u)
    by_q = np.matmul(slopes[:, :10, :13], dynamics.rate_map(q))
    damping = slopes[:, :10, 13:23]
    gh = np.arange(6, 9)
    sliding = 1.0 - np.tanh(u[:, gh] / FRICTION_SPEED) ** 2
    damping[:, gh, gh] -= body.extra.friction_Nm[:, None] / FRICTION_SPEED * sliding
    return Linearisation(-slopes[:, :10, 23:33], load, damping, by_q)


def skeleton_load(body: Body, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Generalised forces (N, 13) of skeleton and extra torques without acceleration."""
    z = np.hstack([q, u, np.zeros((len(q), 13))])
    load = _evaluate(body, "residual", z)
    load[:, :10] += extra_torques(body, q, u)
    return load + arm_force(body, q)


def arm_force(body: Body, q: np.ndarray) -> np.ndarray:
    """Generalised forces (N, 13) of the force on the forearm, for q (N, 13)."""
    force, count = body.extra.arm_force_N, len(q)
    if not force.any():
        return np.zeros((count, 13))
    values = {
        name: np.array([unpack(row)[name] for row in body.parameters])
        for name in ("offset_AC", "offset_GH", "offset_EL", "axis_EL", "com_load")
    }
    clavicle, scapula, humerus = np.moveaxis(body.forces.dynamics.pose_matrices(q), 1, 0)
    bend = Rotation.from_rotvec(q[:, 12:] * values["axis_EL"]).as_matrix()
    # From each joint to the next, last to where the force acts: the torque is their sum x force.
    parts = [
        turned(clavicle, values["offset_AC"]),
        turned(scapula, values["offset_GH"]),
        turned(humerus, values["offset_EL"]),
        body.extra.arm_force_share[:, None] * turned(humerus @ bend, values["com_load"]),
    ]
    lever, torques = np.zeros((count, 3)), []
    for part in reversed(parts):
        lever = lever + part
        torques.append(np.cross(lever, force))
    elbow, *ball = torques
    rows = [
        turned(m.transpose(0, 2, 1), t)
        for m, t in zip((humerus, scapula, clavicle), ball, strict=True)
    ]
    about = np.sum(turned(humerus, values["axis_EL"]) * elbow, axis=1, keepdims=True)
    return np.hstack([*rows[::-1], about, turned(scapula.transpose(0, 2, 1), force)])


def turned(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    """Products (N, I) of matrices (N, I, J) and vectors (N, J)."""
    return np.einsum("nij,nj->ni", matrix, vector)


def rotate(q: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """Poses (N, 13) after body-fixed rotations (N, 10) [rad], of unit norm by construction."""
    q = q.copy()
    for joint in range(3):
        part = q[:, 4 * joint : 4 * joint + 4]
        half = 0.5 * turn[:, 3 * joint : 3 * joint + 3]
        angle = np.linalg.norm(half, axis=1, keepdims=True)
        vector = np.sinc(angle / np.pi) * half
        scalar = np.cos(angle)
        new = np.empty_like(part)
        new[:, :1] = part[:, :1] * scalar - np.sum(part[:, 1:] * vector, axis=1, keepdims=True)
        new[:, 1:] = part[:, :1] * vector + scalar * part[:, 1:] + np.cross(part[:, 1:], vector)
        q[:, 4 * joint : 4 * joint + 4] = new / np.linalg.norm(new, axis=1, keepdims=True)
    q[:, 12] += turn[:, 9]
    return q


def _evaluate(body: Body, name: str, z: np.ndarray) -> np.ndarray:
    """A function of the equations for states (N, Z), each with its own parameters."""
    function = body.forces.dynamics.functions[name]
    columns = (np.ascontiguousarray(a.T) for a in (z, body.parameters))
    return np.array(function(*columns)).T
