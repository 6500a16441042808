"""Starting points: recorded motion, its speeds, and muscle activations by static optimisation.

Letters: N nodes, M muscles, Nq coordinates.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import lsq_linear

from scapulohumeral.dynamics.hill import MuscleParameters, force_derivatives
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.transcription import REACTION_UNIT_N

EFFORT_WEIGHT = 0.5


def coordinates(formulation: str, angles: np.ndarray) -> np.ndarray:
    """Generalised coordinates (N, Nq) of joint angles (N, 10) [rad]."""
    return trial_to_pose(angles) if formulation == "quaternion" else np.array(angles)


def speeds(forces: MuscleForces, q: np.ndarray, step: float) -> np.ndarray:
    """Generalised speeds (N, 10) [rad/s] of coordinates (N, Nq) at a mesh interval [s]."""
    rate = np.gradient(q, step, axis=0)
    return np.einsum("nji,nj->ni", np.linalg.pinv(forces.dynamics.rate_map(q)).transpose(0, 2, 1), rate)


def static_optimisation(
    forces: MuscleForces,
    muscles: MuscleParameters,
    parameters: np.ndarray,
    q: np.ndarray,
    u: np.ndarray,
    step: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Activations (N, M) and glenohumeral reactions (N, 3) [kN] for a prescribed motion.

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
    return activation, reaction / REACTION_UNIT_N


def from_motion(
    forces: MuscleForces,
    muscles: MuscleParameters,
    parameters: np.ndarray,
    angles: np.ndarray,
    step: float,
) -> Trajectory:
    """Starting point that follows recorded joint angles (N, 10) [rad]."""
    q = coordinates(forces.dynamics.name, angles)
    u = speeds(forces, q, step)
    activation, reaction = static_optimisation(forces, muscles, parameters, q, u, step)
    return Trajectory(q=q, u=u, a=activation, e=activation.copy(), reaction=reaction)
