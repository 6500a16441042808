"""Muscles with elastic tendons, stepped implicitly along their own fibre state.

Unlike the study's rigid-tendon muscle: a fibre state, Hill's hyperbola, a compliant tendon, and
moment arms that may differ from the tables.

Letters: N simulations, M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

ACTIVE_WIDTH = 0.25
PASSIVE_SHAPE, PASSIVE_STRAIN = 5.0, 0.6  # Chadwick et al. 2014
TENDON_SHAPE = 3.0  # Thelen 2003, toe region
MAX_SPEED = 10.0  # optimal fibre lengths per second
HILL_CURVATURE, ECCENTRIC_LIMIT = 0.25, 1.4  # Zajac 1989; Thelen 2003
FIBRE_DAMPING = 0.02  # share of maximal force at maximal speed: keeps inactive fibres steady
NEWTON_STEPS = 4
SHORTEST_FIBRE = 0.2


@dataclass(frozen=True, eq=False)
class Muscles:
    """Muscle parameters of N simulations, each of shape (N, M).

    Attributes
    ----------
    max_force : N; optimal_length, slack_length : m
    tendon_strain : strain of the tendon at maximal force [1]
    rise_s, fall_s : activation constants
    arm_scale : factor on moment arms; lengths are scaled about those at the start
    end_force : share of the active force left at the end of a trial
    """

    max_force: np.ndarray
    optimal_length: np.ndarray
    slack_length: np.ndarray
    tendon_strain: np.ndarray
    rise_s: np.ndarray
    fall_s: np.ndarray
    arm_scale: np.ndarray
    end_force: np.ndarray


def activation_step(
    muscles: Muscles, activation: np.ndarray, excitation: np.ndarray, step: float
) -> np.ndarray:
    """Activation (N, M) after a step [s] of constant excitation (N, M)."""
    rate = activation_rate(muscles, excitation)
    return excitation + (activation - excitation) * np.exp(-rate * step)


def activation_rate(muscles: Muscles, excitation: np.ndarray) -> np.ndarray:
    """Rate constant [1/s] between the ones of falling and rising activation, (N, M)."""
    fall = 1.0 / muscles.fall_s
    return fall + (1.0 / muscles.rise_s - fall) * excitation


def resting_fibres(muscles: Muscles, length: np.ndarray) -> np.ndarray:
    """Fibre lengths (N, M) [m] with slack tendons at muscle-tendon lengths (N, M) [m]."""
    shortest = SHORTEST_FIBRE * muscles.optimal_length
    return np.maximum(length - muscles.slack_length, shortest)


def active_force(muscles: Muscles, fibre: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """Force per unit activation (N, M) [N] at fibre length [m] and speed [m/s]."""
    x = fibre / muscles.optimal_length
    v = speed / (MAX_SPEED * muscles.optimal_length)
    return muscles.max_force * np.exp(-((x - 1.0) ** 2) / ACTIVE_WIDTH) * _force_velocity(v)[0]


def passive_force(muscles: Muscles, fibre: np.ndarray) -> np.ndarray:
    """Force of inactive fibres (N, M) [N]."""
    return muscles.max_force * _passive(fibre / muscles.optimal_length)[0]


def fibre_step(
    muscles: Muscles,
    length: np.ndarray,
    fibre: np.ndarray,
    activation: np.ndarray,
    step: float,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Implicit Euler step of the fibres, in equilibrium with their tendons at its end.

    Parameters
    ----------
    length : muscle-tendon length at the end of the step [m]; fibre : at its start [m]

    Returns
    -------
    fibre [m], force [N] and its slope by muscle-tendon length [N/m] at the end, each (N, M)
    """
    start = fibre
    optimal, compliance = muscles.optimal_length, muscles.tendon_strain * muscles.slack_length
    reach = 0.1 * optimal
    for _ in range(NEWTON_STEPS):
        tendon, tendon_slope = _tendon(length - fibre - muscles.slack_length, compliance)
        pull, pull_slope = _fibre(fibre, start, activation, optimal, step)
        fibre = fibre + np.clip((tendon - pull) / (tendon_slope + pull_slope), -reach, reach)
        fibre = np.maximum(fibre, SHORTEST_FIBRE * optimal)
    tendon, tendon_slope = _tendon(length - fibre - muscles.slack_length, compliance)
    pull, pull_slope = _fibre(fibre, start, activation, optimal, step)
    slope = tendon_slope * pull_slope / (tendon_slope + pull_slope)
    return fibre, muscles.max_force * np.maximum(pull, 0.0), muscles.max_force * slope


def _fibre(fibre, start, activation, optimal, step) -> tuple[np.ndarray, np.ndarray]:
    """Fibre force over its maximum, and its (positive) slope by the new fibre length."""
    x = fibre / optimal
    v = (fibre - start) / (step * MAX_SPEED * optimal)
    active = activation * np.exp(-((x - 1.0) ** 2) / ACTIVE_WIDTH)
    factor, by_speed = _force_velocity(v)
    passive, by_length = _passive(x)
    # The falling limb of the force-length curve is left out: the slope stays positive.
    slope = (active * by_speed + FIBRE_DAMPING) / (step * MAX_SPEED) + by_length
    return active * factor + passive + FIBRE_DAMPING * v, slope / optimal


def _tendon(stretch, compliance) -> tuple[np.ndarray, np.ndarray]:
    """Tendon force over maximal muscle force, and its slope by stretch [1/m]."""
    scale = 1.0 / np.expm1(TENDON_SHAPE)
    e = np.exp(np.clip(TENDON_SHAPE * stretch / compliance, -20.0, 8.0))
    return scale * (e - 1.0), scale * TENDON_SHAPE / compliance * np.maximum(e, 1e-2)


def _passive(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rate = PASSIVE_SHAPE / PASSIVE_STRAIN
    e = np.exp(np.minimum(rate * (x - 1.0), 8.0)) / np.expm1(PASSIVE_SHAPE)
    return np.maximum(e - 1.0 / np.expm1(PASSIVE_SHAPE), 0.0), rate * e


def _force_velocity(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Hill's hyperbola for shortening (v < 0), a mirrored one for lengthening, and the slope."""
    k = HILL_CURVATURE
    short = np.clip(v, -1.0, 0.0)
    down = (1.0 + short) / (1.0 - short / k)
    down_slope = (1.0 - short / k + (1.0 + short) / k) / (1.0 - short / k) ** 2
    gain = ECCENTRIC_LIMIT - 1.0
    stretch = (1.0 + 1.0 / k) * np.maximum(v, 0.0) / gain
    up = 1.0 + gain * stretch / (1.0 + stretch)
    up_slope = (1.0 + 1.0 / k) / (1.0 + stretch) ** 2
    return np.where(v < 0, down, up), np.where(v < 0, down_slope, up_slope)
