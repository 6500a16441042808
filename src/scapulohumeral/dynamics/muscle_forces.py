"""Generalised forces of all muscles with exact first and second derivatives.

A muscle of tension F pulls with the generalised force -F dL/dx, where x are the ten rotations
behind the speeds (dL/dx = T(q)^T dL/dq) and the three virtual translations of the humeral head
(dL/dt), so that its moment arms and its force on the glenohumeral joint come from one function.

Letters: N nodes, M muscles, Nq coordinates, Nu = 10 speeds, K = 13 equations, F features,
X = Nq + Nu.

The Hessian rests on one observation: multipliers . force = -sum_m F_m W_m, where
W_m = dL_m/dq . T(q) lambda_u + dL_m/dt . lambda_t is the lengthening velocity that the multipliers
would cause, exactly as V_m is the one that the speeds cause. Four scalars per muscle, all linear
in the features, carry every derivative: y (length or squared length), its rates along both
motions, and its rate along the translation.

Parameters p of a muscle are, in this order, its maximal isometric force [N] and its optimal fibre
length [m]: an axis of length 2 in front of the muscles. They act on F alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy import sparse

from scapulohumeral.dynamics.compiled import CompiledDynamics
from scapulohumeral.dynamics.hill import (
    MuscleParameters,
    fibre_length_derivatives,
    force_derivatives,
)
from scapulohumeral.dynamics.path_features import FeaturePoint, MonomialFeatures, PathFeatures
from scapulohumeral.model.muscle_paths.geometry import MuscleGeometry

# Most nodes that are evaluated together: what they need then stays in the cache of a processor.
# With 273 of them at once, second derivatives take a third longer, first ones a sixth.
BLOCK = 64


@dataclass(frozen=True, eq=False)
class _State:
    """Quantities of one evaluation point, shared by forces and derivatives.

    ``derived`` holds those that derivatives alone need, once one of them did.
    """

    q: np.ndarray
    u: np.ndarray
    rate_map: np.ndarray
    rate: np.ndarray
    features: FeaturePoint
    gradient: np.ndarray
    y_q: np.ndarray
    t_value: np.ndarray
    links: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]
    kappa: tuple[np.ndarray, np.ndarray, np.ndarray]
    y_rate: np.ndarray
    length: np.ndarray
    velocity: np.ndarray
    derived: dict[str, np.ndarray] = field(default_factory=dict)


@dataclass(frozen=True)
class _VirtualWork:
    """What multipliers add to a state.

    ``ghost`` is T(q) lambda_u; ``work`` is W with two derivatives by y, (N, M); ``vectors`` are the
    gradients of the four scalars with respect to (q, u), (N, M, 4, X).
    """

    ghost: np.ndarray
    work: np.ndarray
    work_y: np.ndarray
    work_yy: np.ndarray
    vectors: np.ndarray


@dataclass(frozen=True)
class ParameterHessian:
    """Second derivatives of multipliers . generalised forces that involve muscle parameters.

    Attributes
    ----------
    x : by (q, u) and parameter, (N, X, 2, M)
    a : by the activation and a parameter of one muscle, (N, 2, M)
    p : by two parameters of one muscle, (N, 2, 2, M)
    """

    x: np.ndarray
    a: np.ndarray
    p: np.ndarray


@dataclass(frozen=True)
class MuscleForces:
    """Muscle forces of one participant in one formulation."""

    dynamics: CompiledDynamics
    geometry: MuscleGeometry

    @cached_property
    def features(self) -> PathFeatures:
        """The features behind all lengths."""
        return PathFeatures(MonomialFeatures(self.geometry.exponents), self.dynamics)

    def lengths(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Muscle-tendon lengths [m] and lengthening velocities [m/s], each (N, M)."""
        state = self._state(q, u)
        return state.length, state.velocity

    def gradients(self, q: np.ndarray) -> np.ndarray:
        """dL/dx, shape (N, M, 13): rotations behind the speeds [m/rad], then translations [1]."""
        return self._arms(self._state(q, np.zeros((len(q), 10))))

    def tension(
        self, q: np.ndarray, u: np.ndarray, activation: np.ndarray, muscles: MuscleParameters
    ) -> np.ndarray:
        """Muscle force, shape (N, M) [N], for q (N, Nq), u (N, Nu), activation (N, M) [1]."""
        state = self._state(q, u)
        force = force_derivatives(state.length, state.velocity, muscles)
        return force.active * activation + force.passive

    def generalised(
        self, q: np.ndarray, u: np.ndarray, activation: np.ndarray, muscles: MuscleParameters
    ) -> np.ndarray:
        """Generalised muscle forces, shape (N, K), arguments as in :meth:`tension`.

        The first ten are conjugate to the speeds [N m]; the last three are the force on the
        humeral head along scapula axes [N].
        """
        [total] = self._by_blocks(
            lambda s, activation: (self._generalised(s, activation, muscles),), q, u, activation
        )
        return total

    def _generalised(
        self, s: _State, activation: np.ndarray, muscles: MuscleParameters
    ) -> np.ndarray:
        force = force_derivatives(s.length, s.velocity, muscles)
        tension = force.active * activation + force.passive
        return -np.einsum("nm,nmk->nk", tension, self._arms(s))

    def jacobian(
        self, q: np.ndarray, u: np.ndarray, activation: np.ndarray, muscles: MuscleParameters
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Generalised forces as in :meth:`generalised`, and their derivatives.

        Returns (N, K); d/d(q, u) (N, K, X); d/d activation (N, K, M).
        """
        forces, by_x, by_a = self._by_blocks(
            lambda s, activation: self._jacobian(s, activation, muscles), q, u, activation
        )
        return forces, by_x, by_a

    def jacobian_with_parameters(
        self, q: np.ndarray, u: np.ndarray, activation: np.ndarray, muscles: MuscleParameters
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """As :meth:`jacobian`, and d/d parameters (N, K, 2, M)."""
        s = self._state(q, u)
        force = force_derivatives(s.length, s.velocity, muscles)
        tension = force.active * activation + force.passive
        fibre = fibre_length_derivatives(force, activation, s.length, s.velocity, muscles)
        by_parameter = np.stack([tension / muscles.max_isometric_force, fibre.first], axis=1)
        d_p = -self._arms(s).transpose(0, 2, 1)[:, :, None] * by_parameter[:, None]
        return *self._jacobian(s, activation, muscles), d_p

    def _jacobian(
        self, s: _State, activation: np.ndarray, muscles: MuscleParameters
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        force = force_derivatives(s.length, s.velocity, muscles)
        tension = force.active * activation + force.passive
        f_l = force.active_l * activation + force.passive_l
        f_v = force.active_v * activation
        arms = self._arms(s)
        n, nq = s.q.shape
        length_x = np.concatenate(
            [s.links[1][..., None] * s.y_q, np.zeros((n, arms.shape[1], 10))], axis=2
        )
        rate_x = self._rate_gradient(s)
        velocity_x = s.links[1][..., None] * rate_x
        velocity_x[:, :, :nq] += (s.links[2] * s.y_rate)[..., None] * s.y_q
        force_x = f_l[..., None] * length_x + f_v[..., None] * velocity_x
        d_x = -np.matmul(arms.transpose(0, 2, 1), force_x)
        d_x[:, :, :nq] -= self._arm_derivative(s, tension)
        return (
            -np.einsum("nm,nmk->nk", tension, arms),
            d_x,
            -(force.active[..., None] * arms).transpose(0, 2, 1),
        )

    def hessian(
        self,
        q: np.ndarray,
        u: np.ndarray,
        activation: np.ndarray,
        multipliers: np.ndarray,
        muscles: MuscleParameters,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Second derivatives of multipliers . generalised forces, multipliers (N, K).

        Returns d2/d(q, u)2, shape (N, X, X), and d2/d(q, u) d activation, shape (N, X, M).
        """

        def of_block(s: _State, activation: np.ndarray, multipliers: np.ndarray):
            work = self._virtual_work(s, multipliers)
            return self._hessian(s, work, activation, multipliers, muscles)

        by_x, by_xa = self._by_blocks(of_block, q, u, activation, multipliers)
        return by_x, by_xa

    def hessian_with_parameters(
        self,
        q: np.ndarray,
        u: np.ndarray,
        activation: np.ndarray,
        multipliers: np.ndarray,
        muscles: MuscleParameters,
    ) -> tuple[np.ndarray, np.ndarray, ParameterHessian]:
        """As :meth:`hessian`, and the second derivatives that involve muscle parameters."""
        s = self._state(q, u)
        work = self._virtual_work(s, multipliers)
        h, h_a = self._hessian(s, work, activation, multipliers, muscles)
        return h, h_a, self._parameter_hessian(s, work, activation, muscles)

    def _hessian(self, s: _State, work: _VirtualWork, activation, multipliers, muscles):
        gradient, mixed, second = self._scalar_derivatives(s, work, activation, muscles)
        vectors = work.vectors
        n, m, _, x = vectors.shape
        weighted = np.einsum("nmkl,nmlx->nmkx", second, vectors).reshape(n, 4 * m, x)
        h = np.matmul(vectors.reshape(n, 4 * m, x).transpose(0, 2, 1), weighted)
        h += self._feature_curvature(s, work.ghost, multipliers, gradient)
        h_a = np.einsum("nmk,nmkx->nxm", mixed, vectors)
        return h, h_a

    def _parameter_hessian(
        self, s: _State, work: _VirtualWork, activation: np.ndarray, muscles: MuscleParameters
    ) -> ParameterHessian:
        d = force_derivatives(s.length, s.velocity, muscles)
        f_l, f_v = d.active_l * activation + d.passive_l, d.active_v * activation
        by_length = fibre_length_derivatives(d, activation, s.length, s.velocity, muscles)
        force, fmax = d.active * activation + d.passive, muscles.max_isometric_force
        scalars = np.stack(
            [
                _work_gradient(s, work, force / fmax, f_l / fmax, f_v / fmax),
                _work_gradient(s, work, by_length.first, by_length.l, by_length.v),
            ],
            axis=-1,
        )
        twice = np.zeros((len(force), 2, 2, len(fmax)))
        twice[:, 0, 1] = twice[:, 1, 0] = -by_length.first / fmax * work.work
        twice[:, 1, 1] = -by_length.second * work.work
        return ParameterHessian(
            x=np.einsum("nmkp,nmkx->nxpm", scalars, work.vectors),
            a=-np.stack([d.active / fmax, by_length.active], axis=1) * work.work[:, None],
            p=twice,
        )

    @cached_property
    def _length(self) -> sparse.csr_matrix:
        """Coefficients C of the lengths, (M, F)."""
        return sparse.csr_matrix(self.geometry.length)

    @cached_property
    def _translation(self) -> sparse.csr_matrix:
        """Coefficients D of the translation derivatives, (3 M, F), axis by axis."""
        return sparse.csr_matrix(self.geometry.translation.reshape(-1, self._length.shape[1]))

    def _translation_gradient(self, s: _State) -> np.ndarray:
        """Gradients of D f, shape (N, 3, M, Nq)."""
        if "translation" not in s.derived:
            flat = _contract(self._translation, s.gradient)
            s.derived["translation"] = flat.reshape(len(flat), 3, -1, flat.shape[2])
        return s.derived["translation"]

    @cached_property
    def _latest(self) -> list[_State]:
        return []

    def _by_blocks(
        self, function: Callable[..., tuple], q: np.ndarray, u: np.ndarray, *others: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Results (N, ...) of a function of a state and of parts of other arrays (N, ...)."""
        count = max(-(-len(q) // BLOCK), 1)
        blocks = zip(*(np.array_split(each, count) for each in (q, u, *others)), strict=True)
        parts = [function(self._state(at, moved, count), *rest) for at, moved, *rest in blocks]
        return tuple(np.concatenate(each) for each in zip(*parts, strict=True))

    def _state(self, q: np.ndarray, u: np.ndarray, kept: int = 1) -> _State:
        """The state at a point, or at a block of its nodes; the last ones are kept.

        Constraints, Jacobian and Hessian of one iterate share them, and so do all muscle parameters
        that are tried at one solution.
        """
        for state in self._latest:
            if np.array_equal(state.q, q) and np.array_equal(state.u, u):
                return state
        self._latest.append(self._new_state(q.copy(), u.copy()))
        del self._latest[:-kept]
        return self._latest[-1]

    def _new_state(self, q: np.ndarray, u: np.ndarray) -> _State:
        features = self.features.at(q)
        feature, gradient = features.values, features.gradients()
        g = self.geometry
        y = feature @ self._length.T
        y_q = _contract(self._length, gradient)
        t_value = (feature @ self._translation.T).reshape(len(q), 3, -1).transpose(0, 2, 1)
        with np.errstate(invalid="ignore"):
            # Not a number far outside the unit sphere: IPOPT then shortens its step.
            root = np.sqrt(np.where(g.squared, y, 1.0))
        links = (
            np.where(g.squared, root, y),
            np.where(g.squared, 0.5 / root, 1.0),
            np.where(g.squared, -0.25 / root**3, 0.0),
            np.where(g.squared, 0.375 / root**5, 0.0),
        )
        kappa = (
            np.where(g.squared, 1.0 / root, 1.0),
            np.where(g.squared, -0.5 / root**3, 0.0),
            np.where(g.squared, 0.75 / root**5, 0.0),
        )
        rate_map = self.dynamics.rate_map(q)
        rate = np.einsum("nij,nj->ni", rate_map, u)
        y_rate = np.einsum("nmi,ni->nm", y_q, rate)
        return _State(
            q,
            u,
            rate_map,
            rate,
            features,
            gradient,
            y_q,
            t_value,
            links,
            kappa,
            y_rate,
            links[0],
            links[1] * y_rate,
        )

    def _arms(self, s: _State) -> np.ndarray:
        rotation = s.links[1][..., None] * np.matmul(s.y_q, s.rate_map)
        return np.concatenate([rotation, s.kappa[0][..., None] * s.t_value], axis=2)

    def _rate_jacobian(self, vector: np.ndarray) -> np.ndarray:
        """d(T(q) vector)/dq, shape (N, Nq, Nq), for vector (N, Nu)."""
        return np.einsum("ijk,nj->nik", self.dynamics.kinematics_linear, vector)

    def _rate_gradient(self, s: _State) -> np.ndarray:
        """Gradient of dy/dq . T(q) u with respect to (q, u), shape (N, M, X)."""
        if "rate" not in s.derived:
            jdot = s.features.directional(s.rate)
            d_q = _contract(self._length, jdot) + np.matmul(s.y_q, self._rate_jacobian(s.u))
            s.derived["rate"] = np.concatenate([d_q, np.matmul(s.y_q, s.rate_map)], axis=2)
        return s.derived["rate"]

    def _arm_derivative(self, s: _State, tension: np.ndarray) -> np.ndarray:
        """sum_m F_m d(arms)/dq at constant F, shape (N, K, Nq)."""
        curvature = s.features.curvature((tension * s.links[1]) @ self._length)
        curvature += np.matmul(s.y_q.transpose(0, 2, 1), (tension * s.links[2])[..., None] * s.y_q)
        slope = np.einsum("nm,nmi->ni", tension * s.links[1], s.y_q)
        rotation = np.matmul(s.rate_map.transpose(0, 2, 1), curvature)
        rotation += np.einsum("ni,ijk->njk", slope, self.dynamics.kinematics_linear)
        translation = np.einsum(
            "nm,nkmi->nki", tension * s.kappa[0], self._translation_gradient(s), optimize=True
        )
        translation += np.einsum(
            "nm,nmk,nmi->nki", tension * s.kappa[1], s.t_value, s.y_q, optimize=True
        )
        return np.concatenate([rotation, translation], axis=1)

    def _virtual_work(self, s: _State, multipliers: np.ndarray) -> _VirtualWork:
        _, l1, l2, l3 = s.links
        k0, k1, k2 = s.kappa
        ghost = np.einsum("nij,nj->ni", s.rate_map, multipliers[:, :10])
        ghost_rate = np.einsum("nmi,ni->nm", s.y_q, ghost)
        delta = np.einsum("nk,nmk->nm", multipliers[:, 10:], s.t_value)
        return _VirtualWork(
            ghost=ghost,
            work=l1 * ghost_rate + k0 * delta,
            work_y=l2 * ghost_rate + k1 * delta,
            work_yy=l3 * ghost_rate + k2 * delta,
            vectors=self._scalar_gradients(s, ghost, multipliers),
        )

    def _scalar_derivatives(self, s: _State, work: _VirtualWork, activation, muscles):
        """Derivatives of -F W with respect to (y, rate, ghost rate, translation rate).

        Returns gradient (N, M, 4), mixed with activation (N, M, 4), second (N, M, 4, 4).
        """
        _, l1, l2, l3 = s.links
        k0, k1, _ = s.kappa
        v_y, v_yy = l2 * s.y_rate, l3 * s.y_rate
        d = force_derivatives(s.length, s.velocity, muscles)
        force = d.active * activation + d.passive
        f_l, f_v = d.active_l * activation + d.passive_l, d.active_v * activation
        f_ll = d.active_ll * activation + d.passive_ll
        f_lv, f_vv = d.active_lv * activation, d.active_vv * activation
        f_y, f_r = f_l * l1 + f_v * v_y, f_v * l1
        f_yy = f_ll * l1**2 + 2 * f_lv * l1 * v_y + f_vv * v_y**2 + f_l * l2 + f_v * v_yy
        f_yr = f_lv * l1**2 + f_vv * v_y * l1 + f_v * l2
        gradient = _work_gradient(s, work, force, f_l, f_v)
        mixed = _work_gradient(s, work, d.active, d.active_l, d.active_v)
        second = np.zeros((*force.shape, 4, 4))
        second[..., 0, 0] = f_yy * work.work + 2 * f_y * work.work_y + force * work.work_yy
        second[..., 0, 1] = second[..., 1, 0] = f_yr * work.work + f_r * work.work_y
        second[..., 0, 2] = second[..., 2, 0] = f_y * l1 + force * l2
        second[..., 0, 3] = second[..., 3, 0] = f_y * k0 + force * k1
        second[..., 1, 1] = f_vv * l1**2 * work.work
        second[..., 1, 2] = second[..., 2, 1] = f_r * l1
        second[..., 1, 3] = second[..., 3, 1] = f_r * k0
        return gradient, mixed, -second

    def _scalar_gradients(self, s: _State, ghost, multipliers) -> np.ndarray:
        """Gradients of the four scalars with respect to (q, u), shape (N, M, 4, X)."""
        n, m, nq = s.y_q.shape
        vectors = np.zeros((n, m, 4, nq + 10))
        vectors[:, :, 0, :nq] = s.y_q
        vectors[:, :, 1] = self._rate_gradient(s)
        jdot = s.features.directional(ghost)
        vectors[:, :, 2, :nq] = _contract(self._length, jdot)
        vectors[:, :, 2, :nq] += np.matmul(s.y_q, self._rate_jacobian(multipliers[:, :10]))
        vectors[:, :, 3, :nq] = np.einsum(
            "nk,nkmi->nmi", multipliers[:, 10:], self._translation_gradient(s), optimize=True
        )
        return vectors

    def _feature_curvature(self, s: _State, ghost, multipliers, gradient) -> np.ndarray:
        """Second derivatives of the four scalars, weighted and summed over muscles, (N, X, X)."""
        n, nq = s.q.shape
        c_y, c_r, c_w = (gradient[..., k] @ self._length for k in range(3))
        pulls = np.einsum("nm,nk->nkm", gradient[..., 3], multipliers[:, 10:]).reshape(n, -1)
        c_t = pulls @ self._translation
        h_plain, h_r, h_w = (s.features.curvature(c) for c in (c_y + c_t, c_r, c_w))
        third = s.features.directional_curvature((s.rate, c_r), (ghost, c_w))
        cross = np.matmul(h_r, self._rate_jacobian(s.u))
        cross += np.matmul(h_w, self._rate_jacobian(multipliers[:, :10]))
        h = np.zeros((n, nq + 10, nq + 10))
        h[:, :nq, :nq] = h_plain + third + cross + cross.transpose(0, 2, 1)
        slope = np.einsum("nf,nfi->ni", c_r, s.gradient)
        mixed = np.matmul(h_r, s.rate_map)
        mixed += np.einsum("ni,ijk->nkj", slope, self.dynamics.kinematics_linear)
        h[:, :nq, nq:] = mixed
        h[:, nq:, :nq] = mixed.transpose(0, 2, 1)
        return h


def _work_gradient(s: _State, work: _VirtualWork, force, force_l, force_v) -> np.ndarray:
    """Gradient of -F W by the four scalars, (N, M, 4), for F (N, M) with slopes by L and V."""
    _, l1, l2, _ = s.links
    f_y, f_r = force_l * l1 + force_v * (l2 * s.y_rate), force_v * l1
    return -np.stack(
        [f_y * work.work + force * work.work_y, f_r * work.work, force * l1, force * s.kappa[0]],
        axis=-1,
    )


def _contract(coefficients: sparse.csr_matrix, gradient: np.ndarray) -> np.ndarray:
    """Gradients (N, m, Nq) of m linear functions (m, F) of features with gradients (N, F, Nq)."""
    n, f, nq = gradient.shape
    columns = coefficients @ gradient.transpose(1, 0, 2).reshape(f, n * nq)
    return np.ascontiguousarray(columns.reshape(-1, n, nq).transpose(1, 0, 2))
