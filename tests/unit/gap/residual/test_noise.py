"""Noise between repeats: of a case, of other people, and of where in the movement a trial is."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, SETTINGS, small_record
from scipy.interpolate import CubicSpline
from scipy.stats import chi2

from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    channel_rates,
    difference,
    phase_functions,
)
from scapulohumeral.gap.residual.noise import (
    LEAST_SCALE,
    OWN_SHAPE,
    Repeats,
    SessionShares,
    deviation,
    draws,
    timing,
    total_covariance,
    trial_noise,
)
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.model.rotations import pose_to_trial, trial_to_pose

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 4)
PRIOR = SETTINGS.noise
LEVELS = np.array([deviation(PRIOR, name) for name in NAMES])
STILL = replace(PRIOR, phase_shift=[1e-9])
RECORD = small_record()


def generator(seed):
    return np.random.default_rng(seed)


def curves(rng, count, sizes):
    """Curves (count, N, K) that vary about a common mean, by (K,) each, slow ones the most."""
    shape = 1.0 / np.arange(1, 5)
    shape = np.sqrt(NODES * shape / shape.sum())[:, None]
    coefficients = shape * rng.normal(size=(count, 4, len(NAMES))) * sizes
    return 5.0 + np.einsum("nb,lbk->lnk", FUNCTIONS, coefficients)


def repeats(rng, count, sizes=LEVELS):
    """Repeats of one side; of sizes (K,) as other people's unless told."""
    return Repeats(RECORD, (curves(rng, count, sizes),))


def noise_of(tasks, prior=STILL):
    return trial_noise(tasks, NAMES, FUNCTIONS, prior)


def variances(covariance):
    """Mean square (K,) of each channel over the nodes."""
    return np.diag(covariance).reshape(len(NAMES), -1).sum(axis=1) / NODES


def test_curves_come_back_from_their_coefficients():
    some = curves(generator(0), 2, LEVELS)
    vector = compress(list(some), FUNCTIONS)
    identity = np.eye(len(vector))
    residual = Residual(vector, identity, identity, FUNCTIONS, ("a", "b"), NAMES, (3.0, 7.0))
    np.testing.assert_allclose(residual.curves(vector), some)
    part = residual.part(["b"])
    np.testing.assert_allclose(part.curves(part.delta)[0], some[1])
    assert part.degrees == (7.0,)


def test_many_repeats_show_their_own_covariance():
    sizes = 2.0 * np.linspace(0.5, 2.0, len(NAMES)) * LEVELS
    noise = noise_of({"a": repeats(generator(1), 4000, sizes)})
    assert noise.source == "repeats"
    assert noise.degrees == {"a": 3999}
    assert noise.worth == {"a": 3999 + PRIOR.repeats}
    np.testing.assert_allclose(variances(noise.covariances["a"]), sizes**2, rtol=0.1)


def test_repeats_of_both_sides_scatter_about_their_own_means():
    rng = generator(2)
    sides = curves(rng, 300, LEVELS), 40.0 + curves(rng, 200, LEVELS)
    noise = noise_of({"a": Repeats(RECORD, sides)})
    assert noise.degrees == {"a": 498}
    np.testing.assert_allclose(variances(noise.covariances["a"]), LEVELS**2, rtol=0.15)


def test_without_repeats_prior_knowledge_counts():
    noise = noise_of({"a": repeats(generator(1), 1), "b": repeats(generator(3), 1)})
    assert noise.source == "configuration"
    assert noise.worth == {"a": PRIOR.repeats, "b": PRIOR.repeats}
    for covariance in noise.covariances.values():
        np.testing.assert_allclose(np.sqrt(variances(covariance)), LEVELS, rtol=1e-6)


def test_emg_of_other_people_scatters_with_its_height():
    prior = replace(STILL, emg_relative=0.3)
    one = Repeats(replace(RECORD, emg=2.0 * RECORD.emg), (np.zeros((1, NODES, len(NAMES))),))
    found = variances(noise_of({"a": one}, prior).covariances["a"])
    height = 2.0 * np.sqrt(np.mean(RECORD.emg**2, axis=0))
    np.testing.assert_allclose(found[10:], PRIOR.emg**2 + (0.3 * height) ** 2, rtol=1e-6)
    np.testing.assert_allclose(found[:10], LEVELS[:10] ** 2, rtol=1e-6)


