"""The motion that a simulated person wants to make, with its rates.

Letters: S control steps, N simulations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.model.rotations import (
    make_continuous,
    quaternion_conjugate,
    quaternion_multiply,
)


@dataclass(frozen=True, eq=False)
class Goal:
    """Wish of one moment.

    pose (N, 13); humerus (N, 4) in the thorax; rate and acceleration (N, 10) of clavicle and
    scapula joints, of the humerus against the thorax and of the elbow, in child axes. left (N, M):
    share of each muscle's active force that has not tired.
    """

    pose: np.ndarray
    humerus: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    left: np.ndarray

    def errors(self, q: np.ndarray) -> np.ndarray:
        """Rotations (N, 10) [rad] from poses (N, 13) to the wish, in child axes."""
        humerus = humerus_of(q)
        pairs = ((q[:, :4], self.pose[:, :4]), (q[:, 4:8], self.pose[:, 4:8]))
        turns = [_small_turn(a, b) for a, b in (*pairs, (humerus, self.humerus))]
        return np.hstack([*turns, self.pose[:, 12:] - q[:, 12:]])


@dataclass(frozen=True, eq=False)
class Wish:
    """Wished motion: pose (S, N, 13), humerus (S, N, 4), rate and acceleration (S, N, 10).

    tired (S, N): how far muscles are on their way from fresh to the end of a trial; end (N, M):
    share of their active force left there.
    """

    pose: np.ndarray
    humerus: np.ndarray
    rate: np.ndarray
    acceleration: np.ndarray
    tired: np.ndarray
    end: np.ndarray

    @property
    def count(self) -> int:
        """S."""
        return len(self.pose)

    def at(self, tick: int) -> Goal:
        """Wish of one control step."""
        left = 1.0 - self.tired[tick][:, None] * (1.0 - self.end)
        moving = self.rate[tick], self.acceleration[tick]
        return Goal(self.pose[tick], self.humerus[tick], *moving, left)


def make_wish(pose: np.ndarray, step: float, tired: np.ndarray, end: np.ndarray) -> Wish:
    """Wish from poses (S, N, 13) at a time step [s]; muscles tire as :class:`Wish` says."""
    humerus = make_continuous(humerus_of(pose))
    parts = (pose[..., :4], pose[..., 4:8], humerus)
    elbow = np.gradient(pose[..., 12:], step, axis=0)
    rate = np.concatenate([*(_angular_velocity(p, step) for p in parts), elbow], axis=-1)
    return Wish(pose, humerus, rate, np.gradient(rate, step, axis=0), tired, end)


def humerus_of(q: np.ndarray) -> np.ndarray:
    """Quaternion of the humerus in the thorax (..., 4) of poses (..., 13)."""
    scapula = quaternion_multiply(q[..., :4], q[..., 4:8])
    return quaternion_multiply(scapula, q[..., 8:12])


def _small_turn(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Twice the vector part of start^-1 end: the rotation vector for small turns."""
    turn = quaternion_multiply(quaternion_conjugate(start), end)
    return 2.0 * turn[..., 1:] * np.sign(turn[..., :1])


def _angular_velocity(quaternion: np.ndarray, step: float) -> np.ndarray:
    """Angular velocity in child axes (S, N, 3) [rad/s] of continuous quaternions (S, N, 4)."""
    rate = np.gradient(quaternion, step, axis=0)
    return 2.0 * quaternion_multiply(quaternion_conjugate(quaternion), rate)[..., 1:]
