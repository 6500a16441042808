"""Straight paths are exact, and the polynomial fit finds what is in the samples."""

from dataclasses import replace

import numpy as np
import pytest
from skeleton import joint, muscle, uneven_record

from scapulohumeral.errors import ConfigError, ModelError
from scapulohumeral.model.muscle_paths import fit as muscle_fit
from scapulohumeral.model.muscle_paths import geometry as muscle_geometry
from scapulohumeral.model.muscle_paths.fit import FitSamples, FitSettings
from scapulohumeral.model.muscle_paths.thorax_clearance import segment_frames
from scapulohumeral.model.rotations import quaternion_to_matrix, rotation_vector_to_quaternion

pytestmark = pytest.mark.unit

RECORD = uneven_record()
STRAIGHT_PAIRS = [
    ("thorax", "clavicle_r"),
    ("thorax", "scapula_r"),
    ("clavicle_r", "scapula_r"),
    ("humerus_r", "scapula_r"),  # order of the points does not matter
]


def random_poses(count, seed=1):
    rng = np.random.default_rng(seed)
    joints = [rotation_vector_to_quaternion(rng.normal(size=(count, 3))) for _ in range(3)]
    return np.hstack([*joints, rng.uniform(0, 2, (count, 1))])


def example_muscle(first, second, wraps=()):
    ends = (first, [0.03, -0.1, 0.05]), (second, [-0.02, 0.04, 0.01])
    return muscle("example", *ends, wraps=wraps)


def path_length(record, poses, example):
    frames = segment_frames(record, poses)
    ends = [
        frames[point.body][0] + frames[point.body][1] @ np.array(point.location_m)
        for point in example.points
    ]
    return np.linalg.norm(ends[0] - ends[1], axis=1)


def rotation_features(poses):
    """One, then the entries of the SC, AC, thorax-to-scapula and GH rotation matrices."""
    sc, ac, gh = (quaternion_to_matrix(poses[:, k : k + 4]) for k in (0, 4, 8))
    entries = [matrix.reshape(-1, 9) for matrix in (sc, ac, sc @ ac, gh)]
    return np.hstack([np.ones((len(poses), 1)), *entries])


@pytest.mark.parametrize("bodies", STRAIGHT_PAIRS)
def test_straight_length_is_the_distance_of_the_attachments(bodies):
    poses, example = random_poses(30), example_muscle(*bodies)
    squared, _ = muscle_geometry.straight_coefficients(RECORD, example)
    expected = path_length(RECORD, poses, example) ** 2
    np.testing.assert_allclose(rotation_features(poses) @ squared, expected, rtol=1e-12)


@pytest.mark.parametrize("bodies", STRAIGHT_PAIRS)
def test_straight_pull_on_the_humeral_head_is_the_change_of_length(bodies):
    poses, example, h = random_poses(30), example_muscle(*bodies), 1e-6
    _, arms = muscle_geometry.straight_coefficients(RECORD, example)
    actual = rotation_features(poses) @ arms.T / path_length(RECORD, poses, example)[:, None]
    for axis in range(3):
        lengths = []
        for sign in (1.0, -1.0):
            location = np.array(RECORD.joints["gh1"].location_m)
            location[axis] += sign * h
            joints = {**RECORD.joints, "gh1": joint(location)}
            lengths.append(path_length(replace(RECORD, joints=joints), poses, example))
        expected = (lengths[0] - lengths[1]) / (2 * h)
        np.testing.assert_allclose(actual[:, axis], expected, atol=1e-9)


@pytest.mark.parametrize(
    "bodies", [("thorax", "humerus_r"), ("scapula_r", "ulna_r"), ("thorax", "thorax")]
)
def test_straight_path_without_exact_form_is_refused(bodies):
    with pytest.raises(ModelError, match=f"example.*{bodies[0]} to {bodies[1]}"):
        muscle_geometry.straight_coefficients(RECORD, example_muscle(*bodies))


def test_crossed_joints_lie_between_the_bodies():
    assert muscle_geometry.crossed_joints(example_muscle("thorax", "scapula_r")) == ("SC", "AC")
    assert muscle_geometry.crossed_joints(example_muscle("ulna_r", "scapula_r")) == ("GH", "EL")


def test_candidates_are_distinct_with_the_constant_first():
    exponents = muscle_fit.candidate_exponents((6, 7, 8))
    assert not exponents[0].any()
    assert len(np.unique(exponents, axis=0)) == len(exponents) == 84  # 9 over 3
    assert exponents.sum(axis=1).max() == 6
    assert not exponents[:, :6].any()


