"""Scalers refined from EMG: known ones are found within their intervals, from noisy envelopes."""

from dataclasses import replace

import numpy as np
import pytest
from emg_study import ENVELOPE
from small_arm import small_muscles
from small_posed import small_posed, small_settings, small_target

from scapulohumeral.emg.accuracy import channel_gain, correlation_time_s, noise_sd
from scapulohumeral.model.rotations import pose_to_trial
from scapulohumeral.ocp.emg_term import EmgTerm
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solving.solver import SolverSettings, Start, solve
from scapulohumeral.stages.refinement import Evidence, RefinementSettings, refine

pytestmark = pytest.mark.unit

NODES, STEP = 30, 0.02
# The motion alone decides the excitations, so that scalers show in them.
LITTLE = dict.fromkeys(("activation", "regularisation", "excitation_rate"), 1e-6)
GROUPS = Scalers(("upper", "lower"), np.array([[1, 1, 0], [0, 0, 1]], dtype=bool))
TRUE = np.array([[0.85, 1.2], [1.08, 0.93]])
CHANNELS = np.eye(3)
SETTINGS = RefinementSettings(
    barrier_target=1e-6,
    model_sd=0.01,
    prior_sd_force=0.3,
    prior_sd_fibre=0.2,
    prior_sd_time=0.2,
    largest_step=0.25,
    smallest_step=0.005,
    iterations=25,
)


def evidence(envelopes, nodes=None) -> Evidence:
    """Envelopes of one channel per muscle."""
    nodes = nodes or {"slow": (0, len(envelopes))}
    return Evidence(CHANNELS, envelopes, nodes, ENVELOPE, STEP)


def optimum(posed) -> Start:
    """Solution of a problem, smoothed like those of the refinement."""
    x = posed.cold_start()
    settings = SolverSettings(tolerance=1e-6, barrier_target=SETTINGS.barrier_target)
    result = solve(posed.problem, Start(posed.layout().join(x)), settings)
    assert result.optimal, result.message
    return result.point


def coloured_noise(shape: tuple[int, int], seed: int) -> np.ndarray:
    """Unit noise with the correlation time of envelopes: a first-order autoregression."""
    shared = correlation_time_s(ENVELOPE) / STEP
    memory = (shared - 1) / (shared + 1)
    white = np.random.default_rng(seed).normal(size=shape)
    noise = white.copy()
    for node in range(1, len(noise)):
        noise[node] = memory * noise[node - 1] + np.sqrt(1 - memory**2) * white[node]
    return noise


@pytest.fixture(scope="module")
def study(quaternion_equations):
    """An arm that follows what its muscles can do, and what scaled muscles excite for it."""
    phase = 4 * np.pi * np.linspace(0, 1, NODES)[:, None] + np.array([0.0, 1.0, 2.0])
    driven = EmgTerm(np.eye(3), 0.2 + 0.1 * np.sin(phase), np.ones(NODES))
    settings = small_settings(STEP, **LITTLE, trajectory_quaternion=1.0, emg=1e4)
    scaled = GROUPS.apply(small_muscles(), TRUE)
    driver = small_posed(quaternion_equations, small_target(NODES, STEP, emg=driven), settings)
    moved = driver.layout().split(optimum(replace(driver, muscles=scaled)).free)

    target = small_target(NODES, STEP, reference_rad=pose_to_trial(moved.q))
    settings = small_settings(STEP, **LITTLE, trajectory_quaternion=1e4)
    posed = small_posed(quaternion_equations, target, settings)
    excitation = posed.layout().split(optimum(replace(posed, muscles=scaled)).free).e
    return posed, optimum(posed), excitation


def test_channels_pass_the_low_pass_of_envelopes_motion_by_motion():
    time = STEP * np.arange(200)
    slow, fast = (1 + np.cos(2 * np.pi * f * time) for f in (0.5, ENVELOPE.cutoff_hz))
    mixed = Evidence(
        np.array([[0.5, 0.5, 0.0]]), np.zeros((200, 1)), {"a": (0, 80), "b": (100, 200)},
        ENVELOPE, STEP,
    )  # fmt: skip
    excitation = np.column_stack([slow, slow, fast])
    seen = mixed.seen(excitation)
    assert seen.shape == mixed.recorded().shape == (180, 1)
    inside = np.r_[20:60, 120 : 180 - 20]
    node = np.r_[0:80, 100:200][inside]
    np.testing.assert_allclose(seen[inside, 0], slow[node], atol=0.02)
    # Half the power passes at the edge, so that simulated and predicted EMG lose the same.
    alone = replace(mixed, channels=np.array([[0.0, 0.0, 1.0]])).seen(excitation)[inside, 0]
    assert np.std(alone) / np.std(fast[node]) == pytest.approx(np.sqrt(0.5), abs=0.03)
    # Derivatives pass like values.
    stacked = mixed.seen(np.stack([excitation, 2 * excitation], axis=-1))
    np.testing.assert_allclose(stacked[..., 1], 2 * seen, atol=1e-12)
    # What lies between the motions is unknown and leaves no trace.
    changed = excitation.copy()
    changed[80:100] = 7.0
    np.testing.assert_array_equal(mixed.seen(changed), seen)


def test_exact_envelopes_give_the_scalers_behind_them(study):
    posed, start, excitation = study
    clean = evidence(excitation)
    clean = replace(clean, envelopes=(1 + channel_gain(ENVELOPE)[0]) * clean.seen(excitation))
    loose = replace(SETTINGS, prior_sd_force=3.0, prior_sd_fibre=3.0, smallest_step=1e-4)
    refined = refine(posed, GROUPS, clean, start, loose)
    assert refined.converged
    np.testing.assert_allclose(refined.values, TRUE, atol=2e-3)
    assert refined.misfit < 0.01


def test_noisy_envelopes_give_the_scalers_within_their_intervals(study):
    posed, start, excitation = study
    seen = (1 + channel_gain(ENVELOPE)[0]) * evidence(excitation).seen(excitation)
    noise = noise_sd(seen, ENVELOPE) * coloured_noise(seen.shape, seed=1)
    refined = refine(posed, GROUPS, evidence(np.maximum(seen + noise, 0.0)), start, SETTINGS)
    assert refined.converged
    sd = np.sqrt(np.diag(refined.covariance)).reshape(2, 2)
    error = np.abs(refined.values - TRUE) / sd
    assert error.max() < 3.0
    assert np.sum(error < 1.645) >= 3, "90 % intervals hold all but one of four at least"
    # EMG tells more than what was known before, of most scalers.
    prior = np.array([[SETTINGS.prior_sd_force], [SETTINGS.prior_sd_fibre]])
    assert (sd < prior).sum() >= 3
    assert (sd < 0.5 * prior).any()


def test_bounds_hold_when_emg_asks_for_more(study):
    posed, start, excitation = study
    tight = replace(GROUPS, force_bounds=(0.95, 1.05), fibre_bounds=(0.98, 1.02))
    envelopes = evidence(excitation).seen(excitation)
    refined = refine(posed, tight, evidence(envelopes), start, replace(SETTINGS, iterations=2))
    low, high = np.array([[0.95, 1.05], [0.98, 1.02]]).T[:, :, None]
    assert (refined.values > low - 1e-6).all()
    assert (refined.values < high + 1e-6).all()
    at_bound = np.minimum(refined.values - low, high - refined.values) < 1e-3
    assert at_bound.any()
