"""The objective of the paper, node by node, with gradient and Hessians.

J = sum over nodes of trapezoidal weights times (tracking + activation + stability + unit norm)
  + sum over intervals of squared rates (speeds, excitations, reactions)
  + for a calibration, distance from EMG at the nodes and of muscle scalers from one.

Node terms are evaluated at the nodes, where the free variables live, so value and gradient belong
to one function of the free vector (opty's helper mixes midpoints and nodes).

Letters: N nodes, M muscles, Nq coordinates, E tracking errors, G groups of scaled muscles.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.errors import ConfigError
from scapulohumeral.ocp.cost_terms import PoseErrors, stability_errors
from scapulohumeral.ocp.emg_term import EmgTerm

SEGMENTS = ("clavicle", "scapula", "humerus", "elbow")
# Levenberg term of the Gauss-Newton Hessian: the tracking errors leave the axial rotation of the
# clavicle free, and without this term the iterates swing in it.
PROXIMAL_WEIGHT = 0.5


@dataclass(frozen=True)
class Weights:
    """Weights of the terms (paper, table of objective terms).

    Attributes
    ----------
    trajectory : J_traj, on clavicle, scapula, humerus and elbow alike
    activation : J_act
    stability : J_GH; 0 leaves the term out
    regularisation : rates of speeds [rad/s^2]
    reaction_rate : rates of joint reactions [N/s]; above 0, because the midpoint rule does not see
        alternating reactions
    excitation_rate : rates of excitations [1/s]
    quaternion_norm : J_quat
    emg : J_EMG; parameters : J_pars; 0 leaves either out
    tracked : segments that J_traj follows
    guidance : share of the weight of J_traj on the segments that are not tracked, between 0 and 1;
        predictions are reached from tracking by lowering it
    anchor : orientation of the clavicle at the first and the last node, quaternions only; 0 leaves
        it free
    """

    trajectory: float = 200.0
    activation: float = 1.0
    stability: float = 0.0
    regularisation: float = 1e-3
    reaction_rate: float = 1e-7
    excitation_rate: float = 1e-3
    quaternion_norm: float = 200.0
    emg: float = 0.0
    parameters: float = 0.0
    tracked: tuple[str, ...] = SEGMENTS
    guidance: float = 0.0
    anchor: float = 0.0

    def __post_init__(self) -> None:
        """Refuse negative weights and unknown segments."""
        for name, value in vars(self).items():
            if name != "tracked" and not value >= 0:
                raise ConfigError(f"weight {name} is {value}: it must not be negative")
        if not self.reaction_rate > 0:
            raise ConfigError(
                "weight reaction_rate is 0: expected a positive number, because the equations of "
                "motion at midpoints leave alternating joint reactions free"
            )
        unknown = set(self.tracked) - set(SEGMENTS)
        if unknown:
            raise ConfigError(f"tracked: unknown segment(s) {', '.join(sorted(unknown))}")


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Free variables by kind: q (N, Nq), u (N, 10), a (N, M), e (N, M), R (N, 3) [N].

    Scalers (2, G) multiply muscle parameters; there are none outside a calibration.
    """

    q: np.ndarray
    u: np.ndarray
    a: np.ndarray
    e: np.ndarray
    reaction: np.ndarray
    scalers: np.ndarray = field(default_factory=lambda: np.ones((2, 0)))


@dataclass(frozen=True, eq=False)
class ObjectiveHessian:
    """Blocks of the Hessian of the objective; rates couple neighbouring nodes.

    Attributes
    ----------
    q : (N, Nq, Nq) node blocks; reaction : (N, 3, 3) node blocks
    a : (N, M) second derivatives by the activations, or (N, 1) where they are all the same
    e : (N,) factor on :meth:`Objective.excitation_coupling`, the node blocks of the excitations
    rate_u, rate_e, rate_reaction : scalars w of w sum (x_{i+1} - x_i)^2 / 2
    scalers : second derivative by each scaler, the same for all
    """

    q: np.ndarray
    reaction: np.ndarray
    a: np.ndarray
    e: np.ndarray
    rate_u: float
    rate_e: float
    rate_reaction: float
    scalers: float