def make_samples(length, gradient, variables, directions=None):
    """Samples of one muscle whose speeds are the rates of its variables."""
    count = len(variables)
    return FitSamples(
        variables=variables,
        length=length[:, None],
        length_gradient=gradient[:, None],
        rate_map=np.tile(np.eye(10), (count, 1, 1)),
        translation=np.zeros((count, 1, 3)) if directions is None else directions[:, None],
        smooth=np.ones((count, 1), bool),
    )


def quartic(variables):
    """A length [m] with four terms in the GH variables, and its gradient."""
    x, y, z = variables[:, 6:9].T
    length = 0.2 + 0.03 * x - 0.05 * y**2 + 0.04 * x * y * z**2
    gradient = np.zeros((len(variables), 10))
    gradient[:, 6] = 0.03 + 0.04 * y * z**2
    gradient[:, 7] = -0.1 * y + 0.04 * x * z**2
    gradient[:, 8] = 0.08 * x * y * z
    return length, gradient


WRAPPED = replace(RECORD, muscles=(example_muscle("scapula_r", "humerus_r", ("head",)),))
VARIABLES = np.random.default_rng(2).uniform(-0.6, 0.8, (400, 10))


def test_slopes_are_derivatives_of_the_monomials():
    exponents = muscle_fit.candidate_exponents((6, 7, 8, 9))
    rng, h = np.random.default_rng(3), 1e-6
    samples = make_samples(*quartic(VARIABLES), VARIABLES)
    rate_map = np.zeros((400, 10, 10))
    rate_map[:, 6:, 6:] = rng.normal(size=(400, 4, 4))
    samples = FitSamples(**{**vars(samples), "rate_map": rate_map})
    slopes = muscle_fit.monomial_slopes(exponents, samples)
    assert slopes.shape == (4, 400, len(exponents))
    for k, slope in enumerate(slopes):
        up, down = (VARIABLES + sign * h * rate_map[:, :, 6 + k] for sign in (1, -1))
        values = [muscle_fit.monomial_values(exponents, v) for v in (up, down)]
        np.testing.assert_allclose(slope, (values[0] - values[1]) / (2 * h), atol=1e-7)


def test_fit_recovers_a_sparse_polynomial():
    directions = np.stack([VARIABLES[:, 6], 0.5 - VARIABLES[:, 7], 0 * VARIABLES[:, 7]], axis=1)
    samples = make_samples(*quartic(VARIABLES), VARIABLES, directions)
    settings = FitSettings(length_target_m=1e-12, arm_target_m=1e-12)
    geometry = muscle_fit.fit_geometry(WRAPPED, samples, settings).geometry
    values = muscle_fit.monomial_values(geometry.exponents, VARIABLES)
    size = values.shape[1]
    np.testing.assert_allclose(values @ geometry.length[0, :size], samples.length[:, 0], atol=1e-13)
    terms = {tuple(geometry.exponents[k, 6:9]): geometry.length[0, k] for k in range(size)}
    found = {term for term, value in terms.items() if abs(value) > 1e-10}
    assert found == {(0, 0, 0), (1, 0, 0), (0, 2, 0), (1, 1, 2)}
    assert size <= 20  # of 84 candidates: the search is greedy
    assert not geometry.length[0, size:].any()


def test_short_paths_from_thorax_to_scapula_are_fitted_by_their_square():
    """A point that moves linearly past another: its squared distance is a quadratic polynomial."""
    offset = np.array([0.03, 0.0, 0.0]) + 0.1 * VARIABLES[:, :3] @ np.diag([1.0, 2.0, 0.5])
    length = np.linalg.norm(offset, axis=1)
    gradient = np.zeros((len(length), 10))
    gradient[:, :3] = 0.1 * offset * [1.0, 2.0, 0.5] / length[:, None]
    samples = make_samples(length, gradient, VARIABLES)
    record = replace(RECORD, muscles=(example_muscle("thorax", "scapula_r", ("ribs",)),))
    geometry = muscle_fit.fit_geometry(record, samples, FitSettings(1e-9, 1e-9)).geometry
    assert geometry.squared.tolist() == [True]
    values = muscle_fit.monomial_values(geometry.exponents, VARIABLES)
    fitted = np.sqrt(values @ geometry.length[0, : values.shape[1]])
    np.testing.assert_allclose(fitted, length, atol=1e-8)
    assert not muscle_fit.fit_geometry(WRAPPED, samples, FitSettings()).geometry.squared.any()


def test_selection_ends_when_the_target_is_met():
    rng = np.random.default_rng(4)
    length, gradient = quartic(VARIABLES)
    noise = 1e-4 * rng.normal(size=400)
    samples = make_samples(length + noise, gradient, VARIABLES)
    fit = muscle_fit.fit_geometry(WRAPPED, samples, FitSettings())
    assert np.count_nonzero(fit.geometry.length) <= 5
    assert 1.0 < fit.condition[0] < 100.0


