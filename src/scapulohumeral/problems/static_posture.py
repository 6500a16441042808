"""Postures of least effort: the girdle free under a still arm, by static optimisation.

Per pose: humerus and elbow stay where they are in the thorax; clavicle, scapula, activations and
glenohumeral reaction minimise squared activations and joint stability in static equilibrium. What
an optimal control problem spreads over minutes is seen here in seconds, free of rates and of the
motion before: which posture the muscles, springs and surfaces of a model would rather have.

Letters: M muscles, V = 16 + M unknowns (pose 13, reaction 3, activations).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import cyipopt
import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import SolveError
from scapulohumeral.model.rotations import Array, pose_to_trial
from scapulohumeral.ocp.cost_terms import PoseErrors, pose_errors, stability_errors
from scapulohumeral.ocp.solving.initial_guess import relieve_contact

REACTION_N = 100.0
ROW_UNITS = np.array([1.0] * 10 + [REACTION_N] * 3)
# Columns of the unknowns; the reaction follows the speeds and accelerations in the equations.
POSE, REACTION = slice(0, 13), slice(13, 16)
FIRST_ACTIVATION = 16
REACTION_COLUMNS = slice(33, 36)
EQUATION_COLUMNS = [*range(13), *range(33, 36)]
HELD, GUIDED = ("humerus", "norm"), ("clavicle", "scapula")
# Guidance on the way from the recorded posture to the free one [1].
GUIDANCE = (20.0, 1.0, 0.1, 0.0)
LARGEST_COMPONENT, LARGEST_REACTION = 1.1, 30.0
FIRST_COMPRESSION, FIRST_EFFORT = 2.0, 0.05
OPTIONS = {"print_level": 0, "sb": "yes", "max_iter": 200, "tol": 1e-6, "mu_strategy": "adaptive"}


@cache
def _pose_errors() -> PoseErrors:
    return pose_errors("quaternion")


@dataclass(frozen=True, eq=False)
class Posture:
    """What a still arm is held with.

    Attributes
    ----------
    forces, muscles, parameters : of a participant, in quaternions
    glenoid : inclination and version [rad]
    stability : weights of squared shear over compression, superior-inferior and anterior-posterior
    effort : (M,) weights of squared activations
    clavicle_point_m : distance from the sternum of the point on the clavicle that guidance follows
    """

    forces: MuscleForces
    muscles: MuscleParameters
    parameters: Array
    glenoid: tuple[float, float]
    stability: tuple[float, float]
    effort: Array
    clavicle_point_m: float


@dataclass(frozen=True, eq=False)
class StaticSolution:
    """Pose (13,), reaction (3,) [N], activations (M,) and the value of what was minimised."""

    pose: Array
    reaction_N: Array  # noqa: N815 - unit
    activation: Array
    objective: float


@dataclass(frozen=True, eq=False)
class StaticProblem:
    """The problem of one pose as IPOPT wants it; `guidance` weighs the recorded girdle."""

    posture: Posture
    reference: Array
    guidance: float

    @property
    def _rows(self) -> np.ndarray:
        return np.isin(_pose_errors().groups, HELD)

    @property
    def _guided(self) -> Array:
        return self.guidance * np.isin(_pose_errors().groups, GUIDED).astype(float)

    def _errors(self, x: Array) -> tuple[Array, Array]:
        error, slope = _pose_errors().function.first(x[None, POSE], self.reference)
        return error[0], slope[0]

    def _shear(self, x: Array) -> tuple[Array, Array]:
        ratio, slope = stability_errors().first(x[None, REACTION], np.array([self.posture.glenoid]))
        return ratio[0], slope[0]

    def _state(self, x: Array) -> tuple[Array, Array, Array]:
        """Equations' variables (1, 36), pose (1, 13) and still speeds (1, 10)."""
        z = np.concatenate([x[POSE], np.zeros(20), REACTION_N * x[REACTION]])[None]
        return z, x[None, POSE], np.zeros((1, 10))

    def objective(self, x: Array) -> float:
        """Squared activations, joint stability and guidance."""
        shear, error = self._shear(x)[0], self._errors(x)[0]
        effort = float(self.posture.effort @ x[FIRST_ACTIVATION:] ** 2)
        return effort + float(self.posture.stability @ shear**2 + self._guided @ error**2)

    def gradient(self, x: Array) -> Array:
        """Gradient of the objective, (V,)."""
        gradient = np.zeros_like(x)
        error, slope = self._errors(x)
        shear, shear_slope = self._shear(x)
        gradient[POSE] = 2.0 * (self._guided * error) @ slope
        gradient[REACTION] = 2.0 * (np.array(self.posture.stability) * shear) @ shear_slope
        gradient[FIRST_ACTIVATION:] = 2.0 * self.posture.effort * x[FIRST_ACTIVATION:]
        return gradient

    def constraints(self, x: Array) -> Array:
        """Static equilibrium (13,), then the humerus and the norms as they are."""
        z, q, u = self._state(x)
        p = self.posture
        balance = p.forces.dynamics.residual(z, p.parameters)
        balance = balance + p.forces.generalised(q, u, x[None, FIRST_ACTIVATION:], p.muscles)
        return np.concatenate([balance[0] / ROW_UNITS, self._errors(x)[0][self._rows]])

    def jacobian(self, x: Array) -> Array:
        """Dense Jacobian of the constraints, row by row."""
        z, q, u = self._state(x)
        p = self.posture
        by_z = p.forces.dynamics.jacobian(z, p.parameters)[0]
        _, by_x, by_a = p.forces.jacobian(q, u, x[None, FIRST_ACTIVATION:], p.muscles)
        held = self._errors(x)[1][self._rows]
        jacobian = np.zeros((13 + len(held), len(x)))
        jacobian[:13, POSE] = by_z[:, POSE] + by_x[0][:, POSE]
        jacobian[:13, REACTION] = REACTION_N * by_z[:, REACTION_COLUMNS]
        jacobian[:13, FIRST_ACTIVATION:] = by_a[0]
        jacobian[:13] /= ROW_UNITS[:, None]
        jacobian[13:, POSE] = held
        return jacobian.ravel()

    def hessianstructure(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower triangle."""
        return np.tril_indices(FIRST_ACTIVATION + len(self.posture.muscles.names))

    def hessian(self, x: Array, multipliers: Array, factor: float) -> Array:
        """Lower triangle of the Hessian of the Lagrangian."""
        z, q, u = self._state(x)
        p, balance = self.posture, (multipliers[:13] / ROW_UNITS)[None]
        hessian = np.zeros((len(x), len(x)))
        places = np.arange(FIRST_ACTIVATION, len(x))
        hessian[places, places] = 2.0 * factor * self.posture.effort
        units = np.repeat([1.0, REACTION_N], [13, 3])
        columns = np.ix_(EQUATION_COLUMNS, EQUATION_COLUMNS)
        by_z = p.forces.dynamics.hessian(z, balance, p.parameters)[0][columns]
        hessian[:16, :16] += by_z * np.outer(units, units)
        by_x, by_xa = p.forces.hessian(q, u, x[None, FIRST_ACTIVATION:], balance, p.muscles)
        hessian[POSE, POSE] += by_x[0][POSE, POSE]
        hessian[FIRST_ACTIVATION:, POSE] += by_xa[0][POSE].T
        hessian[REACTION, REACTION] += self._shear_curvature(x, factor)
        hessian[POSE, POSE] += self._error_curvature(x, multipliers[13:], factor)
        return hessian[self.hessianstructure()]

    def _shear_curvature(self, x: Array, factor: float) -> Array:
        weights = 2.0 * factor * np.array(self.posture.stability)
        shear, slope = self._shear(x)
        glenoid = np.array([self.posture.glenoid])
        second = stability_errors().all(x[None, REACTION], glenoid, (weights * shear)[None])[2][0]
        return second + np.einsum("k,ki,kj->ij", weights, slope, slope)

    def _error_curvature(self, x: Array, multipliers: Array, factor: float) -> Array:
        weights = 2.0 * factor * self._guided
        error, slope = self._errors(x)
        total = weights * error
        total[self._rows] += multipliers
        function = _pose_errors().function
        second = function.all(x[None, POSE], self.reference, total[None])[2][0]
        return second + np.einsum("e,ei,ej->ij", weights, slope, slope)


def static_posture(
    posture: Posture, pose: Array, guidance: Sequence[float] = GUIDANCE
) -> StaticSolution:
    """Posture of the girdle under the arm of a pose, reached from that pose step by step.

    Parameters
    ----------
    posture : Posture
    pose : (13,) recorded pose, scalar parts >= 0
    guidance : weights on clavicle and scapula of that pose, one solve after the other; 0 at the end
        gives the posture of least effort

    Raises
    ------
    SolveError                       if the last of the solves does not converge
    """
    errors = _pose_errors()
    reference = errors.reference(pose_to_trial(pose[None]), posture.clavicle_point_m)
    relieved = relieve_contact(posture.forces, posture.parameters, pose[None])[0]
    effort = np.full(len(posture.muscles.names), FIRST_EFFORT)
    cold = np.concatenate([relieved, [FIRST_COMPRESSION, 0.0, 0.0], effort])
    x, problem = cold, StaticProblem(posture, reference, 0.0)
    for weight in guidance:
        problem = replace(problem, guidance=weight)
        found, information = _solve(problem, x, pose[12])
        if information["status"] != 0:
            found, information = _solve(problem, cold, pose[12])
        if information["status"] == 0:
            x = found
    if information["status"] != 0:
        message = information["status_msg"].decode()
        raise SolveError(f"static posture: {message}. Start from a pose with less contact")
    return StaticSolution(
        pose=x[POSE],
        reaction_N=REACTION_N * x[REACTION],
        activation=x[FIRST_ACTIVATION:],
        objective=float(information["obj_val"]),
    )


def _solve(problem: StaticProblem, start: Array, elbow: float) -> tuple[Array, dict]:
    muscles = len(problem.posture.muscles.names)
    reach = np.repeat([LARGEST_COMPONENT, 0.0, LARGEST_REACTION], [12, 1, 3])
    middle = np.repeat([0.0, elbow, 0.0], [12, 1, 3])
    rows = 13 + int(np.count_nonzero(problem._rows))
    solver = cyipopt.Problem(
        n=len(start),
        m=rows,
        problem_obj=problem,
        lb=np.concatenate([middle - reach, np.zeros(muscles)]),
        ub=np.concatenate([middle + reach, np.ones(muscles)]),
        cl=np.zeros(rows),
        cu=np.zeros(rows),
    )
    for key, value in OPTIONS.items():
        solver.add_option(key, value)
    return solver.solve(start)
