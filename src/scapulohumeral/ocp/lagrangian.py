"""Hessian of the Lagrangian in sparse form, from objective and constraints.

An equation of an interval depends on the means over its two nodes, so its second derivatives
couple unknowns of one node with those of the next. A lumped Hessian gives what couples two nodes to
each of them alone, half and half, as lumped mass matrices do. It is the exact one for what changes
smoothly along the mesh, and is factorised faster.

Letters: N nodes, I = N - 1 intervals, M muscles, Nq coordinates, X = Nq + 10, G groups of scaled
muscles.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scapulohumeral.ocp.objective import ObjectiveHessian
from scapulohumeral.ocp.transcription import Collocation, Curvature

LUMPED = "lumped"
# Modes with second derivatives of the constraints.
CURVED = ("exact", LUMPED)


@dataclass(frozen=True, eq=False)
class LagrangianHessian:
    """Lower triangle of the Hessian of the Lagrangian in sparse form.

    Attributes
    ----------
    collocation : the constraints
    mode : "exact" or "lumped", with their second derivatives, or any other: objective only
    instance_norm : coordinates of each unit-norm constraint at the first node, (n, 4)
    coupling : (M, M) pattern of the objective's node blocks in the excitations
    """

    collocation: Collocation
    mode: str
    instance_norm: np.ndarray
    coupling: np.ndarray

    @property
    def curved(self) -> bool:
        """Whether second derivatives of the constraints count."""
        return self.mode in CURVED

    @property
    def lumped(self) -> bool:
        """Whether second derivatives of the constraints couple unknowns of one node only."""
        return self.mode == LUMPED

    @cached_property
    def _pairs(self) -> tuple[np.ndarray, ...]:
        """Lower triangle of node blocks in x."""
        c = self.collocation
        if self.curved:
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
        if self.curved and not self.lumped:
            return np.nonzero(c._xx_pattern)
        return np.arange(nq, nq + 10), np.arange(nq, nq + 10)

    @cached_property
    def _coupled(self) -> tuple[np.ndarray, ...]:
        """Pairs of different excitations that the objective couples at a node."""
        return np.nonzero(np.tril(self.coupling, -1))

    def _scaler_pairs(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Indices of scalers and of the unknowns that they meet, in the order of the values."""
        lay, c = self.collocation.layout, self.collocation
        pairs = [(index, index) for index in lay.scaler_index]
        if not self.curved:
            return pairs
        every = np.arange(lay.nodes)
        x, x_groups = c._xs_pattern
        a_groups, a = np.nonzero(c.scalers.members)
        for index in lay.scaler_index:
            for kind, variable, groups in (("x", x, x_groups), ("a", a, a_groups)):
                node = lay.index(kind, variable, every)
                pairs.append((np.broadcast_to(index[groups][:, None], node.shape), node))
        return [*pairs, (lay.scaler_index[1], lay.scaler_index[0])]

    def _scaler_values(
        self, curvature: Curvature | None, regularisation: float
    ) -> list[np.ndarray]:
        """Values in the order of :meth:`_scaler_pairs`."""
        c = self.collocation
        diagonal = np.full(c.layout.scalers.shape, regularisation)
        if curvature is None:
            return [*diagonal]
        x, x_groups = c._xs_pattern
        _, a = np.nonzero(c.scalers.members)
        values = [*(diagonal + curvature.s_s[[0, 1], [0, 1]])]
        for p in (0, 1):
            values += [
                _to_nodes(curvature.x_s[:, x, p, x_groups]),
                _to_nodes(curvature.a_s[:, p, a]),
            ]
        return [*values, curvature.s_s[1, 0]]

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
            (("e", self._coupled[0], every), ("e", self._coupled[1], every)),
            (("reaction", r_rows, every), ("reaction", r_columns, every)),
            (("reaction", r, right), ("reaction", r, left)),
        ]
        if self.curved:
            x, a = self.collocation._xa_pattern
            for one, other in (("x", x), ("a", a)), (("a", m), ("e", m)):
                entries.append(((*one, every), (*other, every)))
                if not self.lumped:
                    entries += [((*one, right), (*other, left)), ((*one, left), (*other, right))]
        pairs = [(lay.index(*first), lay.index(*second)) for first, second in entries]
        pairs += self._scaler_pairs()
        rows = np.concatenate([first.ravel() for first, _ in pairs])
        columns = np.concatenate([second.ravel() for _, second in pairs])
        return np.maximum(rows, columns), np.minimum(rows, columns)

    def values(
        self, free: np.ndarray, objective: ObjectiveHessian, factor: float, multipliers: np.ndarray
    ) -> np.ndarray:
        """Values in the order of :attr:`structure`; ``factor`` scales the objective."""
        lay = self.collocation.layout
        n, m = lay.nodes, lay.muscles
        curvature = self.collocation.curvature(free, multipliers) if self.curved else None
        x_diag, x_cross = self._x_blocks(curvature, objective, factor, multipliers)
        e_e = curvature.e_e if curvature else np.zeros((n - 1, m))
        # What is alike for both nodes and both combinations counts twice at each node alone.
        alone = 2.0 if self.lumped else 1.0
        ends = _end_count(n)
        reaction = factor * objective.reaction.copy()
        reaction[:, [0, 1, 2], [0, 1, 2]] += factor * objective.rate_reaction * ends[:, None]
        r_rows, r_columns = np.tril_indices(3)
        emg = factor * objective.e[:, None]
        values = [
            x_diag[:, self._pairs[0], self._pairs[1]],
            x_cross[:, self._cross_pairs[0], self._cross_pairs[1]],
            np.broadcast_to(factor * objective.a, (n, m)),
            alone * _to_nodes(e_e)
            + factor * objective.rate_e * ends[:, None]
            + emg * np.diag(self.coupling),
            np.full((n - 1, m), -factor * objective.rate_e) + (0.0 if self.lumped else e_e),
            emg * self.coupling[self._coupled],
            reaction[:, r_rows, r_columns],
            np.full((n - 1, 3), -factor * objective.rate_reaction),
        ]
        if curvature:
            rows, columns = self.collocation._xa_pattern
            for both in curvature.x_a[:, rows, columns], curvature.a_e:
                values += [alone * _to_nodes(both)] + ([] if self.lumped else [both, both])
        values += self._scaler_values(curvature, factor * objective.scalers)
        return np.concatenate([v.T.ravel() for v in values])

    def _x_blocks(
        self,
        curvature: Curvature | None,
        objective: ObjectiveHessian,
        factor: float,
        multipliers: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Blocks in (q, u): of each node (N, X, X), of right and left node (I, X, X)."""
        n, nq = self.collocation.layout.nodes, self.collocation.layout.coordinates
        diagonal = np.zeros((n, nq + 10, nq + 10))
        cross = np.zeros((n - 1, nq + 10, nq + 10))
        if curvature:
            diagonal[:-1] += curvature.x[0, 0]
            diagonal[1:] += curvature.x[1, 1]
            if self.lumped:
                across = curvature.x[1, 0]
                diagonal += _to_nodes(across + across.swapaxes(1, 2)) / 2
            else:
                cross += curvature.x[1, 0]
            start = self.collocation.number_of_equations * (n - 1)
            for k, coordinates in enumerate(self.instance_norm):
                diagonal[0, coordinates, coordinates] += 2 * multipliers[start + k]
        diagonal[:, :nq, :nq] += factor * objective.q
        speeds = np.arange(nq, nq + 10)
        diagonal[:, speeds, speeds] += factor * objective.rate_u * _end_count(n)[:, None]
        cross[:, speeds, speeds] -= factor * objective.rate_u
        return diagonal, cross


def _end_count(nodes: int) -> np.ndarray:
    """Number of intervals that each node belongs to, shape (N,)."""
    count = np.full(nodes, 2.0)
    count[[0, -1]] = 1.0
    return count


def _to_nodes(interval: np.ndarray) -> np.ndarray:
    """Sum interval values (I, ...) onto their two nodes, (N, ...)."""
    nodes = np.zeros((len(interval) + 1, *interval.shape[1:]))
    nodes[:-1] += interval
    nodes[1:] += interval
    return nodes
