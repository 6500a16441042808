"""Effects with made-up signatures, and differences that they explain."""

import numpy as np
from gap_movement import NODES, SETUP

from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.residual import Residual

FUNCTIONS = phase_functions(NODES, 4)


TASKS = ("a", "b")


SIZE = 2 * 10 * 4


EFFECTS = {e.label: e for e in library(SETUP)}


LOAD, DAMPING = EFFECTS["body/hand_load"], EFFECTS["body/joint_damping/GH"]


MASS, GAIN = EFFECTS["body/segment_mass/forearm"], EFFECTS["body/strength_loss/biceps"]


def residual(delta, noise=1.0):
    covariance = noise**2 * np.eye(SIZE)
    return Residual(delta, covariance, covariance, FUNCTIONS, TASKS, KINEMATIC_CHANNELS, (8.0,) * 2)


def hypothesis(effect, seed, size=4.0):
    """An effect with a random signature."""
    slope = size * np.random.default_rng(seed).normal(size=(SIZE, len(effect.params)))
    return Hypothesis((effect,), np.zeros(slope.shape[1]), np.zeros((SIZE, 1)), slope, 1.0)


def noise(seed):
    return np.random.default_rng(seed).normal(size=SIZE)
