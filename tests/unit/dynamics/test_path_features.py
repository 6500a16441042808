"""Features and their contracted derivatives, against plain powers and central differences."""

import numpy as np
import pytest
from derivatives import differences

from scapulohumeral.dynamics.path_features import MonomialFeatures, PathFeatures

pytestmark = pytest.mark.unit

H = 1e-6


def random_exponents(rng, count=40, variables=10):
    """Distinct rows of total degree up to five, the constant among them."""
    rows = rng.integers(0, 4, (count, variables)) * (rng.random((count, variables)) < 0.25)
    rows[0] = 0
    return np.unique(rows[rows.sum(axis=1) <= 5], axis=0)


def check_derivatives(features, x, rng):
    """First derivatives, directional gradients and weighted Hessians of f(x)."""
    point = features.at(x)
    values, gradients = point.values, point.gradients()
    size = values.shape[1]
    np.testing.assert_allclose(
        gradients, differences(lambda v: features.at(v).values, x), atol=1e-8
    )
    rate = rng.normal(size=x.shape)
    weights, rate_weights = rng.normal(size=(2, len(x), size))
    directional, hessian = point.directional(rate), point.curvature(weights)
    rate_hessian = point.directional_curvature((rate, rate_weights))
    twice = point.directional_curvature((rate, rate_weights), (2.0 * rate, rate_weights))

    def slope(v):
        return np.einsum("nfi,ni->nf", features.at(v).gradients(), rate)

    def weighted(v):
        return np.einsum("nfi,nf->ni", features.at(v).gradients(), weights)

    def weighted_slope_gradient(v):
        return np.einsum("nfi,nf->ni", features.at(v).directional(rate), rate_weights)

    np.testing.assert_allclose(directional, differences(slope, x), atol=1e-7)
    np.testing.assert_allclose(hessian, differences(weighted, x), atol=1e-7)
    np.testing.assert_allclose(rate_hessian, differences(weighted_slope_gradient, x), atol=1e-7)
    np.testing.assert_allclose(twice, 3.0 * rate_hessian, atol=1e-12)


def test_monomials_are_products_of_powers():
    rng = np.random.default_rng(1)
    exponents, v = random_exponents(rng), rng.uniform(-1, 1, (5, 10))
    values = MonomialFeatures(exponents).at(v).values
    np.testing.assert_allclose(values, np.prod(v[:, None] ** exponents, axis=2), rtol=1e-12)


def test_one_monomial_by_hand():
    """x^2 y at (3, 2): value 18, gradient (12, 9), along (1, 1) its rate grows by (4 + 6, 6)."""
    exponents = np.zeros((1, 10), int)
    exponents[0, :2] = 2, 1
    v = np.zeros((1, 10))
    v[0, :2] = 3.0, 2.0
    rate = np.zeros((1, 10))
    rate[0, :2] = 1.0, 1.0
    point = MonomialFeatures(exponents).at(v)
    assert point.values.item() == 18.0
    np.testing.assert_allclose(point.gradients()[0, 0, :2], [12.0, 9.0])
    directional, hessian = point.directional(rate), point.curvature(np.ones((1, 1)))
    third = point.directional_curvature((rate, np.ones((1, 1))))
    np.testing.assert_allclose(directional[0, 0, :2], [10.0, 6.0])
    np.testing.assert_allclose(hessian[0, :2, :2], [[4.0, 6.0], [6.0, 0.0]])
    np.testing.assert_allclose(third[0, :2, :2], [[2.0, 2.0], [2.0, 0.0]])


def test_zero_variables_give_finite_derivatives():
    """Derivatives of powers must not divide by the variable."""
    features = MonomialFeatures(random_exponents(np.random.default_rng(2)))
    check_derivatives(features, np.zeros((1, 10)), np.random.default_rng(3))


def test_monomial_derivatives_match_differences():
    rng = np.random.default_rng(4)
    features = MonomialFeatures(random_exponents(rng))
    check_derivatives(features, rng.uniform(-1, 1, (4, 10)), rng)


def test_all_derivatives_match_differences_in_the_coordinates(equations):
    rng = np.random.default_rng(5)
    features = PathFeatures(MonomialFeatures(random_exponents(rng)), equations)
    check_derivatives(features, rng.uniform(-0.9, 0.9, (4, len(equations.coordinate_names))), rng)
