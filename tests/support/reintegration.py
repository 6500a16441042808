"""Integrate a stored solution again, by a method that has nothing in common with collocation.

Every mesh interval starts from its own left node and is followed to its right one under the stored
muscle forces. What is missed there is the error of the mesh, not of the solver. The equations are
stiff (the slightest rotation of the clavicle about its own axis decays in 6 microseconds), so the
integrator is implicit: Radau IIA of order 5 from SciPy, with error control.

Letters: I intervals, Nq coordinates, X = Nq + 10 states, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.sparse import block_diag

from scapulohumeral.dynamics.hill import MuscleParameters, activation_rate
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.ocp.solution import Solution

RELATIVE, ABSOLUTE = 1e-5, 1e-7
PERTURBATION = 1e-6
QUATERNIONS = (slice(0, 4), slice(4, 8), slice(8, 12))


@dataclass(frozen=True, eq=False)
class Drift:
    """What re-integration misses at the end of each interval.

    Attributes
    ----------
    q : (I, Nq) coordinates; u : (I, 10) speeds [rad/s]; norm : (I, 3) of the quaternions, empty in
        Euler angles
    """

    q: np.ndarray
    u: np.ndarray
    norm: np.ndarray


def reintegrated(
    solution: Solution, forces: MuscleForces, parameters: np.ndarray, every: int = 1
) -> Drift:
    """Follow intervals from their left nodes under linearly interpolated muscle forces.

    `every` second, third ... interval; each is followed by itself.
    """
    nq = solution.q.shape[1]
    nodes = np.hstack([solution.q, solution.u])
    left, right = nodes[:-1:every], nodes[1::every]
    before, after = solution.muscle_force_N[:-1:every], solution.muscle_force_N[1::every]
    step = np.diff(solution.time_s)[::every, None]

    def rates(phase: float, states: np.ndarray) -> np.ndarray:
        """States (k * I, X) of k copies of all intervals, in units per interval."""
        copies = len(states) // len(step)
        tension = (1.0 - phase) * before + phase * after
        rate = state_rate(states, np.tile(tension, (copies, 1)), forces, parameters)
        return np.tile(step, (copies, 1)) * rate

    shape = left.shape
    end = solve_ivp(
        lambda phase, y: rates(phase, y.reshape(shape)).ravel(),
        (0.0, 1.0),
        left.ravel(),
        method="Radau",
        jac=lambda phase, y: _jacobian(rates, phase, y.reshape(shape)),
        rtol=RELATIVE,
        atol=ABSOLUTE,
        t_eval=[1.0],
    )
    assert end.success, end.message
    states = end.y[:, -1].reshape(shape)
    quaternions = QUATERNIONS if nq == 13 else ()
    norms = [np.linalg.norm(states[:, part], axis=1) - 1.0 for part in quaternions]
    missed = states - right
    return Drift(missed[:, :nq], missed[:, nq:], np.array(norms).T)


def state_rate(
    states: np.ndarray, tension: np.ndarray, forces: MuscleForces, parameters: np.ndarray
) -> np.ndarray:
    """Time derivatives (k, X) of states under muscle forces (k, M), from the implicit equations.

    The equations are linear in accelerations and joint reactions, which are solved for.
    """
    dynamics, nq = forces.dynamics, states.shape[1] - 10
    q, u = states[:, :nq], states[:, nq:]
    at_rest = np.hstack([states, np.zeros((len(states), 13))])
    linear = dynamics.jacobian(at_rest, parameters)[:, :, nq + 10 : nq + 23]
    pull = -np.einsum("nm,nmk->nk", tension, forces.gradients(q))
    known = dynamics.residual(at_rest, parameters) + pull
    unknown = np.linalg.solve(linear, -known[..., None])[..., 0]
    return np.hstack([np.einsum("nij,nj->ni", dynamics.rate_map(q), u), unknown[:, :10]])


def _jacobian(rates, phase: float, states: np.ndarray):
    """Sparse derivative of the rates of all intervals by their own states, for Newton's method."""
    count, size = states.shape
    shifted = [states, *(states + shift for shift in PERTURBATION * np.eye(size))]
    first, *others = rates(phase, np.concatenate(shifted)).reshape(size + 1, count, size)
    blocks = (np.array(others) - first) / PERTURBATION
    return block_diag(list(blocks.transpose(1, 2, 0)), format="csc")


def midpoint_residuals(
    solution: Solution, forces: MuscleForces, parameters: np.ndarray, muscles: MuscleParameters
) -> dict[str, float]:
    """Largest residuals of the discretised equations, written down once more.

    Returns kinematic [1/s], torques [N m], forces on the humeral head [N], activation [1/s].
    """
    step = np.diff(solution.time_s)[:, None]
    parts = (solution.q, solution.u, solution.activation, solution.excitation, solution.reaction_N)
    q, u, a, e, reaction = (0.5 * (part[:-1] + part[1:]) for part in parts)
    q_rate, u_rate, a_rate = (np.diff(part, axis=0) / step for part in parts[:3])
    turning = q_rate - np.einsum("nij,nj->ni", forces.dynamics.rate_map(q), u)
    equations = forces.dynamics.residual(np.hstack([q, u, u_rate, reaction]), parameters)
    equations = equations + forces.generalised(q, u, a, muscles)
    activating = a_rate - activation_rate(e, a, muscles)
    found = (turning, equations[:, :10], equations[:, 10:], activating)
    names = ("kinematic", "torque", "force", "activation")
    return {name: float(np.abs(v).max()) for name, v in zip(names, found, strict=True)}
