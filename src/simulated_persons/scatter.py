"""How repeats of real people scatter, as numbers to draw simulated repeats from.

Measured on two persons, timing and posture told apart by maximum likelihood, n - 1 in all means:

- five daily tasks with an arm support at two levels, 27 trials (repository Ipuch/bioptim_exo,
  commit b4a33b4e, MIT licence);
- abduction, flexion and shrug with and without 2 kg in the hand, 18 trials (CC BY 4.0).

Numbers are means of both persons. They agree within a third, but for AC, which one recording
derives from the clavicle: the mean of 0.8 and 1.9 stands for it.
"""

from __future__ import annotations

import numpy as np

# Standard deviations of one trial about the mean of its repeats [deg], per axis, timing taken off.
SC_DEG, AC_DEG, GH_DEG, EL_DEG = 1.7, 1.35, 3.8, 4.9
ANGLE_DEG = np.array([SC_DEG] * 3 + [AC_DEG] * 3 + [GH_DEG] * 3 + [EL_DEG])
# Cosines 0 to 5 of phase share the variance as 1 / (1 + b).
WAVES = 6
SHARES = 1.0 / (1.0 + np.arange(WAVES)) / np.sum(1.0 / (1.0 + np.arange(WAVES)))
# Where in its movement a trial is, against its repeats [share of the duration]: standard deviations
# of cosines 0 to 3 of phase, alike in all joints.
PHASE_SHIFT = np.array([0.055, 0.032, 0.032, 0.028])
LOG_DURATION = 0.13
# Tasks differ in how much their repeats scatter: standard deviation of the logarithm, 0.3 in one
# person and 0.65 in the other. So repeats of many tasks have heavy tails.
LOG_SCALE = 0.45


def draw_scale(rng: np.random.Generator) -> float:
    """How much one task of one person scatters, over the numbers of this table; mean square one."""
    return float(np.exp(rng.normal(-(LOG_SCALE**2), LOG_SCALE)))


def draw_waves(rng: np.random.Generator, deviation: np.ndarray) -> np.ndarray:
    """Amplitudes (K, WAVES) of smooth curves with standard deviations (K,)."""
    return deviation[:, None] * np.sqrt(SHARES) * rng.normal(size=(len(deviation), WAVES))


def curves(phase: np.ndarray, amplitudes: np.ndarray) -> np.ndarray:
    """Curves (S, K) over phase (S,) of amplitudes (K, B) of cosines of mean square one."""
    order = np.arange(amplitudes.shape[1])
    cosines = np.cos(np.pi * phase[:, None] * order) * np.sqrt(2.0 - (order == 0))
    return cosines @ amplitudes.T
