"""Noise between repeats, and what it says without any."""

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, SETTINGS

from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.noise import draws, trial_noise
from scapulohumeral.gap.residual.residual import Residual, compress

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 4)


def repeats(rng, count, size):
    """Curves (count, N, K) that vary smoothly about a common mean."""
    coefficients = rng.normal(size=(count, 4, len(NAMES))) * size
    return 5.0 + np.einsum("nb,lbk->lnk", FUNCTIONS, coefficients)


def test_curves_come_back_from_their_coefficients():
    curves = repeats(np.random.default_rng(0), 2, 1.0)
    vector = compress(list(curves), FUNCTIONS)
    identity = np.eye(len(vector))
    residual = Residual(vector, identity, identity, FUNCTIONS, ("a", "b"), NAMES, 3)
    np.testing.assert_allclose(residual.curves(vector), curves)
    part = residual.part(["b"])
    np.testing.assert_allclose(part.curves(part.delta)[0], curves[1])


def test_many_repeats_show_their_own_covariance():
    groups = [repeats(np.random.default_rng(1), 400, 2.0)]
    noise = trial_noise(groups, NAMES, FUNCTIONS, SETTINGS.noise)
    assert noise.source == "repeats"
    assert noise.degrees == 399
    np.testing.assert_allclose(np.diag(noise.covariance), 4.0, rtol=0.2)


def test_without_repeats_prior_knowledge_counts():
    noise = trial_noise(
        [repeats(np.random.default_rng(1), 1, 2.0)], NAMES, FUNCTIONS, SETTINGS.noise
    )
    assert noise.source == "configuration"
    total = np.diag(noise.covariance).reshape(len(NAMES), -1).sum(axis=1) / NODES
    np.testing.assert_allclose(np.sqrt(total[:10]), SETTINGS.noise.kinematics_deg)
    np.testing.assert_allclose(np.sqrt(total[10:]), SETTINGS.noise.emg)


def test_whitened_noise_has_size_one():
    rng = np.random.default_rng(2)
    root = rng.normal(size=(56, 56))
    covariance = root @ root.T + np.eye(56)
    residual = Residual(np.zeros(56), covariance, 0.5 * covariance, FUNCTIONS, ("a",), NAMES, 40)
    white = residual.whiten(draws(residual, 4000, 3))
    np.testing.assert_allclose(np.cov(white), np.eye(56), atol=0.15)


def test_some_channels_keep_their_curves_and_their_covariance():
    rng = np.random.default_rng(4)
    curves = repeats(rng, 2, 1.0)
    vector = compress(list(curves), FUNCTIONS)
    root = rng.normal(size=(len(vector), len(vector)))
    whole = Residual(vector, root @ root.T, np.eye(len(vector)), FUNCTIONS, ("a", "b"), NAMES, 3)
    part = whole.only(CHANNELS)
    np.testing.assert_allclose(part.curves(part.delta), curves[..., 10:])
    np.testing.assert_allclose(part.spread, whole.spread[..., 10:])
    assert part.channels == CHANNELS
