"""Repeats of a recorded movement: other speed, other size, other path, as people vary.

Letters: S control steps, T recorded frames.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    make_continuous,
    quaternion_conjugate,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from simulated_persons.simulation import TICK_S

SETTLE_S = 0.8  # muscles and scapula find their place before the recording starts
HOLD_S = 0.2  # rest before and after the movement, within the recording
EASE_S = 0.3  # recordings start while the arm moves already
WAVES = 5


@dataclass(frozen=True, eq=False)
class Variation:
    """How one repeat differs from the recording.

    Attributes
    ----------
    pace, size : factors on duration and on the excursion from the start
    path_rad : (3, 3, WAVES) amplitudes of smooth rotations by joint (SC, AC, GH) and axis
    """

    pace: float
    size: float
    path_rad: np.ndarray


def no_variation() -> Variation:
    """The recording as it is."""
    return Variation(1.0, 1.0, np.zeros((3, 3, WAVES)))


def draw_variation(rng: np.random.Generator, girdle_deg: float, humerus_deg: float) -> Variation:
    """A random repeat; standard deviations of the path in degrees."""
    spread = np.deg2rad([girdle_deg, girdle_deg, humerus_deg])[:, None, None]
    waves = rng.normal(size=(3, 3, WAVES)) * spread / np.sqrt(WAVES)
    return Variation(float(np.exp(rng.normal(0, 0.05))), float(1 + rng.normal(0, 0.02)), waves)


def wished_poses(motion: Motion, variation: Variation) -> np.ndarray:
    """Poses (S, 13) every 10 ms: settling, rest, the varied movement, rest."""
    duration = motion.time_s[-1] - motion.time_s[0]
    moving = variation.pace * duration + 0.5 * EASE_S
    time = np.arange(0.0, SETTLE_S + moving + 2 * HOLD_S, TICK_S) - SETTLE_S - HOLD_S
    eased = np.where(time < EASE_S, time**2 / (2 * EASE_S), time - 0.5 * EASE_S)
    clock = np.clip(np.where(time > 0, eased, 0.0) / variation.pace, 0.0, duration)
    angles = CubicSpline(motion.time_s, np.unwrap(motion.angles_rad, axis=0))
    pose = trial_to_pose(angles(motion.time_s[0] + clock))
    phase = clock / duration
    for joint in range(3):
        part = slice(4 * joint, 4 * joint + 4)
        pose[:, part] = _vary(pose[:, part], phase, variation.path_rad[joint], variation.size)
    pose[:, 12] = pose[0, 12] + variation.size * (pose[:, 12] - pose[0, 12])
    return pose


def smooth_noise(rng: np.random.Generator, phase: np.ndarray, channels: int) -> np.ndarray:
    """Smooth random curves (S, channels) of unit variance over phase in [0, 1]."""
    return _waves(phase) @ rng.normal(size=(WAVES, channels)) / np.sqrt(WAVES)


def _waves(phase: np.ndarray) -> np.ndarray:
    """Cosines (S, WAVES) of mean square one; the first is constant."""
    return np.sqrt(2.0 - (np.arange(WAVES) == 0)) * np.cos(
        np.pi * phase[:, None] * np.arange(WAVES)
    )


def _vary(quaternion: np.ndarray, phase: np.ndarray, waves: np.ndarray, size: float) -> np.ndarray:
    """Scale the excursion of a joint (S, 4) and add a smooth rotation in child axes."""
    start = np.broadcast_to(quaternion[0], quaternion.shape)
    turn = quaternion_multiply(quaternion_conjugate(start), quaternion)
    grown = rotation_vector_to_quaternion(size * _rotation_vector(turn))
    extra = rotation_vector_to_quaternion(_waves(phase) @ waves.T)
    return make_continuous(quaternion_multiply(quaternion_multiply(start, grown), extra))


def _rotation_vector(turn: np.ndarray) -> np.ndarray:
    vector = turn[:, 1:] * np.where(turn[:, :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(vector, axis=1, keepdims=True)
    angle = 2.0 * np.arctan2(sine, np.abs(turn[:, :1]))
    return vector * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