@dataclass(frozen=True, eq=False)
class Objective:
    """Objective of one optimal control problem.

    Attributes
    ----------
    errors : tracking errors of the formulation; reference : (N, P) their parameters
    weights : weights of the terms; step : mesh interval [s]
    glenoid : inclination and version [rad]
    superior_inferior_share : weight of squared shear along the superior-inferior axis, over that
        along the anterior-posterior one, in J_GH
    activity : (N,) factor on J_traj per node, 1 by default (0 in pauses)
    elbow_activity : (N,) the same of the elbow, None where it is no other
    emg : envelopes that J_EMG follows
    effort : (M,) factor of each muscle in J_act, or (1,) of all
    effort_power : power of the activations in J_act, 2 in the paper
    """

    errors: PoseErrors
    reference: np.ndarray
    weights: Weights
    step: float
    glenoid: tuple[float, float]
    superior_inferior_share: float
    activity: np.ndarray
    emg: EmgTerm | None = None
    elbow_activity: np.ndarray | None = None
    effort: np.ndarray = field(default_factory=lambda: np.ones(1))
    effort_power: float = 2.0

    def __post_init__(self) -> None:
        """Refuse a weight on EMG that is not there, and EMG on another mesh."""
        if self.weights.emg > 0 and self.emg is None:
            raise ConfigError(f"weight emg is {self.weights.emg}, but there is no EMG: set it to 0")
        if self.emg is not None and len(self.emg.activity) != len(self.reference):
            raise ConfigError(
                f"EMG at {len(self.emg.activity)} nodes, but the mesh has {len(self.reference)}: "
                "resample the envelopes"
            )

    def on_nodes(self, nodes: int) -> Objective:
        """The same objective on a mesh of the same duration with another number of nodes."""
        here, there = np.linspace(0, 1, len(self.reference)), np.linspace(0, 1, nodes)
        # Angles among the references may jump by a whole turn. Those of the humerus may take their
        # other form too, near which a coarse mesh follows another arm: it is a start only.
        reference = CubicSpline(here, np.unwrap(self.reference, axis=0))(there)
        return replace(
            self,
            reference=reference,
            step=float(self.step * (len(here) - 1) / (nodes - 1)),
            activity=np.interp(there, here, self.activity),
            elbow_activity=(
                None if self.elbow_activity is None else np.interp(there, here, self.elbow_activity)
            ),
            emg=None if self.emg is None else self.emg.on_nodes(nodes),
        )

    @cached_property
    def _quadrature(self) -> np.ndarray:
        """Trapezoidal weights (N,) [s]."""
        weights = np.full(len(self.reference), self.step)
        weights[[0, -1]] *= 0.5
        return weights

    @cached_property
    def _error_weights(self) -> np.ndarray:
        """Weights of the squared errors, (N, E)."""
        w, groups = self.weights, self.errors.groups
        share = {g: 1.0 if g in w.tracked else w.guidance for g in SEGMENTS}
        tracked = np.array([w.trajectory * share.get(g, 0.0) for g in groups])
        norm = np.array([w.quaternion_norm * (g == "norm") for g in groups])
        activity = np.tile(self.activity[:, None], len(groups))
        if self.elbow_activity is not None:
            activity[:, [g == "elbow" for g in groups]] = self.elbow_activity[:, None]
        weights = self._quadrature[:, None] * (activity * tracked + norm)
        anchored = [g == "anchor" for g in groups]
        # The authors weigh each end with a whole interval, whatever the rule of quadrature.
        weights[np.ix_([0, -1], anchored)] = w.anchor * self.step
        return weights

    @cached_property
    def _emg_weights(self) -> np.ndarray:
        """Weights of the squared EMG errors of each node, (N,)."""
        if self.emg is None:
            return np.zeros(len(self.reference))
        return self.weights.emg * self._quadrature * self.emg.activity

    def excitation_coupling(self, muscles: int) -> np.ndarray:
        """Node blocks (M, M) of the Hessian in the excitations of M muscles, up to a factor.

        Raises
        ------
        ConfigError                  EMG of a model with other muscles
        """
        if self.emg is None or self.weights.emg == 0:
            return np.zeros((muscles, muscles))
        if self.emg.channels.shape[1] != muscles:
            raise ConfigError(
                f"EMG channels name {self.emg.channels.shape[1]} muscles, the model has {muscles}"
            )
        return self.emg.coupling

    @cached_property
    def _stability_weights(self) -> np.ndarray:
        shares = self.weights.stability * np.array([self.superior_inferior_share, 1.0])
        return self._quadrature[:, None] * shares

    def terms(self, x: Trajectory) -> dict[str, float]:
        """Value of each term by name."""
        w = self.weights
        error, _ = self.errors.function.first(x.q, self.reference)
        cost = self._error_weights * error**2
        groups = np.array(self.errors.groups)
        terms = {g: float(cost[:, groups == g].sum()) for g in dict.fromkeys(self.errors.groups)}
        terms["activation"] = w.activation * float(self._quadrature @ self._efforts(x).sum(axis=1))
        terms["speed_rate"] = self._rate(x.u, w.regularisation)
        terms["excitation_rate"] = self._rate(x.e, w.excitation_rate)
        terms["reaction_rate"] = self._rate(x.reaction, w.reaction_rate)
        if w.stability > 0:
            ratio, _ = stability_errors().first(x.reaction, self._glenoid(x))
            terms["stability"] = float((self._stability_weights * ratio**2).sum())
        if self.emg is not None and w.emg > 0:
            terms["emg"] = float(self._emg_weights @ (self.emg.errors(x.e) ** 2).sum(axis=1))
        if w.parameters > 0:
            terms["parameters"] = w.parameters * float(((x.scalers - 1) ** 2).sum())
        return terms

    def effort_by_muscle(self, x: Trajectory) -> np.ndarray:
        """What each muscle element adds to the term of activation, (M,)."""
        return self.weights.activation * (self._quadrature @ self._efforts(x))

    def _efforts(self, x: Trajectory) -> np.ndarray:
        """Effort of each muscle element at each node, (N, M)."""
        return self.effort * np.abs(x.a) ** self.effort_power

    def value(self, x: Trajectory) -> float:
        """Objective."""
        return sum(self.terms(x).values())

    def gradient(self, x: Trajectory) -> Trajectory:
        """Gradient with respect to each kind of variable."""
        w = self.weights
        error, jacobian = self.errors.function.first(x.q, self.reference)
        reaction = self._rate_gradient(x.reaction, w.reaction_rate)
        if w.stability > 0:
            ratio, ratio_r = stability_errors().first(x.reaction, self._glenoid(x))
            reaction += np.einsum("nk,nkr->nr", 2 * self._stability_weights * ratio, ratio_r)
        excitation = self._rate_gradient(x.e, w.excitation_rate)
        if self.emg is not None and w.emg > 0:
            slope = 2 * self._emg_weights[:, None] * self.emg.errors(x.e)
            excitation += slope @ self.emg.channels
        return Trajectory(
            q=np.einsum("ne,neq->nq", 2 * self._error_weights * error, jacobian),
            u=self._rate_gradient(x.u, w.regularisation),
            a=w.activation * self._quadrature[:, None] * self.effort * self._effort_slope(x.a),
            e=excitation,
            reaction=reaction,
            scalers=2 * w.parameters * (x.scalers - 1),
        )

    def hessian(self, x: Trajectory, exact: bool) -> ObjectiveHessian:
        """Exact Hessian, or the Gauss-Newton one: no curvature of the errors, slightly damped."""
        error, jacobian = self.errors.function.first(x.q, self.reference)
        h_q = np.einsum(
            "ne,nei,nej->nij", 2 * self._error_weights, jacobian, jacobian, optimize=True
        )
        if not exact:
            h_q += PROXIMAL_WEIGHT * np.eye(h_q.shape[1])
        if exact:
            weights = 2 * self._error_weights * error
            h_q += self.errors.function.all(x.q, self.reference, weights)[2]
        h_r = np.zeros((len(x.q), 3, 3))
        if self.weights.stability > 0:
            glenoid, weights = self._glenoid(x), 2 * self._stability_weights
            ratio, ratio_r = stability_errors().first(x.reaction, glenoid)
            h_r += np.einsum("nk,nki,nkj->nij", weights, ratio_r, ratio_r)
            if exact:
                h_r += stability_errors().all(x.reaction, glenoid, weights * ratio)[2]
        return ObjectiveHessian(
            q=h_q,
            reaction=h_r,
            a=self.weights.activation
            * self._quadrature[:, None]
            * (self.effort * self._effort_curvature(x.a)),
            e=2 * self._emg_weights,
            rate_u=2 * self.weights.regularisation / self.step,
            rate_e=2 * self.weights.excitation_rate / self.step,
            rate_reaction=2 * self.weights.reaction_rate / self.step,
            scalers=2 * self.weights.parameters,
        )

    def _effort_slope(self, activation: np.ndarray) -> np.ndarray:
        """Derivative (N, M) of powers of activations, which solvers leave below 0 by 1e-8."""
        if self.effort_power == 2.0:
            return 2.0 * activation
        power = self.effort_power
        return power * np.sign(activation) * np.abs(activation) ** (power - 1.0)

    def _effort_curvature(self, activation: np.ndarray) -> np.ndarray:
        """Second derivative (N, M), or (1, 1) where it is the same everywhere."""
        if self.effort_power == 2.0:
            return np.full((1, 1), 2.0)
        power = self.effort_power
        return power * (power - 1.0) * np.abs(activation) ** (power - 2.0)

    def _glenoid(self, x: Trajectory) -> np.ndarray:
        return np.tile(self.glenoid, (len(x.q), 1))

    def _rate(self, x: np.ndarray, weight: float) -> float:
        return weight / self.step * float((np.diff(x, axis=0) ** 2).sum())

    def _rate_gradient(self, x: np.ndarray, weight: float) -> np.ndarray:
        gradient = np.zeros_like(x)
        difference = 2 * weight / self.step * np.diff(x, axis=0)
        gradient[1:] += difference
        gradient[:-1] -= difference
        return gradient
