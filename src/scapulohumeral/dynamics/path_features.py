"""Features in which muscle lengths are linear: monomials and rotation-matrix entries.

Muscle lengths with wrapping, or their squares, are polynomials of the coordinates, y = C f(q); of
straight paths the squared length is affine in the entries of rotation matrices, so it is C f(q)
too. This module gives f and the contractions of its first three derivatives that the forces and
their exact Hessian need.

Letters: N nodes, Nq coordinates, V = 10 polynomial variables, F features, D distinct monomials
in the closure under differentiation.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy import sparse

from scapulohumeral.dynamics.compiled import CompiledDynamics
from scapulohumeral.model.muscle_paths.geometry import ROTATION_FEATURES

# Points whose monomials are kept: as many as the blocks in which the nodes of a mesh are evaluated.
KEPT = 16


@dataclass(frozen=True)
class _Contraction:
    """Terms coefficient * monomial[source] of one derivative order, with their indices."""

    feature: np.ndarray
    source: np.ndarray
    coefficient: np.ndarray
    variables: np.ndarray


@dataclass(frozen=True)
class MonomialFeatures:
    """Monomials of the polynomial variables.

    Attributes
    ----------
    exponents : (F, V) non-negative integers
    """

    exponents: np.ndarray

    @cached_property
    def _closure(self) -> tuple[np.ndarray, list[_Contraction]]:
        index: dict[tuple[int, ...], int] = {}
        for row in self.exponents:
            index.setdefault(tuple(int(e) for e in row), len(index))
        orders = []
        for order in (1, 2, 3):
            terms: list[tuple[int, int, float, tuple[int, ...]]] = []
            for feature, row in enumerate(self.exponents):
                active = np.flatnonzero(row)
                for variables in product(active.tolist(), repeat=order):
                    exponent, coefficient = [int(e) for e in row], 1.0
                    for variable in variables:
                        coefficient *= exponent[variable]
                        exponent[variable] -= 1
                        if coefficient == 0:
                            break
                    if coefficient:
                        source = index.setdefault(tuple(exponent), len(index))
                        terms.append((feature, source, coefficient, variables))
            orders.append(
                _Contraction(
                    feature=np.array([t[0] for t in terms], dtype=int),
                    source=np.array([t[1] for t in terms], dtype=int),
                    coefficient=np.array([t[2] for t in terms], dtype=float),
                    variables=np.array([t[3] for t in terms], dtype=int).reshape(-1, order),
                )
            )
        return np.array(list(index), dtype=int), orders

    @cached_property
    def _latest(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return []

    def _monomials(self, v: np.ndarray) -> np.ndarray:
        """Every monomial of the closure, shape (N, D); those of the last points are kept."""
        for known, values in self._latest:
            if np.array_equal(known, v):
                return values
        self._latest.append((v.copy(), self._new_monomials(v)))
        del self._latest[:-KEPT]
        return self._latest[-1][1]

    def _new_monomials(self, v: np.ndarray) -> np.ndarray:
        exponents, _ = self._closure
        powers = v[:, :, None] ** np.arange(int(exponents.max(initial=0)) + 1)
        values = np.ones((len(v), len(exponents)))
        for variable in range(exponents.shape[1]):
            used = np.flatnonzero(exponents[:, variable])
            values[:, used] *= powers[:, variable, exponents[used, variable]]
        return values

    @cached_property
    def _gradient_sums(self) -> list[sparse.csr_matrix]:
        """Matrices that sum first and second derivatives into (F, V), by the first variable."""
        size, nv = self.exponents.shape
        _, orders = self._closure
        return [
            _sums([terms.feature * nv + terms.variables[:, 0]], size * nv) for terms in orders[:2]
        ]

    @cached_property
    def _symmetric(self) -> list[tuple[_Contraction, sparse.csr_matrix]]:
        """Second and third derivatives by ordered first two variables, and their sums (V, V).

        Each stands for its mirror image too.
        """
        nv = self.exponents.shape[1]
        _, orders = self._closure
        result = []
        for terms in orders[1:]:
            chosen = terms.variables[:, 0] <= terms.variables[:, 1]
            half = _Contraction(
                terms.feature[chosen],
                terms.source[chosen],
                terms.coefficient[chosen],
                terms.variables[chosen],
            )
            i, j = half.variables[:, 0], half.variables[:, 1]
            result.append((half, _sums([i * nv + j, j * nv + i], nv * nv)))
        return result

    def first(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (N, F) and gradients (N, F, V)."""
        m = self._monomials(v)
        _, (first, _, _) = self._closure
        size, nv = self.exponents.shape
        gradient = (m[:, first.source] * first.coefficient) @ self._gradient_sums[0]
        return m[:, :size], gradient.reshape(len(v), size, nv)

    def directional(self, v: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Gradients of grad f . rate, (N, F, V), for rate (N, V)."""
        _, (_, second, _) = self._closure
        terms = self._monomials(v)[:, second.source] * second.coefficient
        terms *= rate[:, second.variables[:, 1]]
        return (terms @ self._gradient_sums[1]).reshape(len(v), *self.exponents.shape)

    def curvature(self, v: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """sum_k weights_k hess f_k, (N, V, V), for weights (N, F)."""
        second, sums = self._symmetric[0]
        terms = self._monomials(v)[:, second.source] * second.coefficient
        terms *= weights[:, second.feature]
        return (terms @ sums).reshape(len(v), *2 * v.shape[1:])

    def directional_curvature(
        self, v: np.ndarray, rate: np.ndarray, weights: np.ndarray
    ) -> np.ndarray:
        """sum_k weights_k hess(grad f_k . rate), (N, V, V), for rate (N, V), weights (N, F)."""
        third, sums = self._symmetric[1]
        terms = self._monomials(v)[:, third.source] * third.coefficient
        terms *= weights[:, third.feature]
        terms *= rate[:, third.variables[:, 2]]
        return (terms @ sums).reshape(len(v), *2 * v.shape[1:])


def _sums(targets: list[np.ndarray], width: int) -> sparse.csr_matrix:
    """Matrix that adds each term to the target positions given, once to each of them."""
    count = len(targets[0])
    rows = np.tile(np.arange(count), len(targets))
    entries = sparse.coo_matrix(
        (np.ones(len(rows)), (rows, np.concatenate(targets))), shape=(count, width)
    ).tocsr()
    entries.data[:] = 1.0
    return entries


@dataclass(frozen=True)
class PathFeatures:
    """Monomials followed by rotation-matrix entries, with derivatives in q."""

    monomials: MonomialFeatures
    dynamics: CompiledDynamics

    @cached_property
    def _variables(self) -> np.ndarray:
        return np.array(self.dynamics.polynomial_variables)

    def first(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (N, F) and gradients (N, F, Nq)."""
        values, gradient = self.monomials.first(q[:, self._variables])
        rotation, rotation_gradient = self.dynamics.features(q)
        full = np.zeros((*values.shape, q.shape[1]))
        full[:, :, self._variables] = gradient
        return np.hstack([values, rotation]), np.concatenate([full, rotation_gradient], axis=1)

    def directional(self, q: np.ndarray, rate: np.ndarray) -> np.ndarray:
        """Gradients of grad f . rate, (N, F, Nq), for rate (N, Nq)."""
        idx = self._variables
        split = self.monomials.exponents.shape[0]
        full = np.zeros((len(q), split, q.shape[1]))
        full[:, :, idx] = self.monomials.directional(q[:, idx], rate[:, idx])
        none = np.zeros((len(q), ROTATION_FEATURES))
        rotation, _, _ = self.dynamics.feature_second(q, rate, none, none)
        return np.concatenate([full, rotation], axis=1)

    def curvature(self, q: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """sum_k weights_k hess f_k, (N, Nq, Nq), for weights (N, F)."""
        split = self.monomials.exponents.shape[0]
        own, rotation = weights[:, :split], weights[:, split:]
        none = np.zeros_like(rotation)
        _, total, _ = self.dynamics.feature_second(q, np.zeros_like(q), rotation, none)
        return self._add(total, self.monomials.curvature(q[:, self._variables], own))

    def directional_curvature(
        self, q: np.ndarray, rate: np.ndarray, weights: np.ndarray
    ) -> np.ndarray:
        """sum_k weights_k hess(grad f_k . rate), (N, Nq, Nq), for rate (N, Nq), weights (N, F)."""
        idx, split = self._variables, self.monomials.exponents.shape[0]
        own, rotation = weights[:, :split], weights[:, split:]
        none = np.zeros_like(rotation)
        _, _, total = self.dynamics.feature_second(q, rate, none, rotation)
        return self._add(total, self.monomials.directional_curvature(q[:, idx], rate[:, idx], own))

    def _add(self, total: np.ndarray, monomials: np.ndarray) -> np.ndarray:
        """Second derivatives (N, Nq, Nq) with those of the monomials (N, V, V) added."""
        idx = self._variables
        total[np.ix_(np.arange(len(total)), idx, idx)] += monomials
        return total
