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

    def _monomials(self, v: np.ndarray) -> np.ndarray:
        """Every monomial of the closure, shape (N, D)."""
        exponents, _ = self._closure
        powers = v[:, :, None] ** np.arange(int(exponents.max(initial=0)) + 1)
        values = np.ones((len(v), len(exponents)))
        for variable in range(exponents.shape[1]):
            used = np.flatnonzero(exponents[:, variable])
            values[:, used] *= powers[:, variable, exponents[used, variable]]
        return values

    @cached_property
    def _sums(self) -> list[sparse.csr_matrix]:
        """Matrices that sum derivative terms into their output positions."""
        size, nv = self.exponents.shape
        _, (first, second, third) = self._closure
        targets = [
            (first.feature * nv + first.variables[:, 0], size * nv),
            (second.feature * nv + second.variables[:, 0], size * nv),
            (second.variables[:, 0] * nv + second.variables[:, 1], nv * nv),
            (third.variables[:, 0] * nv + third.variables[:, 1], nv * nv),
        ]
        return [
            sparse.csr_matrix(
                (np.ones(len(rows)), (np.arange(len(rows)), rows)), shape=(len(rows), width)
            )
            for rows, width in targets
        ]

    def first(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Values (N, F) and gradients (N, F, V)."""
        m = self._monomials(v)
        _, (first, _, _) = self._closure
        size, nv = self.exponents.shape
        gradient = (m[:, first.source] * first.coefficient) @ self._sums[0]
        return m[:, :size], gradient.reshape(len(v), size, nv)

    def second(
        self, v: np.ndarray, rate: np.ndarray, weights: np.ndarray, rate_weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As :meth:`CompiledDynamics.feature_second`, with V in place of Nq."""
        m = self._monomials(v)
        size, nv = self.exponents.shape
        _, (_, second, third) = self._closure
        curvature = m[:, second.source] * second.coefficient
        jdot = (curvature * rate[:, second.variables[:, 1]]) @ self._sums[1]
        hess = (curvature * weights[:, second.feature]) @ self._sums[2]
        third_terms = m[:, third.source] * third.coefficient
        third_terms *= rate[:, third.variables[:, 2]] * rate_weights[:, third.feature]
        n = len(v)
        return (
            jdot.reshape(n, size, nv),
            hess.reshape(n, nv, nv),
            (third_terms @ self._sums[3]).reshape(n, nv, nv),
        )


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

    def second(
        self, q: np.ndarray, rate: np.ndarray, weights: np.ndarray, rate_weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directional gradient (N, F, Nq) and weighted Hessians (N, Nq, Nq), twice.

        Second: sum_k weights_k hess f_k; third: sum_k rate_weights_k hess(grad f_k . rate).
        """
        split = self.monomials.exponents.shape[0]
        idx = self._variables
        jdot, hess, third = self.monomials.second(
            q[:, idx], rate[:, idx], weights[:, :split], rate_weights[:, :split]
        )
        jdot_r, hess_r, third_r = self.dynamics.feature_second(
            q, rate, weights[:, split:], rate_weights[:, split:]
        )
        full = np.zeros((len(q), split, q.shape[1]))
        full[:, :, idx] = jdot
        square = np.ix_(np.arange(len(q)), idx, idx)
        hess_r[square] += hess
        third_r[square] += third
        return np.concatenate([full, jdot_r], axis=1), hess_r, third_r
