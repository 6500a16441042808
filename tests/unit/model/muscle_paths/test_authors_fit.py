"""Paths drawn and fitted as by the authors: their poses, their choice of terms."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from skeleton import muscle, uneven_record

from scapulohumeral.model.muscle_paths import authors_fit
from scapulohumeral.model.muscle_paths.fit import FitSamples
from scapulohumeral.model.rotations import pose_to_trial, segment_orientations, trial_to_pose

pytestmark = pytest.mark.unit

STRAIGHT = muscle("straight", ("thorax", [0.03, -0.1, 0.05]), ("scapula_r", [-0.02, 0.04, 0.01]))
WRAPPED = muscle(
    "serr_ant_1",
    ("thorax", [0.03, -0.1, 0.05]),
    ("scapula_r", [-0.02, 0.04, 0.01]),
    wraps=("ball",),
)
RECORD = replace(uneven_record(), muscles=(STRAIGHT, WRAPPED))
POSES = 400


def samples(length, slopes, noise=0.0):
    """Samples of the second muscle, which depends on the variables of the girdle alone."""
    rng = np.random.default_rng(1)
    variables = rng.uniform(-0.3, 0.3, (POSES, 10)) - 1e-6
    q = variables + 1e-6
    lengths, gradient = np.full((POSES, 2), 0.2), np.zeros((POSES, 2, 10))
    lengths[:, 1], gradient[:, 1] = length(q), slopes(q)
    lengths += noise * rng.normal(size=lengths.shape)
    return FitSamples(
        variables=variables,
        length=lengths,
        length_gradient=gradient,
        rate_map=np.tile(np.eye(10), (POSES, 1, 1)),
        translation=np.zeros((POSES, 2, 3)),
        smooth=np.ones((POSES, 2), dtype=bool),
    )


def path(cubic):
    """A length that all variables of the girdle change, and its slopes."""

    def slopes(q):
        found = np.zeros_like(q)
        found[:, :6] = 0.03
        found[:, 4] += 3 * cubic * q[:, 4] ** 2
        return found

    return lambda q: 0.2 + 0.03 * q[:, :6].sum(axis=1) + cubic * q[:, 4] ** 3, slopes


def terms(fit):
    exponents, row = fit.geometry.exponents, fit.geometry.length[1]
    return {
        tuple(exponent.tolist()): value
        for exponent, value in zip(exponents, row[: len(exponents)], strict=True)
        if value
    }


def test_a_cubic_is_found_and_straight_muscles_of_the_thorax_stay_exact():
    fit = authors_fit.fit_paths(RECORD, samples(*path(cubic=0.05)))
    assert fit.geometry.squared.tolist() == [True, False]
    expected = {tuple(row): 0.03 for row in np.eye(10, dtype=int)[:6].tolist()}
    expected |= {(0,) * 10: 0.2, (0, 0, 0, 0, 3, 0, 0, 0, 0, 0): 0.05}
    assert terms(fit) == pytest.approx(expected, abs=1e-9)


def test_terms_that_hardly_help_are_left_out():
    assert len(terms(authors_fit.fit_paths(RECORD, samples(*path(cubic=0.05))))) == 8
    little = authors_fit.fit_paths(RECORD, samples(*path(cubic=0.05), noise=0.05))
    assert len(terms(little)) == 7


def test_clavicle_turns_under_the_same_scapula():
    poses = trial_to_pose(np.random.default_rng(2).uniform(-0.4, 0.4, (5, 10)))
    turned = authors_fit._with_clavicle(poses, 25.0)
    np.testing.assert_allclose(np.rad2deg(pose_to_trial(turned)[:, 2]), 25.0)
    np.testing.assert_allclose(
        np.abs(
            np.sum(
                segment_orientations(turned)["scapula"] * segment_orientations(poses)["scapula"],
                axis=1,
            )
        ),
        1.0,
    )
    np.testing.assert_array_equal(turned[:, 8:], poses[:, 8:])


def test_draws_are_as_many_as_asked_for_within_the_authors_limits(monkeypatch):
    monkeypatch.setattr(authors_fit, "_is_near_thorax", lambda record, poses: poses[:, 12] > 0.3)
    motion = trial_to_pose(np.tile([-0.4, 0.1, 0.2, 0.5, 0.1, 0.0, 0.7, -0.5, -0.5, 0.5], (80, 1)))
    record = replace(RECORD, muscles=(STRAIGHT,))
    first, again = (
        authors_fit.draw_poses(record, motion, 5000, np.random.default_rng(3)) for _ in range(2)
    )
    np.testing.assert_array_equal(first, again)
    assert first.shape == (5000, 13)
    assert first[:, [0, 4]].min() >= 0.8
    assert first[:, 12].min() > 0.3
    np.testing.assert_allclose(np.linalg.norm(first[:, :4], axis=1), 1.0)


def placed(angles, body_point):
    """Where a point of the scapula is in the thorax (P, 3), by turning one joint after another."""
    sc1, ac1 = (np.array(RECORD.joints[name].location_m) for name in ("sc1", "ac1"))
    clavicle = Rotation.from_euler("YZX", angles[:, :3])
    scapula = clavicle * Rotation.from_euler("YZX", angles[:, 3:6])
    return sc1 + clavicle.apply(ac1) + scapula.apply(body_point)


def level(points, centre, radii):
    return (((points - np.array(centre)) / np.array(radii)) ** 2).sum(axis=1) - 1.0


def test_scapulae_far_from_the_thorax_and_raised_arms_are_left_out():
    angles = np.random.default_rng(5).uniform(-0.9, 0.9, (400, 10))
    angles[:, 7] = np.random.default_rng(6).uniform(0.1, 3.0, 400)
    thorax = authors_fit.THORAX_CENTRE_M, authors_fit.THORAX_RADII_M
    points = authors_fit.CONTACT_POINTS_M.values()
    distance = np.hypot(*(level(placed(angles, point), *thorax) for point in points))
    near = np.abs(distance - 0.45) < 1.2
    low = np.rad2deg(angles[:, 7]) <= 140.0
    # Each limit leaves some out on its own.
    assert np.count_nonzero(near & ~low) > 0
    assert 0 < np.count_nonzero(low & ~near) < np.count_nonzero(low)
    found = authors_fit._is_near_thorax(RECORD, trial_to_pose(angles))
    np.testing.assert_array_equal(found, near & low)


def test_serratus_may_not_begin_inside_of_what_it_wraps_over():
    angles = np.random.default_rng(7).uniform(-0.9, 0.9, (400, 10))
    [ball] = [surface for surface in RECORD.wrap_objects if surface.name == "ball"]
    end = [-0.02, 0.04, 0.01]
    reach = np.linalg.norm(placed(np.zeros((1, 10)), end) - np.array(ball.translation_m))
    surface = replace(ball, dimensions_m=(2.0 * reach, 0.5 * reach, reach))
    record = replace(RECORD, wrap_objects=(surface,))
    expected = level(placed(angles, end), surface.translation_m, surface.dimensions_m) >= 0.0
    assert 0 < np.count_nonzero(expected) < len(expected)
    found = authors_fit._is_outside(record, trial_to_pose(angles))
    np.testing.assert_array_equal(found, expected)
    straight = replace(record, muscles=(STRAIGHT,))
    assert authors_fit._is_outside(straight, trial_to_pose(angles)).all()