def test_a_channel_that_scatters_more_does_so_in_tasks_without_repeats():
    """By the geometric mean of what it shows and of what others do, as repeats are worth."""
    loud = LEVELS.copy()
    loud[3] *= 4.0
    shown = repeats(generator(4), 2001, loud)
    noise = noise_of({"shown": shown, "alone": repeats(generator(5), 1)})
    found = variances(noise.covariances["alone"]) / LEVELS**2
    assert found[3] == pytest.approx(16.0, rel=0.1)
    np.testing.assert_allclose(np.delete(found, 3), 1.0, rtol=0.1)
    few = replace(STILL, repeats=2000.0)
    found = variances(
        noise_of({"shown": shown, "alone": repeats(generator(5), 1)}, few).covariances["alone"]
    )
    assert found[3] / LEVELS[3] ** 2 == pytest.approx(4.0, rel=0.1)


def test_a_task_that_scatters_more_keeps_that_to_itself():
    calm, wild = (repeats(generator(6 + i), 1001, f * LEVELS) for i, f in enumerate((0.5, 2.0)))
    noise = noise_of({"calm": calm, "wild": wild})
    for task, share in (("calm", 0.25), ("wild", 4.0)):
        found = variances(noise.covariances[task]) / LEVELS**2
        np.testing.assert_allclose(found, share, rtol=0.25)


def test_few_repeats_say_little_of_how_channels_go_together():
    """What they show of it counts for at most half, and for less the fewer they are."""
    one = repeats(generator(8), 4)
    centred = compress([one.sides[0] - one.sides[0].mean(axis=0)], FUNCTIONS)
    shown = centred @ centred.T / 3
    found = noise_of({"a": one}).covariances["a"]
    outside = ~np.eye(len(found), dtype=bool)
    share = OWN_SHAPE * 3 / (3 + PRIOR.repeats)
    np.testing.assert_allclose(found[outside], share * shown[outside], atol=1e-9)
    np.linalg.cholesky(found)


def test_equal_repeats_are_no_certainty():
    same = Repeats(RECORD, (np.ones((50, NODES, len(NAMES))),))
    found = variances(noise_of({"a": same}).covariances["a"])
    share = 49 / (49 + PRIOR.repeats)
    kept = (1.0 - OWN_SHAPE * share) * LEAST_SCALE ** (2.0 * share)
    assert np.all(found >= 0.9 * kept * LEVELS**2)


def shifted(record, shift):
    """A record that is elsewhere in its movement by (N,) of its duration, by splines."""
    phase = np.linspace(0.0, 1.0, NODES)
    at = np.clip(phase + shift, 0.0, 1.0)
    angles = CubicSpline(phase, pose_to_trial(record.pose))(at)
    emg = CubicSpline(phase, record.emg)(at)
    force = CubicSpline(phase, record.contact_N)(at)
    return Observation(record.duration_s, trial_to_pose(angles), record.channels, emg, force)


@pytest.fixture
def bent():
    """A record of which every channel has a rate that changes little from node to node."""
    phase = np.linspace(0.0, 1.0, NODES)[:, None]
    angles = 0.2 + 0.4 * np.arange(1, 11) / 10.0 * (phase + 0.2 * phase**2)
    emg = 0.1 + phase * [0.2, 0.3] - 0.1 * phase**2
    force = 100.0 * phase * [1.0, -2.0, 0.5]
    return Observation(1.3, trial_to_pose(angles), CHANNELS, emg, force)


def test_rates_are_those_of_a_record_a_little_later(bent):
    """Inside of the movement; at its ends there is one side only."""
    step = 0.01
    later, sooner = (shifted(bent, sign * np.full(NODES, step)) for sign in (1.0, -1.0))
    expected = difference(later, sooner) / (2.0 * step)
    found = channel_rates(bent)
    assert found.shape == (NODES, 15)
    np.testing.assert_allclose(found[1:-1], expected[1:-1], rtol=0.02, atol=1e-3)
    at_ends = np.abs(found[[0, -1]] - 2.0 * expected[[0, -1]]) / np.abs(expected).max(axis=0)
    assert at_ends.max() < 0.15


def test_timing_is_one_curve_that_all_channels_share(bent):
    """Each column is the change of the record by one cosine of phase, as large as it varies."""
    sizes = (0.02, 0.01)
    columns = timing(bent, FUNCTIONS, sizes)
    assert columns.shape == (15 * 4, 2)
    phase = np.linspace(0.0, 1.0, NODES)
    for i, (size, column) in enumerate(zip(sizes, columns.T, strict=True)):
        shape = np.cos(np.pi * i * phase)
        change = channel_rates(bent) * shape[:, None] * size
        np.testing.assert_allclose(column, compress([change], FUNCTIONS), atol=1e-12)
        moved = difference(shifted(bent, size * shape), bent)
        inside = slice(2, -2)
        np.testing.assert_allclose(moved[inside], change[inside], rtol=0.05, atol=0.05 * size)