def test_muscles_of_a_group_share_terms_and_take_only_what_they_need():
    length, gradient = quartic(VARIABLES)
    simple = 0.1 + 0.03 * VARIABLES[:, 6]
    slope = np.zeros_like(gradient)
    slope[:, 6] = 0.03
    first = make_samples(length, gradient, VARIABLES)
    second = make_samples(simple, slope, VARIABLES)
    both = {
        name: np.concatenate([getattr(first, name), getattr(second, name)], axis=1)
        for name in ("length", "length_gradient", "translation", "smooth")
    }
    samples = FitSamples(variables=VARIABLES, rate_map=first.rate_map, **both)
    record = replace(WRAPPED, muscles=WRAPPED.muscles * 2)
    geometry = muscle_fit.fit_geometry(record, samples, FitSettings(1e-9, 1e-9)).geometry
    counts = np.count_nonzero(np.abs(geometry.length) > 1e-8, axis=1)
    assert counts.tolist() == [4, 2]


def test_selection_ends_when_terms_hardly_help():
    rng = np.random.default_rng(5)
    design = np.hstack([np.ones((300, 1)), rng.normal(size=(300, 60))])
    target = (design[:, 3] + rng.normal(size=300))[:, None]
    arguments = (design.T @ design, design.T @ target, np.sum(target**2, axis=0))
    selection = muscle_fit.select_terms(*arguments, FitSettings(rmse_change=0.1))
    assert selection.order[0] == 0
    assert 3 in selection.order
    assert len(selection.order) <= 20


def test_collinear_candidates_are_left_out():
    rng = np.random.default_rng(6)
    design = np.hstack([np.ones((100, 1)), rng.normal(size=(100, 3))])
    design = np.hstack([design, design[:, 1:] + 1e-9])
    target = rng.normal(size=(100, 1))
    arguments = (design.T @ design, design.T @ target, np.sum(target**2, axis=0))
    selection = muscle_fit.select_terms(*arguments, FitSettings(rmse_change=1e-6))
    assert len(selection.order) == 4
    assert selection.condition < 2.0


def test_jumps_are_left_out():
    """Two percent of the lengths lie 2 cm beside their branch, as where OpenSim's paths jump."""
    length, gradient = quartic(VARIABLES)
    jumping = np.random.default_rng(7).choice(400, 8, replace=False)
    length[jumping] += 0.02
    samples = make_samples(length, gradient, VARIABLES)
    fit = muscle_fit.fit_geometry(WRAPPED, samples, FitSettings(1e-6, 1e-6))
    assert fit.left_out.tolist() == [8]
    values = muscle_fit.monomial_values(fit.geometry.exponents, VARIABLES)
    predicted = values @ fit.geometry.length[0, : values.shape[1]]
    np.testing.assert_allclose(predicted, quartic(VARIABLES)[0], atol=1e-6)


def test_samples_that_mostly_jump_are_refused():
    samples = make_samples(*quartic(VARIABLES), VARIABLES)
    samples.smooth[:300] = False
    with pytest.raises(ModelError, match="300 of 400"):
        muscle_fit.fit_geometry(WRAPPED, samples, FitSettings())


def test_directions_take_fewer_terms_than_there_are_poses():
    rng = np.random.default_rng(3)
    values, target = rng.normal(size=(40, 60)), rng.normal(size=(40, 2))
    coefficients = muscle_fit.fit_directions(values, target, FitSettings())
    assert coefficients.shape == (60, 2)
    np.testing.assert_array_equal(coefficients[30:], 0.0)
    least, *_ = np.linalg.lstsq(values[:, :30], target, rcond=None)
    np.testing.assert_allclose(coefficients[:30], least, atol=1e-9)


def test_directions_take_the_first_terms_they_need():
    rng = np.random.default_rng(8)
    values = rng.normal(size=(200, 6))
    target = np.stack([values[:, 0], values[:, :3].sum(axis=1)], axis=1)
    coefficients = muscle_fit.fit_directions(values, target, FitSettings())
    np.testing.assert_allclose(coefficients[:3], [[1, 1], [0, 1], [0, 1]], atol=1e-12)
    assert not coefficients[3:].any()


def test_target_of_zero_is_refused():
    with pytest.raises(ConfigError, match="arm_target_m is 0"):
        FitSettings(arm_target_m=0.0)


def test_geometry_survives_the_file(tmp_path):
    samples = make_samples(*quartic(VARIABLES), VARIABLES)
    geometry = muscle_fit.fit_geometry(WRAPPED, samples, FitSettings()).geometry
    muscle_geometry.save_geometry(geometry, tmp_path / "geometry.npz")
    again = muscle_geometry.load_geometry(tmp_path / "geometry.npz")
    assert again.names == geometry.names
    for name in ("exponents", "length", "translation", "squared"):
        np.testing.assert_array_equal(getattr(again, name), getattr(geometry, name))
