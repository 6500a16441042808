"""Starting points: recorded motion, its speeds, and muscle activations by static optimisation.

Letters: N nodes, M muscles, Nq coordinates.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from scapulohumeral.dynamics.hill import MuscleParameters, force_derivatives
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.ocp.objective import Trajectory

EFFORT_WEIGHT = 0.5
MOMENT_WEIGHT = 0.01  # 1/(N m): 10 N m weigh as much as 3.4 deg of rotation
RELIEF_STEPS = 40


def coordinates(formulation: str, angles: np.ndarray) -> np.ndarray:
    """Generalised coordinates (N, Nq) of joint angles (N, 10) [rad]."""
    return trial_to_pose(angles) if formulation == "quaternion" else np.array(angles)


def speeds(forces: MuscleForces, q: np.ndarray, step: float) -> np.ndarray:
    """Generalised speeds (N, 10) [rad/s] of coordinates (N, Nq) at a mesh interval [s]."""
    rate = np.gradient(q, step, axis=0)
    return np.einsum(
        "nji,nj->ni", np.linalg.pinv(forces.dynamics.rate_map(q)).transpose(0, 2, 1), rate
    )


def static_optimisation(
    forces: MuscleForces,
    muscles: MuscleParameters,
    parameters: np.ndarray,
    q: np.ndarray,
    u: np.ndarray,
    step: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Activations (N, M) and glenohumeral reactions (N, 3) [N] for a prescribed motion.

    Bounded least squares at each node: the ten moments balanced as far as the muscles can, with a
    small effort term that spreads the load.
    """
    arms = forces.gradients(q)
    length, velocity = forces.lengths(q, u)
    force = force_derivatives(length, velocity, muscles)
    z = np.hstack([q, u, np.gradient(u, step, axis=0), np.zeros((len(q), 3))])
    load = forces.dynamics.residual(z, parameters)
    activation = np.empty_like(length)
    effort = EFFORT_WEIGHT * np.eye(length.shape[1])
    for n in range(len(q)):
        passive = load[n] - force.passive[n] @ arms[n]
        matrix = np.vstack([(arms[n, :, :10] * force.active[n][:, None]).T, effort])
        target = np.concatenate([passive[:10], np.zeros(len(effort))])
        activation[n] = lsq_linear(matrix, target, (1e-3, 0.99), tol=1e-6).x
    tension = force.active * activation + force.passive
    reaction = np.einsum("nm,nmk->nk", tension, arms[:, :, 10:]) - load[:, 10:]
    return activation, reaction


def relieve_contact(forces: MuscleForces, parameters: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Poses (N, Nq) near the recorded ones with bearable moments of contact and ligament.

    Recorded scapulae lie some millimetres inside the stiff thorax surface, which means hundreds of
    newton metres. Levenberg-Marquardt steps at each node trade the distance from the recorded pose
    against that moment.
    """
    free = unpack(parameters)
    for name in ("gravity", "joint_stiffness", "spring_torque"):
        free[name] = np.zeros_like(free[name])
    weightless = pack(free)
    nq = q.shape[1]
    recorded = q

    def residuals(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z = np.hstack([pose, np.zeros((len(pose), 23))])
        moment = MOMENT_WEIGHT * forces.dynamics.residual(z, weightless)[:, :10]
        slope = MOMENT_WEIGHT * forces.dynamics.jacobian(z, weightless)[:, :10, :nq]
        value = np.concatenate([pose - recorded, moment], axis=1)
        return value, np.concatenate([np.tile(np.eye(nq), (len(pose), 1, 1)), slope], axis=1)

    damping = np.full(len(q), 1e-2)
    value, slope = residuals(q)
    for _ in range(RELIEF_STEPS):
        normal = np.matmul(slope.transpose(0, 2, 1), slope)
        normal += damping[:, None, None] * np.eye(nq)
        gradient = np.einsum("nki,nk->ni", slope, value)
        trial = q - np.linalg.solve(normal, gradient[..., None])[..., 0]
        trial_value, trial_slope = residuals(trial)
        better = (trial_value**2).sum(axis=1) < (value**2).sum(axis=1)
        q = np.where(better[:, None], trial, q)
        value = np.where(better[:, None], trial_value, value)
        slope = np.where(better[:, None, None], trial_slope, slope)
        damping = np.clip(np.where(better, 0.3, 5.0) * damping, 1e-8, 1e3)
    if forces.dynamics.name == "quaternion":
        for start in (0, 4, 8):
            part = q[:, start : start + 4]
            part /= np.linalg.norm(part, axis=1, keepdims=True)
    return q


def from_motion(
    forces: MuscleForces,
    muscles: MuscleParameters,
    parameters: np.ndarray,
    angles: np.ndarray,
    step: float,
) -> Trajectory:
    """Starting point near recorded joint angles (N, 10) [rad], almost in equilibrium."""
    q = relieve_contact(forces, parameters, coordinates(forces.dynamics.name, angles))
    u = speeds(forces, q, step)
    activation, reaction = static_optimisation(forces, muscles, parameters, q, u, step)
    return Trajectory(q=q, u=u, a=activation, e=activation.copy(), reaction=reaction)
