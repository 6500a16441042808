"""Direct collocation with the midpoint rule: constraints, Jacobian and curvature.

Unknowns and equations are laid out as opty does it: for unknowns see :class:`Layout`; constraints
hold one equation of motion after the other over all intervals, then the instance constraints.

Letters: N nodes, I = N - 1 intervals, M muscles, Nq coordinates, X = Nq + 10, K = 13 dynamic
equations, G groups of scaled muscles. Equations in order: Nq kinematic, 13 dynamic (three auxiliary
ones in the layout's unit of reactions), M activation.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters, activation_rate
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.ocp.layout import Layout
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.scalers import Scalers

# What follows from the equations and the unknowns alone, whatever the numbers in them.
PATTERNS = (
    "jacobian_structure",
    "_muscle_pattern",
    "_x_pattern",
    "_x_by_muscle",
    "_s_pattern",
    "_xs_pattern",
    "_xa_pattern",
    "_xx_pattern",
)


@dataclass(frozen=True, eq=False)
class Curvature:
    """Second derivatives of multipliers . constraints per interval.

    All but ``x`` are the same for both nodes of the interval, and for every combination of nodes.

    Attributes
    ----------
    x : (2, 2, I, X, X), by left/right node of both variables
    x_a : (I, X, M)
    a_e, e_e : (I, M)
    x_s : (I, X, 2, G)
    a_s : (I, 2, M), each muscle with the scalers of its group
    s_s : (2, 2, G), summed over the intervals
    """

    x: np.ndarray
    x_a: np.ndarray
    a_e: np.ndarray
    e_e: np.ndarray
    x_s: np.ndarray
    a_s: np.ndarray
    s_s: np.ndarray


@dataclass(frozen=True, eq=False)
class Collocation:
    """Discretised equations of motion of one participant and condition.

    Attributes
    ----------
    forces : muscle forces, with the equations of motion
    muscles : run-time muscle parameters; parameters : run-time dynamics parameters (P,)
    layout : positions in the free vector; step : mesh interval [s]
    scalers : groups whose muscle parameters are unknown
    """

    forces: MuscleForces
    muscles: MuscleParameters
    parameters: np.ndarray
    layout: Layout
    step: float
    scalers: Scalers

    def with_patterns_of(self, other: Collocation) -> Self:
        """The same, with the patterns of the same equations and unknowns with other numbers."""
        known = vars(other)
        vars(self).update({name: known[name] for name in PATTERNS if name in known})
        return self

    @property
    def number_of_equations(self) -> int:
        """Equations of motion per interval."""
        return self.layout.coordinates + 13 + self.layout.muscles

    @cached_property
    def _row_units(self) -> np.ndarray:
        """What the dynamic equations are divided by, (13,): reactions then count as unknowns do."""
        return np.array([1.0] * 10 + [self.layout.reaction_unit_N] * 3)

    def scaled_muscles(self, x: Trajectory) -> MuscleParameters:
        """Muscle parameters with the scalers of a point put on."""
        return self.scalers.apply(self.muscles, x.scalers)

    def constraints(self, free: np.ndarray) -> np.ndarray:
        """Residuals of all equations, shape (equations * I,)."""
        x = self.layout.split(free)
        mid, z = self._midpoint(x)
        kinematic = np.diff(x.q, axis=0) / self.step - np.einsum(
            "nij,nj->ni", self.forces.dynamics.rate_map(mid.q), mid.u
        )
        dynamic = self.forces.dynamics.residual(z, self.parameters)
        dynamic = dynamic + self.forces.generalised(mid.q, mid.u, mid.a, self.scaled_muscles(mid))
        activation = np.diff(x.a, axis=0) / self.step - activation_rate(mid.e, mid.a, self.muscles)
        return np.hstack([kinematic, dynamic / self._row_units, activation]).T.ravel()

    def jacobian(self, free: np.ndarray) -> np.ndarray:
        """Non-zero values (Z,) at a free vector (n,), in order of :attr:`jacobian_structure`."""
        x = self.layout.split(free)
        mid, z = self._midpoint(x)
        nq, h = self.layout.coordinates, self.step
        dynamics = self.forces.dynamics
        d_z = dynamics.jacobian(z, self.parameters)
        d_x, d_a, d_s = self._muscle_jacobian(mid)
        d_x += d_z[:, :, : nq + 10]
        units = self._row_units
        d_x /= units[:, None]
        d_a = d_a / units[:, None]
        d_ud = d_z[:, :, nq + 10 : nq + 20] / units[:, None]
        k_q = -np.einsum("ijk,nj->nik", dynamics.kinematics_linear, mid.u)
        k_x = np.concatenate([k_q, -dynamics.rate_map(mid.q)], axis=2)
        block = np.concatenate([k_x, d_x], axis=1) / 2
        rate = np.zeros_like(block)
        rate[:, :nq, :nq] = np.eye(nq) / h
        rate[:, nq:, nq:] = d_ud / h
        rows, columns = np.nonzero(self._x_pattern)
        a_rows, a_columns = np.nonzero(self._a_pattern)
        by_a, by_e = _activation_slopes(mid, self.muscles)
        muscle_a = d_a[:, a_rows, a_columns].T / 2
        reaction = np.full((3, len(z)), 0.5)
        values = []
        for sign in (-1.0, 1.0):
            values += [
                (block + sign * rate)[:, rows, columns].T,
                muscle_a,
                reaction,
                (sign / h - by_a / 2).T,
                -by_e.T / 2,
            ]
        s_rows, s_groups = np.nonzero(self._s_pattern)
        values.append((d_s / units[:, None, None])[:, s_rows, :, s_groups])
        return np.concatenate([v.ravel() for v in values])

    @cached_property
    def jacobian_structure(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and column indices of the non-zero Jacobian entries."""
        lay, nq, m = self.layout, self.layout.coordinates, np.arange(self.layout.muscles)
        interval = np.arange(lay.nodes - 1)
        x_rows, x_columns = np.nonzero(self._x_pattern)
        a_rows, a_columns = np.nonzero(self._a_pattern)
        groups = [
            (x_rows, "x", x_columns),
            (nq + a_rows, "a", a_columns),
            (nq + 10 + np.arange(3), "reaction", np.arange(3)),
            (nq + 13 + m, "a", m),
            (nq + 13 + m, "e", m),
        ]
        rows, columns = [], []
        for shift in (0, 1):
            for equation, kind, variable in groups:
                rows.append((equation[:, None] * (lay.nodes - 1) + interval).ravel())
                columns.append(lay.index(kind, variable, interval + shift).ravel())
        s_rows, s_groups = np.nonzero(self._s_pattern)
        row, column = np.broadcast_arrays(
            (nq + s_rows)[:, None, None] * (lay.nodes - 1) + interval[:, None],
            lay.scaler_index[:, s_groups].T[:, None],
        )
        rows.append(row.ravel())
        columns.append(column.ravel())
        return np.concatenate(rows), np.concatenate(columns)

    def _muscle_jacobian(self, mid: Trajectory) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Muscle forces by (q, u), a and scalers: (I, K, X), (I, K, M), (I, K, 2, G)."""
        arguments = (mid.q, mid.u, mid.a, self.scaled_muscles(mid))
        if not self.scalers.names:
            _, d_x, d_a = self.forces.jacobian(*arguments)
            return d_x, d_a, np.zeros((*d_a.shape[:2], 2, 0))
        _, d_x, d_a, d_p = self.forces.jacobian_with_parameters(*arguments)
        return d_x, d_a, np.einsum("nkpm,pgm->nkpg", d_p, self.scalers.gradient(self.muscles))

    def curvature(self, free: np.ndarray, multipliers: np.ndarray) -> Curvature:
        """Second derivatives of multipliers (m,) times constraints per interval, at (n,)."""
        x = self.layout.split(free)
        mid, z = self._midpoint(x)
        nq = self.layout.coordinates
        lam = multipliers[: self.number_of_equations * (self.layout.nodes - 1)]
        lam = lam.reshape(self.number_of_equations, -1).T
        dynamic = lam[:, nq : nq + 13] / self._row_units
        h_z = self.forces.dynamics.hessian(z, dynamic, self.parameters)[:, : nq + 20, : nq + 20]
        h_x, h_a, x_s, a_s, s_s = self._muscle_curvature(mid, dynamic)
        h_z[:, : nq + 10, : nq + 10] += h_x
        mixed = -np.einsum("ni,ijk->nkj", lam[:, :nq], self.forces.dynamics.kinematics_linear)
        h_z[:, :nq, nq : nq + 10] += mixed
        h_z[:, nq : nq + 10, :nq] += mixed.transpose(0, 2, 1)
        ends = [self._end_map(sign) for sign in (-1.0, 1.0)]
        half = [np.matmul(end.T, h_z) for end in ends]
        x_blocks = np.stack([np.stack([left @ end for end in ends]) for left in half])
        twist = 1.0 / self.muscles.activation_time - 1.0 / self.muscles.deactivation_time
        act = lam[:, nq + 13 :] * twist
        return Curvature(x_blocks, h_a / 4, act / 4, -2 * act / 4, x_s / 2, a_s / 2, s_s)

    def _muscle_curvature(self, mid: Trajectory, dynamic: np.ndarray) -> tuple[np.ndarray, ...]:
        """Second derivatives of multipliers (I, K) . muscle forces at the midpoints.

        By (q, u) twice, (q, u) and a, (q, u) and s, a and s, s twice, shaped as in Curvature.
        """
        arguments = (mid.q, mid.u, mid.a, dynamic, self.scaled_muscles(mid))
        n, m = mid.a.shape
        if not self.scalers.names:
            h_x, h_a = self.forces.hessian(*arguments)
            return (
                h_x,
                h_a,
                np.zeros((*h_x.shape[:2], 2, 0)),
                np.zeros((n, 2, m)),
                np.zeros((2, 2, 0)),
            )
        h_x, h_a, by = self.forces.hessian_with_parameters(*arguments)
        chain = self.scalers.gradient(self.muscles)
        return (
            h_x,
            h_a,
            np.einsum("nxpm,pgm->nxpg", by.x, chain),
            by.a * chain.sum(axis=1),
            np.einsum("npqm,pgm,qgm->pqg", by.p, chain, chain),
        )

    def _end_map(self, sign: float) -> np.ndarray:
        """d(midpoint q, u, du/dt) / d(q, u at one end), shape (Nq + 20, X)."""
        nq = self.layout.coordinates
        end = np.zeros((nq + 20, nq + 10))
        end[: nq + 10] = np.eye(nq + 10) / 2
        end[nq + 10 :, nq:] = sign / self.step * np.eye(10)
        return end

    def _midpoint(self, x: Trajectory) -> tuple[Trajectory, np.ndarray]:
        """Midpoint values and the argument (q, u, du/dt, R [N]) of the equations of motion."""
        means = (0.5 * (v[1:] + v[:-1]) for v in (x.q, x.u, x.a, x.e, x.reaction))
        mid = replace(Trajectory(*means), scalers=x.scalers)
        rate = np.diff(x.u, axis=0) / self.step
        return mid, np.hstack([mid.q, mid.u, rate, mid.reaction])

    @cached_property
    def _muscle_pattern(self) -> tuple[np.ndarray, np.ndarray]:
        """Which coordinates (M, Nq) and which equations (K, M) a muscle touches."""
        return muscle_patterns(self.forces)

    @cached_property
    def _x_pattern(self) -> np.ndarray:
        """Non-zeros of kinematic and dynamic equations in (q, u), shape (Nq + 13, X)."""
        nq = self.layout.coordinates
        dynamics = self.forces.dynamics
        constant, linear = dynamics.kinematics_constant != 0, dynamics.kinematics_linear != 0
        kinematic = np.hstack(
            [np.eye(nq, dtype=bool) | linear.any(axis=1), constant | linear.any(axis=2)]
        )
        jac = dynamics.jacobian_pattern
        dynamic = jac[:, : nq + 10].copy()
        dynamic[:, nq:] |= jac[:, nq + 10 : nq + 20]
        dynamic |= self._a_pattern.astype(int) @ self._x_by_muscle.astype(int) > 0
        return np.vstack([kinematic, dynamic])

    @property
    def _a_pattern(self) -> np.ndarray:
        return self._muscle_pattern[1]

    @cached_property
    def _x_by_muscle(self) -> np.ndarray:
        """Variables (q, u) that the force or arms of a muscle depend on, shape (M, X)."""
        coordinates, equations = self._muscle_pattern
        return np.hstack([coordinates, equations[:10].T])

    @cached_property
    def _s_pattern(self) -> np.ndarray:
        """Equations that the muscles of a group act in, (K, G)."""
        return self._a_pattern.astype(int) @ self.scalers.members.T.astype(int) > 0

    @cached_property
    def _xs_pattern(self) -> tuple[np.ndarray, ...]:
        touched = self._x_by_muscle.T.astype(int) @ self.scalers.members.T.astype(int)
        return np.nonzero(touched)

    @cached_property
    def _xa_pattern(self) -> tuple[np.ndarray, ...]:
        return np.nonzero(self._x_by_muscle.T)

    @cached_property
    def _xx_pattern(self) -> np.ndarray:
        """Possible non-zeros of the second derivatives in (q, u), shape (X, X)."""
        nq = self.layout.coordinates
        hess = self.forces.dynamics.hessian_pattern[: nq + 20, : nq + 20]
        pattern = hess[: nq + 10, : nq + 10].copy()
        pattern[:, nq:] |= hess[: nq + 10, nq + 10 :]
        pattern[nq:, :] |= hess[nq + 10 :, : nq + 10]
        twist = (self.forces.dynamics.kinematics_linear != 0).any(axis=0).T
        pattern[:nq, nq:] |= twist
        pattern[nq:, :nq] |= twist.T
        touched = self._x_by_muscle.astype(int)
        return pattern | (touched.T @ touched > 0) | np.eye(nq + 10, dtype=bool)


def _activation_slopes(mid: Trajectory, muscles: MuscleParameters) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of da/dt by activation and excitation, each (I, M)."""
    rise, fall = 1.0 / muscles.activation_time, 1.0 / muscles.deactivation_time
    gain = fall + (rise - fall) * mid.e
    return -gain, gain + (rise - fall) * (mid.e - mid.a)


def muscle_patterns(forces: MuscleForces) -> tuple[np.ndarray, np.ndarray]:
    """Structural non-zeros: coordinates of each muscle's length (M, Nq), its equations (13, M)."""
    geometry, dynamics = forces.geometry, forces.dynamics
    nq = dynamics.number_of_coordinates
    feature = np.zeros((geometry.length.shape[1], nq), dtype=bool)
    size = len(geometry.exponents)
    feature[:size, list(dynamics.polynomial_variables)] = geometry.exponents > 0
    q = np.random.default_rng(0).normal(size=(1, nq))
    feature[size:] = dynamics.features(q)[1][0] != 0
    used = (geometry.length != 0) | (geometry.translation != 0).any(axis=0)
    coordinates = used.astype(int) @ feature.astype(int) > 0
    maps = (dynamics.rate_map(q)[0] != 0).astype(int)
    joints = coordinates.astype(int) @ maps > 0
    # The other components of a quaternion follow from its joint being crossed.
    coordinates = joints.astype(int) @ maps.T > 0
    translation = (geometry.translation != 0).any(axis=2)
    return coordinates, np.vstack([joints.T, translation])