def test_timing_moves_all_channels_together(bent):
    prior = replace(PRIOR, phase_shift=[0.03, 0.02])
    names = (*NAMES, "GHF_x", "GHF_y", "GHF_z")
    one = {"a": Repeats(bent, (np.zeros((1, NODES, 15)),))}
    timed, still = (trial_noise(one, names, FUNCTIONS, p).covariances["a"] for p in (prior, STILL))
    columns = timing(bent, FUNCTIONS, prior.phase_shift)
    np.testing.assert_allclose(timed - still, columns @ columns.T, atol=1e-6)


def test_whitened_noise_has_size_one():
    rng = generator(2)
    root = rng.normal(size=(56, 56))
    covariance = root @ root.T + np.eye(56)
    residual = Residual(
        np.zeros(56), covariance, 0.5 * covariance, FUNCTIONS, ("a",), NAMES, (1e3,)
    )
    white = residual.whiten(draws(residual, 4000, 3))
    np.testing.assert_allclose(np.cov(white), np.eye(56), atol=0.15)


def test_each_task_has_the_tails_of_its_own_degrees_of_freedom():
    """Squares of few degrees are F distributed: their tails are heavy, and not shared by tasks."""
    size = len(NAMES) * 4
    identity = np.eye(2 * size)
    residual = Residual(
        np.zeros(2 * size), identity + 1e-9 * identity, identity, FUNCTIONS, ("a", "b"), NAMES,
        (4.0, 400.0),
    )  # fmt: skip
    drawn = draws(residual, 8000, 1).reshape(2, size, -1)
    squares = np.mean(drawn**2, axis=1)
    # Of many coefficients with one scale, the mean square is the degrees over a chi-square.
    for found, degrees in zip(squares, (4.0, 400.0), strict=True):
        expected = degrees / chi2.ppf([0.95, 0.5, 0.05], degrees)
        np.testing.assert_allclose(np.quantile(found, [0.05, 0.5, 0.95]), expected, rtol=0.3)
    assert np.quantile(squares[0], 0.99) > 5.0 * np.quantile(squares[1], 0.99)
    assert abs(np.corrcoef(np.log(squares))[0, 1]) < 0.05


def test_some_channels_keep_their_curves_and_their_covariance():
    rng = generator(4)
    some = curves(rng, 2, LEVELS)
    vector = compress(list(some), FUNCTIONS)
    root = rng.normal(size=(len(vector), len(vector)))
    whole = Residual(
        vector, root @ root.T, np.eye(len(vector)), FUNCTIONS, ("a", "b"), NAMES, (3.0, 3.0)
    )
    part = whole.only(CHANNELS)
    np.testing.assert_allclose(part.curves(part.delta), some[..., 10:])
    np.testing.assert_allclose(part.spread, whole.spread[..., 10:])
    assert part.channels == CHANNELS


def test_markers_and_electrodes_change_by_shares_of_their_own():
    """Posture and frames count by the share of markers, also where EMG follows a posture."""
    rng = generator(40)
    size = (1, NODES, len(NAMES))
    motion = np.array([name not in CHANNELS for name in NAMES])
    frame, gain = (rng.normal(size=size) * of for of in (motion, ~motion))
    task = SimpleNamespace(
        session=np.concatenate([frame, gain]),
        posture=rng.normal(size=size),
        unmeasured=np.zeros((0, NODES, len(NAMES))),
        tempo_errors=np.zeros((0, NODES, len(NAMES))),
    )
    nothing = np.zeros((len(NAMES) * FUNCTIONS.shape[1],) * 2)

    def covariance(*shares):
        return total_covariance(nothing, [task], FUNCTIONS, NAMES, None, SessionShares(*shares))

    def outer(curve):
        column = compress([curve], FUNCTIONS)
        return column @ column.T

    np.testing.assert_allclose(
        covariance(0.5, 0.0), 0.25 * (outer(frame) + outer(task.posture)), atol=1e-9
    )
    np.testing.assert_allclose(covariance(0.0, 0.5), 0.25 * outer(gain), atol=1e-9)
