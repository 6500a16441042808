"""Repeats of a movement: other timing, other path, as people vary; and the movement done otherwise.

Letters: S control steps, T recorded frames.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    make_continuous,
    pose_to_trial,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from simulated_persons.scatter import (
    AC_DEG,
    ANGLE_DEG,
    EL_DEG,
    GH_DEG,
    LOG_DURATION,
    PHASE_SHIFT,
    SC_DEG,
    WAVES,
    curves,
    draw_waves,
)
from simulated_persons.simulation import TICK_S

SETTLE_S = 0.8  # muscles and scapula find their place before the recording starts
HOLD_S = 0.2  # rest before and after the movement, within the recording
EASE_S = 0.3  # recordings start while the arm moves already
ENDS = 0.3  # share of a movement over which a shift of its timing grows
# A movement that is done otherwise departs from the usual one as far as repeats of it do, times
# this, by a constant and slow changes, of which tasks share a part.
CHANGE_SCALE, CHANGE_WAVES, CHANGE_SHARED = 1.2, 3, 0.7
CHANGE_DEG = CHANGE_SCALE * np.array([SC_DEG] * 3 + [AC_DEG] * 3 + [GH_DEG] * 3 + [EL_DEG])
SMOOTH_HZ = 3.0


@dataclass(frozen=True, eq=False)
class Variation:
    """How one trial differs from the movement as it is.

    Attributes
    ----------
    pace : factor on the duration
    shift : (4,) amplitudes of smooth shifts of the phase
    path_rad : (10, WAVES) amplitudes of smooth rotations about child axes of SC, AC, GH, and of EL
    """

    pace: float
    shift: np.ndarray
    path_rad: np.ndarray

    def and_also(self, path_rad: np.ndarray) -> Variation:
        """The same with another path (10, WAVES) on top."""
        return replace(self, path_rad=self.path_rad + path_rad)


def no_variation() -> Variation:
    """The movement as it is."""
    return Variation(1.0, np.zeros(len(PHASE_SHIFT)), np.zeros((10, WAVES)))


def draw_variation(rng: np.random.Generator, scale: float) -> Variation:
    """A random repeat of a task with a scale of its scatter.

    Clavicle and scapula scatter in the record only: how a person holds them follows from the arm.
    """
    deviation = scale * np.deg2rad(ANGLE_DEG)
    deviation[:6] = 0.0
    return Variation(
        float(np.exp(rng.normal(0.0, LOG_DURATION))),
        PHASE_SHIFT * rng.normal(size=len(PHASE_SHIFT)),
        draw_waves(rng, deviation),
    )


def draw_change(rng: np.random.Generator, tasks: Sequence[str]) -> dict[str, np.ndarray]:
    """How a person does all tasks otherwise: path (10, WAVES) [rad] of each."""
    order = np.arange(WAVES)
    size = np.where(order < CHANGE_WAVES, 1.0 / (1.0 + order), 0.0)
    size /= np.linalg.norm(size)

    def one(share: float) -> np.ndarray:
        waves = rng.normal(size=(10, WAVES)) * size
        return np.sqrt(share) * np.deg2rad(CHANGE_DEG)[:, None] * waves

    shared = one(CHANGE_SHARED)
    return {task: shared + one(1.0 - CHANGE_SHARED) for task in tasks}


def movement_made(pose: np.ndarray) -> Motion:
    """The movement that an arm made, from poses (S, 13) of a trial as :func:`wished_poses` has it.

    What is left of the tremor of control is smoothed away, rest before and after is cut off.
    """
    sections = butter(2, SMOOTH_HZ, fs=1.0 / TICK_S, output="sos")
    angles: np.ndarray = sosfiltfilt(sections, np.unwrap(pose_to_trial(pose), axis=0), axis=0)
    moved = angles[round((SETTLE_S + HOLD_S) / TICK_S) : -round(HOLD_S / TICK_S)]
    return Motion(TICK_S * np.arange(len(moved), dtype=float), np.asarray(moved, dtype=float))


def phase_of_trial(count: int) -> np.ndarray:
    """Where a recording (count,) is between its start, 0 before, and its end, 1."""
    start = round(SETTLE_S / TICK_S)
    return np.clip((np.arange(count) - start) / max(count - 1 - start, 1), 0.0, 1.0)


def wished_poses(motion: Motion, variation: Variation) -> np.ndarray:
    """Poses (S, 13) every 10 ms: settling, rest, the varied movement, rest."""
    duration = motion.time_s[-1] - motion.time_s[0]
    moving = variation.pace * duration + 0.5 * EASE_S
    time = np.arange(0.0, SETTLE_S + moving + 2 * HOLD_S, TICK_S) - SETTLE_S - HOLD_S
    eased = np.where(time < EASE_S, time**2 / (2 * EASE_S), time - 0.5 * EASE_S)
    clock = np.clip(np.where(time > 0, eased, 0.0) / variation.pace, 0.0, duration)
    phase = _shifted(clock / duration, variation.shift)
    angles = CubicSpline(motion.time_s, np.unwrap(motion.angles_rad, axis=0))
    pose = trial_to_pose(angles(motion.time_s[0] + duration * phase))
    path = curves(phase, variation.path_rad)
    for joint in range(3):
        part = slice(4 * joint, 4 * joint + 4)
        turn = rotation_vector_to_quaternion(path[:, 3 * joint : 3 * joint + 3])
        pose[:, part] = make_continuous(quaternion_multiply(pose[:, part], turn))
    pose[:, 12] += path[:, 9]
    return pose


def _shifted(phase: np.ndarray, shift: np.ndarray) -> np.ndarray:
    """Phase (S,) moved by smooth curves, but not at its ends, where the arm rests."""
    inside = np.clip(np.minimum(phase, 1.0 - phase) / ENDS, 0.0, 1.0)
    return phase + inside**2 * (3.0 - 2.0 * inside) * curves(phase, shift[None])[:, 0]


def smooth_noise(rng: np.random.Generator, phase: np.ndarray, channels: int) -> np.ndarray:
    """Smooth random curves (S, channels) of unit variance over phase in [0, 1]."""
    return curves(phase, draw_waves(rng, np.ones(channels)))
