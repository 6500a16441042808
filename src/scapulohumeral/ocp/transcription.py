"""Direct collocation with the midpoint rule: constraints, Jacobian and Hessian in sparse form.

Unknowns and equations are laid out as opty does it: the free vector holds state trajectories, then
input trajectories, one variable after the other; constraints hold one equation of motion after
the other over all intervals, then the instance constraints.

Letters: N nodes, I = N - 1 intervals, M muscles, Nq coordinates, X = Nq + 10, K = 13 dynamic
equations. Equations in order: Nq kinematic, 13 dynamic (three auxiliary ones in kN), M activation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters, activation_rate
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.ocp.objective import ObjectiveHessian, Trajectory

REACTION_UNIT_N = 1000.0
ROW_UNITS = np.array([1.0] * 10 + [REACTION_UNIT_N] * 3)


@dataclass(frozen=True, eq=False)
class Layout:
    """Positions of all trajectories in opty's free vector.

    Attributes
    ----------
    nodes : N; coordinates : Nq; muscles : M
    inputs : row of each input trajectory, reactions x y z first, then excitations in muscle order
    """

    nodes: int
    coordinates: int
    muscles: int
    inputs: np.ndarray

    @property
    def size(self) -> int:
        """Length of the free vector."""
        return self.nodes * (self.coordinates + 10 + 2 * self.muscles + 3)

    @cached_property
    def rows(self) -> dict[str, np.ndarray]:
        """Trajectory row of every variable by kind: x = (q, u), a, e, reaction."""
        x = self.coordinates + 10
        states = x + self.muscles
        return {
            "x": np.arange(x),
            "a": x + np.arange(self.muscles),
            "reaction": states + self.inputs[:3],
            "e": states + self.inputs[3:],
        }

    def index(self, kind: str, variable: np.ndarray, node: np.ndarray) -> np.ndarray:
        """Indices in the free vector, variable by node."""
        return self.rows[kind][variable][..., None] * self.nodes + node

    def split(self, free: np.ndarray) -> Trajectory:
        """Trajectories of a free vector."""
        table = free[: self.size].reshape(-1, self.nodes)
        nq = self.coordinates
        x = table[self.rows["x"]].T
        return Trajectory(
            q=x[:, :nq],
            u=x[:, nq:],
            a=table[self.rows["a"]].T,
            e=table[self.rows["e"]].T,
            reaction=table[self.rows["reaction"]].T,
        )

    def join(self, x: Trajectory) -> np.ndarray:
        """Free vector of trajectories: the inverse of :meth:`split`."""
        table = np.empty((self.size // self.nodes, self.nodes))
        table[self.rows["x"]] = np.hstack([x.q, x.u]).T
        table[self.rows["a"]] = x.a.T
        table[self.rows["e"]] = x.e.T
        table[self.rows["reaction"]] = x.reaction.T
        return table.ravel()


@dataclass(frozen=True, eq=False)
class Collocation:
    """Discretised equations of motion of one participant and condition.

    Attributes
    ----------
    forces : muscle forces, with the equations of motion
    muscles : run-time muscle parameters; parameters : run-time dynamics parameters (P,)
    layout : positions in the free vector; step : mesh interval [s]
    """

    forces: MuscleForces
    muscles: MuscleParameters
    parameters: np.ndarray
    layout: Layout
    step: float

    @property
    def number_of_equations(self) -> int:
        """Equations of motion per interval."""
        return self.layout.coordinates + 13 + self.layout.muscles

    def constraints(self, free: np.ndarray) -> np.ndarray:
        """Residuals of all equations, shape (equations * I,)."""
        x = self.layout.split(free)
        mid, z = self._midpoint(x)
        kinematic = np.diff(x.q, axis=0) / self.step - np.einsum(
            "nij,nj->ni", self.forces.dynamics.rate_map(mid.q), mid.u
        )
        dynamic = self.forces.dynamics.residual(z, self.parameters)
        dynamic = dynamic + self.forces.generalised(mid.q, mid.u, mid.a, self.muscles)
        activation = np.diff(x.a, axis=0) / self.step - activation_rate(mid.e, mid.a, self.muscles)
        return np.hstack([kinematic, dynamic / ROW_UNITS, activation]).T.ravel()

    def jacobian(self, free: np.ndarray) -> np.ndarray:
        """Non-zero values in the order of :attr:`jacobian_structure`."""
        x = self.layout.split(free)
        mid, z = self._midpoint(x)
        nq, h = self.layout.coordinates, self.step
        dynamics = self.forces.dynamics
        d_z = dynamics.jacobian(z, self.parameters)
        _, d_x, d_a = self.forces.jacobian(mid.q, mid.u, mid.a, self.muscles)
        d_x += d_z[:, :, : nq + 10]
        d_x /= ROW_UNITS[:, None]
        d_a = d_a / ROW_UNITS[:, None]
        d_ud = d_z[:, :, nq + 10 : nq + 20] / ROW_UNITS[:, None]
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
        return np.concatenate(rows), np.concatenate(columns)

    def curvature(
        self, free: np.ndarray, multipliers: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Second derivatives of multipliers . constraints per interval.

        Returns
        -------
        x_blocks : (2, 2, I, X, X), by left/right node of both variables
        x_a : (I, X, M), the same for every combination of nodes
        a_e, e_e : (I, M), likewise
        """
        x = self.layout.split(free)
        mid, z = self._midpoint(x)
        nq = self.layout.coordinates
        lam = multipliers[: self.number_of_equations * (self.layout.nodes - 1)]
        lam = lam.reshape(self.number_of_equations, -1).T
        dynamic = lam[:, nq : nq + 13] / ROW_UNITS
        h_z = self.forces.dynamics.hessian(z, dynamic, self.parameters)[:, : nq + 20, : nq + 20]
        h_x, h_a = self.forces.hessian(mid.q, mid.u, mid.a, dynamic, self.muscles)
        h_z[:, : nq + 10, : nq + 10] += h_x
        mixed = -np.einsum("ni,ijk->nkj", lam[:, :nq], self.forces.dynamics.kinematics_linear)
        h_z[:, :nq, nq : nq + 10] += mixed
        h_z[:, nq : nq + 10, :nq] += mixed.transpose(0, 2, 1)
        ends = [self._end_map(sign) for sign in (-1.0, 1.0)]
        half = [np.matmul(end.T, h_z) for end in ends]
        x_blocks = np.stack([np.stack([left @ end for end in ends]) for left in half])
        twist = 1.0 / self.muscles.activation_time - 1.0 / self.muscles.deactivation_time
        act = lam[:, nq + 13 :] * twist
        return x_blocks, h_a / 4, act / 4, -2 * act / 4

    def _end_map(self, sign: float) -> np.ndarray:
        """d(midpoint q, u, du/dt) / d(q, u at one end), shape (Nq + 20, X)."""
        nq = self.layout.coordinates
        end = np.zeros((nq + 20, nq + 10))
        end[: nq + 10] = np.eye(nq + 10) / 2
        end[nq + 10 :, nq:] = sign / self.step * np.eye(10)
        return end

    def _midpoint(self, x: Trajectory) -> tuple[Trajectory, np.ndarray]:
        """Midpoint values and the argument (q, u, du/dt, R [N]) of the equations of motion."""
        mid = Trajectory(*(0.5 * (v[1:] + v[:-1]) for v in (x.q, x.u, x.a, x.e, x.reaction)))
        rate = np.diff(x.u, axis=0) / self.step
        return mid, np.hstack([mid.q, mid.u, rate, REACTION_UNIT_N * mid.reaction])

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


