"""Starting points: recorded motion, its speeds, and muscle activations by static optimisation.

Letters: N nodes, M muscles, Nq coordinates.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from scapulohumeral.dynamics.hill import MuscleParameters, force_derivatives
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.errors import SolveError
from scapulohumeral.model.rotations import trial_to_pose, unit_pose
from scapulohumeral.ocp.objective import Trajectory

EFFORT_WEIGHT = 0.5
MOMENT_WEIGHT = 0.01  # 1/(N m): 10 N m weigh as much as 3.4 deg of rotation
RELIEF_STEPS = 40
# Bounds of activations that a solve starts from [1].
START_ACTIVATION = (1e-3, 0.99)
SHARING_STEPS = 100
SHARING_TOLERANCE = 1e-9
# Imbalance that a start may have where rounding ends the steps, relative.
SHARING_ROUNDING = 1e-4


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
    for n in range(len(q)):
        passive = load[n] - force.passive[n] @ arms[n]
        moments = arms[n, :, :10] * force.active[n][:, None]
        activation[n] = shared_load(moments, passive[:10])
    tension = force.active * activation + force.passive
    reaction = np.einsum("nm,nmk->nk", tension, arms[:, :, 10:]) - load[:, 10:]
    return activation, reaction


def shared_load(moments: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Activations (M,) that minimise |moments^T a - target|^2 + EFFORT_WEIGHT^2 |a|^2 in bounds.

    With the unbalanced moment y = target - moments^T a, optimality says that a is moments y over
    the squared weight, clipped to the bounds. That leaves one equation for each moment, the
    gradient of a convex function with straight pieces, which Newton's method solves in a few steps.

    Parameters
    ----------
    moments : (M, K) of each muscle at full activation [N m]; target : (K,) [N m]

    Raises
    ------
    SolveError
        If the steps do not end.
    """
    pull = moments / EFFORT_WEIGHT**2
    y = np.zeros(len(target))
    for _ in range(SHARING_STEPS):
        wanted = pull @ y
        activation = np.clip(wanted, *START_ACTIVATION)
        error = y + moments.T @ activation - target
        if np.abs(error).max() <= SHARING_TOLERANCE * (1.0 + np.abs(target).max()):
            return activation
        inside = (wanted > START_ACTIVATION[0]) & (wanted < START_ACTIVATION[1])
        slope = np.eye(len(y)) + moments[inside].T @ pull[inside]
        step = np.linalg.solve(slope, error)
        y = y - _share_of_step(moments, pull, target, y, step) * step
    # Rounding may end the steps early: a start need not be exact.
    if np.abs(error).max() <= SHARING_ROUNDING * (1.0 + np.abs(target).max()):
        return activation
    raise SolveError(
        f"static optimisation: {np.abs(error).max():.1e} N m out of balance after "
        f"{SHARING_STEPS} steps; look for muscles without a moment arm that is a number"
    )


def _share_of_step(
    moments: np.ndarray, pull: np.ndarray, target: np.ndarray, y: np.ndarray, step: np.ndarray
) -> float:
    """Share of a step of :func:`shared_load` at which the convex function is least.

    Its pieces change many times along a step, so that any share at which it merely falls leads
    through them one by one.
    """

    def slope(share: float) -> float:
        moved = y - share * step
        activation = np.clip(pull @ moved, *START_ACTIVATION)
        return float((target - moved - moments.T @ activation) @ step)

    least, most = 0.0, 1.0
    while slope(most) < 0.0:
        least, most = most, 2.0 * most
    return float(brentq(slope, least, most)) if slope(least) < 0.0 < slope(most) else most


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
    return unit_pose(q) if forces.dynamics.name == "quaternion" else q


def from_motion(
    forces: MuscleForces,
    muscles: MuscleParameters,
    parameters: np.ndarray,
    angles: np.ndarray,
    step: float,
) -> Trajectory:
    """Starting point near recorded joint angles (N, 10) [rad], almost in equilibrium."""
    recorded = coordinates(forces.dynamics.name, angles)
    q = relieve_contact(forces, parameters, recorded)
    # Relief may lead out of the poses that the muscle paths were fitted to, where a fitted length
    # can be none: there the start stays with the recording.
    lengths, _ = forces.lengths(q, np.zeros((len(q), 10)))
    q = np.where(np.isfinite(lengths).all(axis=1, keepdims=True), q, recorded)
    u = speeds(forces, q, step)
    activation, reaction = static_optimisation(forces, muscles, parameters, q, u, step)
    return Trajectory(q=q, u=u, a=activation, e=activation.copy(), reaction=reaction)
