"""The muscle curves at the points that define them, and their derivatives."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scapulohumeral.dynamics import hill
from scapulohumeral.errors import ModelError

pytestmark = pytest.mark.unit

C = hill.HillConstants()
LENGTHS = st.floats(0.3, 1.7)
VELOCITIES = st.floats(-1.0, 1.0)


@pytest.fixture
def muscles():
    return hill.MuscleParameters(
        names=("strong", "weak"),
        max_isometric_force=np.array([800.0, 150.0]),
        optimal_fibre_length=np.array([0.1, 0.05]),
        tendon_slack_length=np.array([0.2, 0.0]),
        activation_time=np.array([0.01, 0.02]),
        deactivation_time=np.array([0.04, 0.05]),
        capacity=np.array([1.0, 0.5]),
        constants=C,
    )


@pytest.mark.parametrize(
    ("curve", "at", "value", "tolerance"),
    [
        (hill.force_length, 1.0, 1.0, 1e-15),
        (hill.force_length, 0.5, np.exp(-1.0), 1e-15),  # half a width, squared, over 0.25
        (hill.force_length, 1.5, np.exp(-1.0), 1e-15),
        (hill.passive_force_length, 1.0, 0.0, 1e-15),
        (hill.passive_force_length, 1.6, 1.0, 1e-14),  # one at the passive strain
        (hill.force_velocity, 0.0, 1.0, 0.005),  # isometric
        (hill.force_velocity, -1.0, 0.0, 0.02),  # fastest shortening
        (hill.force_velocity, 1.0, 1.8, 0.02),  # eccentric
    ],
)
def test_published_values(curve, at, value, tolerance):
    assert curve(np.array(at), C)[0] == pytest.approx(value, abs=tolerance)


@pytest.mark.parametrize(
    "curve", [hill.force_length, hill.passive_force_length, hill.force_velocity]
)
def test_derivatives_match_differences(curve):
    x, h = np.linspace(-0.6, 1.8, 25), 1e-5
    _, first, second = curve(x, C)
    up, down = curve(x + h, C), curve(x - h, C)
    np.testing.assert_allclose(first, (up[0] - down[0]) / (2 * h), rtol=1e-7, atol=1e-8)
    np.testing.assert_allclose(second, (up[1] - down[1]) / (2 * h), rtol=1e-7, atol=1e-7)


@given(LENGTHS, LENGTHS)
def test_length_factor_is_largest_at_the_optimum_and_symmetric(x, other):
    factor = hill.force_length(np.array([x, 2.0 - x, other]), C)[0]
    assert 0.0 < factor[0] <= 1.0
    assert factor[0] == pytest.approx(factor[1])
    assert (factor[0] >= factor[2]) == (abs(x - 1) <= abs(other - 1)) or factor[0] == factor[2]


@given(VELOCITIES, st.floats(1e-6, 1.0))
def test_faster_lengthening_gives_more_force(v, step):
    slow, fast = hill.force_velocity(np.array([v, v + step]), C)[0]
    assert 0.0 < slow < fast


@given(LENGTHS, VELOCITIES)
def test_active_force_is_the_product_of_its_curves_and_linear_in_capacity(x, v):
    full = hill.MuscleParameters(
        ("m",), *(np.array([value]) for value in (500.0, 0.1, 0.2, 0.01, 0.04, 1.0)), C
    )
    half = dataclasses.replace(full, capacity=np.array([0.5]))
    length, velocity = np.array([[0.2 + 0.1 * x]]), np.array([[v]])
    a, b = (hill.force_derivatives(length, velocity, muscle) for muscle in (full, half))
    assert b.active == pytest.approx(0.5 * a.active)
    assert b.passive == pytest.approx(a.passive)
    expected = 500.0 * hill.force_length(x, C)[0] * hill.force_velocity(v, C)[0]
    assert a.active.item() == pytest.approx(expected)


def test_muscle_at_optimum_without_motion_gives_its_strength(muscles):
    length = muscles.tendon_slack_length + muscles.optimal_fibre_length
    force = hill.force_derivatives(length[None], np.zeros((1, 2)), muscles)
    np.testing.assert_allclose(force.active, [[800.0, 75.0]], rtol=0.005)
    np.testing.assert_allclose(force.passive, 0.0, atol=1e-12)


def test_force_derivatives_match_differences(muscles):
    rng = np.random.default_rng(1)
    length = np.array([0.3, 0.05]) * rng.uniform(0.9, 1.1, (10, 2))
    velocity, h = rng.uniform(-0.3, 0.3, (10, 2)), 1e-7
    at = hill.force_derivatives(length, velocity, muscles)
    longer, shorter = (hill.force_derivatives(length + s * h, velocity, muscles) for s in (1, -1))
    faster, slower = (hill.force_derivatives(length, velocity + s * h, muscles) for s in (1, -1))
    for name, base, up, down in (
        ("active_l", "active", longer, shorter),
        ("active_v", "active", faster, slower),
        ("active_ll", "active_l", longer, shorter),
        ("active_lv", "active_l", faster, slower),
        ("active_vv", "active_v", faster, slower),
        ("passive_l", "passive", longer, shorter),
        ("passive_ll", "passive_l", longer, shorter),
    ):
        numeric = (getattr(up, base) - getattr(down, base)) / (2 * h)
        exact = getattr(at, name)
        scale = np.abs(exact).max()
        np.testing.assert_allclose(exact / scale, numeric / scale, atol=1e-6, err_msg=name)


def test_activation_follows_excitation_with_its_time_constants(muscles):
    rise = hill.activation_rate(np.ones((1, 2)), np.zeros((1, 2)), muscles)
    np.testing.assert_allclose(rise, [[1 / 0.01, 1 / 0.02]])
    fall = hill.activation_rate(np.zeros((1, 2)), np.ones((1, 2)), muscles)
    np.testing.assert_allclose(fall, [[-1 / 0.04, -1 / 0.05]])
    still = hill.activation_rate(np.full((1, 2), 0.3), np.full((1, 2), 0.3), muscles)
    np.testing.assert_array_equal(still, 0.0)


def test_excitation_of_a_changing_activation_changes_it_so(muscles):
    activation = np.array([[0.2, 0.6], [0.9, 0.01]])
    rate = np.array([[5.0, -4.0], [0.0, 0.3]])
    excitation = activation + hill.excitation_change(rate, activation, muscles)
    np.testing.assert_allclose(hill.activation_rate(excitation, activation, muscles), rate)
    assert excitation[1, 0] == activation[1, 0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"optimal_fibre_length": np.array([0.1, 0.0])}, "optimal_fibre_length of weak"),
        ({"max_isometric_force": np.array([800.0])}, "2 muscles"),
        ({"capacity": np.array([1.0, -0.1])}, "capacity"),
    ],
)
def test_unphysical_muscles_are_refused(muscles, change, message):
    with pytest.raises(ModelError, match=message):
        dataclasses.replace(muscles, **change)