@dataclass(frozen=True, eq=False)
class LagrangianHessian:
    """Lower triangle of the Hessian of the Lagrangian in sparse form.

    Attributes
    ----------
    collocation : the constraints
    exact : with their second derivatives; otherwise Gauss-Newton, objective only
    instance_norm : coordinates of each unit-norm constraint at the first node, (n, 4)
    """

    collocation: Collocation
    exact: bool
    instance_norm: np.ndarray

    @cached_property
    def _pairs(self) -> tuple[np.ndarray, ...]:
        """Lower triangle of node blocks in x."""
        c = self.collocation
        if self.exact:
            return np.nonzero(np.tril(c._xx_pattern))
        nq = c.layout.coordinates
        pattern = np.eye(nq + 10, dtype=bool)
        pattern[:nq, :nq] = True
        return np.nonzero(np.tril(pattern))

    @cached_property
    def _cross_pairs(self) -> tuple[np.ndarray, ...]:
        """Pairs of x variables at the right and the left node of an interval."""
        c = self.collocation
        nq = c.layout.coordinates
        if self.exact:
            return np.nonzero(c._xx_pattern)
        return np.arange(nq, nq + 10), np.arange(nq, nq + 10)

    @cached_property
    def structure(self) -> tuple[np.ndarray, np.ndarray]:
        """Row and column indices, row >= column."""
        lay = self.collocation.layout
        every, left = np.arange(lay.nodes), np.arange(lay.nodes - 1)
        right, m, r = left + 1, np.arange(lay.muscles), np.arange(3)
        r_rows, r_columns = np.tril_indices(3)
        entries = [
            (("x", self._pairs[0], every), ("x", self._pairs[1], every)),
            (("x", self._cross_pairs[0], right), ("x", self._cross_pairs[1], left)),
            (("a", m, every), ("a", m, every)),
            (("e", m, every), ("e", m, every)),
            (("e", m, right), ("e", m, left)),
            (("reaction", r_rows, every), ("reaction", r_columns, every)),
            (("reaction", r, right), ("reaction", r, left)),
        ]
        if self.exact:
            x, a = self.collocation._xa_pattern
            entries += [
                (("x", x, every), ("a", a, every)),
                (("x", x, right), ("a", a, left)),
                (("x", x, left), ("a", a, right)),
                (("a", m, every), ("e", m, every)),
                (("a", m, right), ("e", m, left)),
                (("a", m, left), ("e", m, right)),
            ]
        rows = np.concatenate([lay.index(*first).ravel() for first, _ in entries])
        columns = np.concatenate([lay.index(*second).ravel() for _, second in entries])
        return np.maximum(rows, columns), np.minimum(rows, columns)

    def values(
        self, free: np.ndarray, objective: ObjectiveHessian, factor: float, multipliers: np.ndarray
    ) -> np.ndarray:
        """Values in the order of :attr:`structure`; ``factor`` scales the objective."""
        lay = self.collocation.layout
        n, nq, m = lay.nodes, lay.coordinates, lay.muscles
        x_diag = np.zeros((n, nq + 10, nq + 10))
        x_cross = np.zeros((n - 1, nq + 10, nq + 10))
        a_e, e_e = np.zeros((n - 1, m)), np.zeros((n - 1, m))
        if self.exact:
            blocks, x_a, a_e, e_e = self.collocation.curvature(free, multipliers)
            x_diag[:-1] += blocks[0, 0]
            x_diag[1:] += blocks[1, 1]
            x_cross += blocks[1, 0]
            self._add_norm(x_diag, multipliers)
        x_diag[:, :nq, :nq] += factor * objective.q
        speeds = np.arange(nq, nq + 10)
        ends = _end_count(n)
        x_diag[:, speeds, speeds] += factor * objective.rate_u * ends[:, None]
        x_cross[:, speeds, speeds] -= factor * objective.rate_u
        reaction = factor * objective.reaction.copy()
        reaction[:, [0, 1, 2], [0, 1, 2]] += factor * objective.rate_reaction * ends[:, None]
        r_rows, r_columns = np.tril_indices(3)
        values = [
            x_diag[:, self._pairs[0], self._pairs[1]],
            x_cross[:, self._cross_pairs[0], self._cross_pairs[1]],
            np.repeat((factor * objective.a)[:, None], m, axis=1),
            _to_nodes(e_e) + factor * objective.rate_e * ends[:, None],
            e_e - factor * objective.rate_e,
            reaction[:, r_rows, r_columns],
            np.full((n - 1, 3), -factor * objective.rate_reaction),
        ]
        if self.exact:
            rows, columns = self.collocation._xa_pattern
            pairs = x_a[:, rows, columns]
            values += [_to_nodes(pairs), pairs, pairs, _to_nodes(a_e), a_e, a_e]
        return np.concatenate([v.T.ravel() for v in values])

    def _add_norm(self, x_diag: np.ndarray, multipliers: np.ndarray) -> None:
        start = self.collocation.number_of_equations * (self.collocation.layout.nodes - 1)
        for k, coordinates in enumerate(self.instance_norm):
            x_diag[0, coordinates, coordinates] += 2 * multipliers[start + k]


def _end_count(nodes: int) -> np.ndarray:
    """Number of intervals that each node belongs to, shape (N,)."""
    count = np.full(nodes, 2.0)
    count[[0, -1]] = 1.0
    return count


def _to_nodes(interval: np.ndarray) -> np.ndarray:
    """Sum interval values (I, k) onto their two nodes, (N, k)."""
    nodes = np.zeros((len(interval) + 1, interval.shape[1]))
    nodes[:-1] += interval
    nodes[1:] += interval
    return nodes
