"""Loads shared among muscles: the minimiser that a general solver finds too."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from scapulohumeral.errors import SolveError
from scapulohumeral.ocp.solving import initial_guess

pytestmark = pytest.mark.unit


@pytest.mark.parametrize("seed", range(5))
def test_shared_load_is_the_least_squares_minimiser(seed):
    rng = np.random.default_rng(seed)
    moments = 20.0 * rng.normal(size=(40, 10)) * (rng.random((40, 10)) < 0.4)
    # From light loads to some that the muscles cannot bear.
    target = 10.0 ** rng.uniform(-1, 3) * rng.normal(size=10)
    effort = initial_guess.EFFORT_WEIGHT * np.eye(40)
    expected = lsq_linear(
        np.vstack([moments.T, effort]),
        np.concatenate([target, np.zeros(40)]),
        initial_guess.START_ACTIVATION,
        tol=1e-13,
    )
    found = initial_guess.shared_load(moments, target)
    np.testing.assert_allclose(found, expected.x, atol=1e-5)


def test_a_load_that_is_not_a_number_is_refused():
    with pytest.raises(SolveError, match="out of balance"):
        initial_guess.shared_load(np.ones((3, 2)), np.array([np.nan, 1.0]))
