"""Muscles with tendons that stretch: the same force by an equilibrium solved here, and limits."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import brentq

from scapulohumeral.dynamics import hill
from scapulohumeral.dynamics.compliant_tendon import (
    Pull,
    compliant_activation,
    compliant_excitation,
    tendon_strain,
)
from scapulohumeral.errors import ModelError

pytestmark = pytest.mark.unit

STRAIN, STEP, NODES = 0.05, 0.01, 81
TIME = STEP * np.arange(NODES)
MUSCLES = hill.MuscleParameters(
    names=("long_tendon", "no_tendon"),
    max_isometric_force=np.array([800.0, 150.0]),
    optimal_fibre_length=np.array([0.1, 0.05]),
    tendon_slack_length=np.array([0.2, 0.0]),
    activation_time=np.array([0.02, 0.02]),
    deactivation_time=np.array([0.04, 0.05]),
    capacity=np.ones(2),
    constants=hill.HillConstants(),
)


def pull(activation: np.ndarray, length: np.ndarray, velocity: np.ndarray) -> Pull:
    """Muscles excited as their activation, (N, M), demands."""
    rate = np.gradient(activation, STEP, axis=0)
    excitation = activation + hill.excitation_change(rate, activation, MUSCLES)
    return Pull(length, velocity, activation, excitation, STEP)


def held(activation: float) -> Pull:
    """A muscle held at nine tenths of its optimal length."""
    length = MUSCLES.tendon_slack_length + 0.9 * MUSCLES.optimal_fibre_length
    still = np.zeros((NODES, 2))
    return pull(np.full((NODES, 2), activation), length + still, still)


@pytest.fixture
def moving() -> Pull:
    """Muscles that shorten and are activated once and let go."""
    wave = np.sin(2 * np.pi * TIME / TIME[-1])[:, None]
    rate = 2 * np.pi / TIME[-1] * np.cos(2 * np.pi * TIME / TIME[-1])[:, None]
    length = MUSCLES.tendon_slack_length + MUSCLES.optimal_fibre_length * (1.0 + 0.1 * wave)
    activation = 0.3 + 0.2 * np.repeat(wave, 2, axis=1)
    return pull(activation, length, 0.1 * MUSCLES.optimal_fibre_length * rate)


def test_strain_at_maximal_force_is_that_asked_for_and_small_forces_meet_a_soft_toe():
    found = tendon_strain(np.array([-0.1, 0.0, 0.1, 1.0]), STRAIN)
    np.testing.assert_allclose(found[[0, 1, 3]], [0.0, 0.0, STRAIN])
    assert found[2] > 3 * 0.1 * STRAIN


def test_fibres_and_stretched_tendon_are_in_equilibrium():
    """Force of the long tendon at the activation found, by a root of tendon minus fibre force."""
    given = held(0.4)
    found = compliant_activation(given, MUSCLES, STRAIN)
    rigid = 800.0 * 0.4 * np.exp(-(0.1**2) / 0.25) * 1.0

    def excess(stretch: float) -> float:
        tendon = 800.0 * np.expm1(3.0 * stretch / (0.2 * STRAIN)) / np.expm1(3.0)
        x = 0.9 - stretch / 0.1
        fibre = found[40, 0] * np.exp(-((x - 1.0) ** 2) / 0.25)
        passive = np.expm1(5.0 / 0.6 * (x - 1.0)) / np.expm1(5.0)
        return tendon - 800.0 * (fibre + passive)

    stretch = brentq(excess, 0.0, 0.01)
    force = 800.0 * np.expm1(3.0 * stretch / (0.2 * STRAIN)) / np.expm1(3.0)
    assert force == pytest.approx(rigid, rel=0.01)
    assert found[40, 0] > 0.41, "fibres below their optimum are shorter still"
    np.testing.assert_allclose(found[:, 1], 0.4, rtol=1e-12)


def test_a_tendon_that_lengthens_asks_for_more_before_the_force_and_less_after(moving):
    change = compliant_activation(moving, MUSCLES, STRAIN) - moving.activation
    rising, falling = change[1:15, 0], change[30:50, 0]
    assert rising.mean() > falling.mean() + 0.005
    np.testing.assert_allclose(change[:, 1], 0.0, atol=1e-12)


def test_excitations_drive_the_activations_that_are_needed(moving):
    """Integrated forward from the first activation."""
    needed = compliant_activation(moving, MUSCLES, STRAIN)
    excitation = compliant_excitation(moving, MUSCLES, STRAIN)
    assert np.all((excitation > 0.0) & (excitation < 1.0))
    activation = needed[0].copy()
    fine = 20
    for k in range(NODES - 1):
        for part in range(fine):
            now = excitation[k] + (excitation[k + 1] - excitation[k]) * part / fine
            activation += STEP / fine * hill.activation_rate(now, activation, MUSCLES)
        assert activation == pytest.approx(needed[k + 1], abs=0.01)


def test_rigid_tendons_change_nothing(moving):
    excitation = compliant_excitation(moving, MUSCLES, 1e-12)
    np.testing.assert_allclose(excitation, moving.excitation, atol=1e-9)


def test_a_force_beyond_the_muscle_is_refused_by_name():
    given = held(0.99)
    with pytest.raises(ModelError, match=r"long_tendon, node \d+: an activation of 1\.\d+"):
        compliant_activation(given, MUSCLES, STRAIN)
    weak = replace(given, activation=0.5 * given.activation)
    assert compliant_activation(weak, MUSCLES, STRAIN).max() < 1.0


@pytest.mark.parametrize("kind", ["length", "velocity", "activation"])
def test_a_pull_that_is_no_number_is_refused_where_it_is_none(kind):
    broken = held(0.4)
    getattr(broken, kind)[7, 1] = np.nan
    with pytest.raises(ModelError, match=r"no_tendon, node 7: a force of nan N"):
        compliant_activation(broken, MUSCLES, STRAIN)


@pytest.mark.filterwarnings("ignore:divide by zero", "ignore:invalid value")
def test_fibres_that_cannot_be_activated_are_refused():
    """Without active force the activation is a quotient of zeros."""
    lost = replace(MUSCLES, capacity=np.array([1.0, 0.0]))
    with pytest.raises(ModelError, match="no_tendon, node 0: an activation of nan"):
        compliant_activation(held(0.4), lost, STRAIN)
