"""Factors of a person on made-up signatures, where the truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import NODES, SETUP

from scapulohumeral.gap.effects import strength_loss
from scapulohumeral.gap.effects.base import Setup
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.isolation.channel_gains import (
    expected_left,
    freed_of_prior,
    gain_factors,
    predicted_change,
)
from scapulohumeral.gap.isolation.hypothesis import Hypothesis, pair
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.labels import JOIN
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.residual import Residual

pytestmark = pytest.mark.unit

CHANNELS, TASKS, PHASES = len(KINEMATIC_CHANNELS), ("a", "b"), 4
SIZE = len(TASKS) * CHANNELS * PHASES
EFFECTS = {e.label: e for e in library(SETUP)}
DAMPING = EFFECTS["body/joint_damping/GH"]
TILT = next(e for e in EFFECTS.values() if not e.changes_body)


def hypothesis(effect, seed):
    slope = 40.0 * np.random.default_rng(seed).normal(size=(SIZE, len(effect.params)))
    return Hypothesis((effect,), np.zeros(slope.shape[1]), np.zeros((SIZE, 1)), slope, 1.0)


def residual(delta):
    functions = phase_functions(NODES, PHASES)
    noise = np.eye(SIZE)
    return Residual(delta, noise, noise, functions, TASKS, KINEMATIC_CHANNELS, (8.0,) * 2)


@pytest.fixture
def truth():
    """An effect, factors of a person, and the difference both make."""
    factors = np.linspace(0.6, 1.4, CHANNELS)
    effect = hypothesis(DAMPING, 1)
    change = effect.predict(np.ones(1))
    there = residual(change)
    rng = np.random.default_rng(2)
    return effect, factors, residual(there.scaled(change, factors) + rng.normal(size=SIZE))


def test_factors_are_those_of_the_person(truth):
    effect, factors, there = truth
    fitted = fit(effect, there, 0.3)
    [found] = gain_factors(fitted, there, 0.3)
    (x,), _ = freed_of_prior(fitted)
    np.testing.assert_allclose(x * found, factors, atol=0.2)


def test_a_prior_is_taken_out_of_what_the_data_know(truth):
    """With weak data the estimate stays where the prior and they put it."""
    effect, _, there = truth
    plain = replace(there, delta=effect.predict(np.ones(1)))
    for noise, known in ((400.0, True), (1e6, False)):
        weak = replace(plain, covariance=noise * plain.covariance)
        fitted = fit(effect, weak, 0.0)
        x, variance = freed_of_prior(fitted)
        if known:
            np.testing.assert_allclose(x, 1.0, atol=1e-6)
            assert variance > fitted.covariance[0, 0]
        else:
            np.testing.assert_array_equal(x, fitted.x)


def test_parameters_keep_their_order_without_the_prior():
    """What is left of the fibres is no stronger than it was, whatever data say of each."""
    weak = strength_loss.members(Setup(("supra", "delt"), (), (), contact=False))[0]
    [(first, second)] = weak.order
    size, kept_apart = 24, 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        slope = rng.normal(size=(size, 2)) * rng.uniform(0.5, 6.0, size=2)
        alone = Hypothesis((weak,), np.zeros(2), np.zeros((size, 1)), slope, 1.0)
        unit = np.eye(size)
        delta = slope @ [-0.9, -0.8] + rng.normal(size=size)
        there = Residual(delta, unit, unit, unit, ("t",), ("EMG_a",), (4.0,))
        fitted = fit(alone, there, 0.3)
        x, _ = freed_of_prior(fitted)
        assert x[first] <= x[second] + 1e-12
        kept_apart += x[first] == x[second]
    assert 0 < kept_apart < 100


def test_factors_of_one_task_hold_for_another(truth):
    effect, _, there = truth
    training = there.part(["a"])
    rows = there.rows(["b"])
    plain = fit(effect.part(there.rows(["a"])), training, 0.3)
    before = there.delta - effect.predict(plain.x)
    after = there.delta - predicted_change(effect, training, there, 0.3)
    assert np.linalg.norm(after[rows]) < 0.6 * np.linalg.norm(before[rows])


def test_factors_are_never_negative(truth):
    effect, factors, there = truth
    turned = factors.copy()
    turned[0] = -3.0
    opposite = replace(there, delta=there.scaled(effect.predict(np.ones(1)), turned))
    assert gain_factors(fit(effect, opposite, 0.3), opposite, 0.3).min() == 0.0


def test_effects_on_the_record_have_no_factors(truth):
    effect, _, there = truth
    both = pair(fit(hypothesis(TILT, 3), there, 0.3), fit(effect, there, 0.3))
    assert [one.label for one in both.effects] == both.label.split(JOIN)
    factors = gain_factors(fit(both, there, 0.3), there, 0.3)
    assert factors.shape == (2, CHANNELS)
    assert np.all(factors[0] != 1.0)
    np.testing.assert_array_equal(factors[1], 1.0)
    x, _ = freed_of_prior(fit(both, there, 0.0))
    np.testing.assert_allclose(
        predicted_change(both, there, there, 0.0), both.predict(x), rtol=1e-9
    )


def test_what_is_left_of_another_task_is_as_large_as_expected():
    """Differences are drawn with the errors that predictions are assumed to have."""
    effect, rng = hypothesis(DAMPING, 1), np.random.default_rng(4)
    plain = residual(effect.predict(np.ones(1)))
    error = effect.error(np.ones(1), plain, 0.3)
    factor = np.linalg.cholesky(np.linalg.inv(error.solve(np.eye(SIZE))))
    trained, rest = plain.rows(["a"]), plain.rows(["b"])
    squares, alone = [], []
    for _ in range(40):
        there = replace(plain, delta=plain.delta + factor @ rng.normal(size=SIZE))
        covariance = expected_left(effect, there.part(["a"]), there, 0.3)
        left = there.delta - predicted_change(effect, there.part(["a"]), there, 0.3)
        squares.append(left[rest] @ np.linalg.solve(covariance, left[rest]) / len(rest))
        alone.append(np.trace(covariance) / np.trace((factor @ factor.T)[np.ix_(rest, rest)]))
    assert len(trained) == len(rest)
    assert np.median(squares) == pytest.approx(1.0, abs=0.3)
    assert np.median(alone) < 0.8  # the other task has told a part of the person's factors


def test_only_noise_is_left_by_an_exact_prediction(truth):
    effect, _, there = truth
    covariance = expected_left(effect, there.part(["a"]), there, 0.0)
    assert np.diag(covariance).min() >= 1.0 - 1e-9
    assert np.diag(covariance).mean() == pytest.approx(1.0, abs=0.05)
