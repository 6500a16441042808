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
    def closure(self) -> tuple[np.ndarray, list[_Contraction]]:
        """Exponents (D, V) of the closure, and derivatives of orders 1 to 3 in its monomials."""
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

    def at(self, v: np.ndarray) -> MonomialPoint:
        """The monomials at variables (N, V), with their derivatives."""
        return MonomialPoint(self, self._monomials(v))

    def _monomials(self, v: np.ndarray) -> np.ndarray:
        """Every monomial of the closure, shape (N, D)."""
        exponents, _ = self.closure
        powers = v[:, :, None] ** np.arange(int(exponents.max(initial=0)) + 1)
        values = np.ones((len(v), len(exponents)))
        for variable in range(exponents.shape[1]):
            used = np.flatnonzero(exponents[:, variable])
            values[:, used] *= powers[:, variable, exponents[used, variable]]
        return values

    @cached_property
    def gradient_sums(self) -> list[sparse.csr_matrix]:
        """Matrices that sum first and second derivatives into (F, V), by the first variable."""
        size, nv = self.exponents.shape
        _, orders = self.closure
        return [
            _sums([terms.feature * nv + terms.variables[:, 0]], size * nv) for terms in orders[:2]
        ]

    @cached_property
    def symmetric(self) -> list[tuple[_Contraction, sparse.csr_matrix]]:
        """Second and third derivatives by ordered first two variables, and their sums (V, V).

        Each stands for its mirror image too.
        """
        nv = self.exponents.shape[1]
        _, orders = self.closure
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


@dataclass(frozen=True, eq=False)
class MonomialPoint:
    """Monomials at N points of the variables.

    Attributes
    ----------
    features : the monomials
    every : (N, D) values of the closure, of which derivatives are made
    """

    features: MonomialFeatures
    every: np.ndarray

    @property
    def values(self) -> np.ndarray:
        """Values (N, F)."""
        return self.every[:, : len(self.features.exponents)]

    def gradients(self) -> np.ndarray:
        """Gradients (N, F, V)."""
        _, (first, _, _) = self.features.closure
        terms = self._terms(first)
        return (terms @ self.features.gradient_sums[0]).reshape(self._shape)

    def directional(self, rate: np.ndarray) -> np.ndarray:
        """Gradients of grad f . rate, (N, F, V), for rate (N, V)."""
        _, (_, second, _) = self.features.closure
        terms = self._terms(second)
        terms *= rate[:, second.variables[:, 1]]
        return (terms @ self.features.gradient_sums[1]).reshape(self._shape)

    def curvature(self, weights: np.ndarray) -> np.ndarray:
        """sum_k weights_k hess f_k, (N, V, V), for weights (N, F)."""
        second, sums = self.features.symmetric[0]
        return self._square(self._second * weights[:, second.feature], sums)

    def directional_curvature(self, *along: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """sum_k weights_k hess(grad f_k . rate), (N, V, V), summed over pairs `along`.

        Parameters
        ----------
        along : rate (N, V) and weights (N, F)
        """
        third, sums = self.features.symmetric[1]
        feature, variable = third.feature, third.variables[:, 2]
        weight = sum(weights[:, feature] * rate[:, variable] for rate, weights in along)
        return self._square(self._terms(third) * weight, sums)

    @cached_property
    def _second(self) -> np.ndarray:
        return self._terms(self.features.symmetric[0][0])

    def _terms(self, contraction: _Contraction) -> np.ndarray:
        return self.every[:, contraction.source] * contraction.coefficient

    @property
    def _shape(self) -> tuple[int, int, int]:
        return len(self.every), *self.features.exponents.shape

    def _square(self, terms: np.ndarray, sums: sparse.csr_matrix) -> np.ndarray:
        n, _, nv = self._shape
        return (terms @ sums).reshape(n, nv, nv)


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
    def variables(self) -> np.ndarray:
        """Which coordinates are variables of the monomials, (V,)."""
        return np.array(self.dynamics.polynomial_variables)

    def at(self, q: np.ndarray) -> FeaturePoint:
        """The features at coordinates (N, Nq), with their derivatives."""
        return FeaturePoint(self, q, self.monomials.at(q[:, self.variables]))


@dataclass(frozen=True, eq=False)
class FeaturePoint:
    """Features at N points of the coordinates.

    Attributes
    ----------
    features : which they are
    q : (N, Nq) coordinates
    monomials : those of them that are monomials
    """

    features: PathFeatures
    q: np.ndarray
    monomials: MonomialPoint

    @property
    def values(self) -> np.ndarray:
        """Values (N, F)."""
        return np.hstack([self.monomials.values, self._rotation[0]])

    def gradients(self) -> np.ndarray:
        """Gradients (N, F, Nq)."""
        return self._joined(self.monomials.gradients(), self._rotation[1])

    def directional(self, rate: np.ndarray) -> np.ndarray:
        """Gradients of grad f . rate, (N, F, Nq), for rate (N, Nq)."""
        none = np.zeros((len(self.q), ROTATION_FEATURES))
        rotation, _, _ = self.features.dynamics.feature_second(self.q, rate, none, none)
        return self._joined(self.monomials.directional(rate[:, self.features.variables]), rotation)

    def curvature(self, weights: np.ndarray) -> np.ndarray:
        """sum_k weights_k hess f_k, (N, Nq, Nq), for weights (N, F)."""
        own, rotation = self._split(weights)
        still, none = np.zeros_like(self.q), np.zeros_like(rotation)
        _, total, _ = self.features.dynamics.feature_second(self.q, still, rotation, none)
        return self._add(total, self.monomials.curvature(own))

    def directional_curvature(self, *along: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """sum_k weights_k hess(grad f_k . rate), (N, Nq, Nq), summed over pairs `along`.

        Parameters
        ----------
        along : rate (N, Nq) and weights (N, F)
        """
        total: np.ndarray | float = 0.0
        of_monomials = []
        for rate, weights in along:
            own, rotation = self._split(weights)
            none = np.zeros_like(rotation)
            _, _, added = self.features.dynamics.feature_second(self.q, rate, none, rotation)
            total = total + added
            of_monomials.append((rate[:, self.features.variables], own))
        return self._add(np.asarray(total), self.monomials.directional_curvature(*of_monomials))

    @cached_property
    def _rotation(self) -> tuple[np.ndarray, np.ndarray]:
        return self.features.dynamics.features(self.q)

    def _split(self, weights: np.ndarray) -> list[np.ndarray]:
        """Weights of the monomials, and of the entries of rotation matrices."""
        return np.split(weights, [len(self.features.monomials.exponents)], axis=1)

    def _joined(self, monomials: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Gradients (N, F, Nq) from those by the variables of monomials and by coordinates."""
        full = np.zeros((*monomials.shape[:2], self.q.shape[1]))
        full[:, :, self.features.variables] = monomials
        return np.concatenate([full, rotation], axis=1)

    def _add(self, total: np.ndarray, monomials: np.ndarray) -> np.ndarray:
        """Second derivatives (N, Nq, Nq) with those of the monomials (N, V, V) added."""
        idx = self.features.variables
        total[np.ix_(np.arange(len(total)), idx, idx)] += monomials
        return total
