"""Loads shared among muscles: the minimiser that a general solver finds too."""

from types import SimpleNamespace

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


@pytest.mark.parametrize("seed", [16, 40, 65, 108, 116])
def test_muscles_of_very_unequal_strength_share_a_load_in_few_steps(seed, monkeypatch):
    """Steps that merely lower the cost took more than a hundred here, and the start was refused."""
    monkeypatch.setattr(initial_guess, "SHARING_STEPS", 40)
    rng = np.random.default_rng(seed)
    strength = 3.0 * np.exp(1.5 * rng.standard_normal((126, 10))[:, :1])
    moments = strength * rng.standard_normal((126, 10))
    target = 30.0 * np.exp(2.0 * rng.standard_normal()) * rng.standard_normal(10)
    found = initial_guess.shared_load(moments, target)
    unbalanced = target - moments.T @ found
    wanted = np.clip(
        moments @ unbalanced / initial_guess.EFFORT_WEIGHT**2, *initial_guess.START_ACTIVATION
    )
    # Strong muscles multiply what the steps leave of the balance.
    np.testing.assert_allclose(found, wanted, atol=1e-3)


def test_a_load_that_is_not_a_number_is_refused():
    with pytest.raises(SolveError, match="out of balance"):
        initial_guess.shared_load(np.ones((3, 2)), np.array([np.nan, 1.0]))


def test_a_start_outside_the_fitted_paths_stays_with_the_recording(monkeypatch):
    """Relief of contact may leave the region where muscle lengths are numbers."""
    recorded, seen = np.zeros((3, 10)), []

    class Forces:
        dynamics = SimpleNamespace(name="euler")

        def lengths(self, q, u):
            return np.where(q[:, :1] > 1.0, np.nan, 0.1) * np.ones((1, 4)), None

    def relieved(forces, parameters, q):
        return q + np.array([0.5, 2.0, 0.5])[:, None]

    def balanced(forces, muscles, parameters, q, u, step):
        seen.append(q)
        return np.zeros((3, 4)), np.zeros((3, 3))

    monkeypatch.setattr(initial_guess, "relieve_contact", relieved)
    monkeypatch.setattr(initial_guess, "speeds", lambda forces, q, step: np.zeros_like(q))
    monkeypatch.setattr(initial_guess, "static_optimisation", balanced)
    initial_guess.from_motion(Forces(), None, None, recorded, 0.04)
    np.testing.assert_array_equal(seen[0][:, 0], [0.5, 0.0, 0.5])


def test_rounding_is_no_reason_to_refuse_a_start(monkeypatch):
    """Where the cost cannot fall in its last digits, the load is shared all the same."""
    monkeypatch.setattr(initial_guess, "SHARING_TOLERANCE", 0.0)
    rng = np.random.default_rng(1)
    moments, target = 20.0 * rng.normal(size=(40, 10)), 10.0 * rng.normal(size=10)
    found = initial_guess.shared_load(moments, target)
    np.testing.assert_allclose(moments.T @ found, target, atol=0.05)
