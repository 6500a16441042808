"""The region of poses over which muscle geometry is fitted: the recorded motions with a margin.

Predictions keep the recorded orientation of the humerus in the thorax, but scapula and clavicle
find their own: quaternion geometry also covers girdles turned under a recorded arm.

Letters: F recorded frames, P drawn poses. A pose has the thirteen numbers of ``rotations``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.participant import Participant
from scapulohumeral.model.rotations import (
    Array,
    girdle_turned,
    pose_to_trial,
    positive_pose,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)

# Below this share of accepted draws the margin asks for poses that no shoulder takes.
FEWEST_ACCEPTED = 0.05


@dataclass(frozen=True)
class Region:
    """How far poses reach beyond the recorded ones.

    Attributes
    ----------
    margin_deg : largest turn of any joint
    scapula_turn_deg : lowest and highest turn of the scapula about its own z axis, upward positive,
        under the recorded humerus
    girdle_turn_deg : largest turn, under the recorded humerus, of the clavicle about any axis, and
        of the scapula about any axis in the plane of its own x and y (tilt, internal rotation)
    """

    margin_deg: float
    scapula_turn_deg: tuple[float, float] = (0.0, 0.0)
    girdle_turn_deg: float = 0.0

    def __post_init__(self) -> None:
        """Refuse an interval that leaves the recorded scapula out, and impossible turns."""
        low, high = self.scapula_turn_deg
        if not -90.0 <= low <= 0.0 <= high <= 90.0:
            raise ConfigError(
                f"scapula_turn_deg {low} to {high}; expected an interval around 0 within 90 deg"
            )
        if not 0.0 <= self.girdle_turn_deg <= 90.0:
            raise ConfigError(
                f"girdle_turn_deg {self.girdle_turn_deg}; expected 0 to 90 deg. Recommended: 20."
            )


def _all(poses: Array) -> np.ndarray:
    return np.ones(len(poses), bool)


def recorded_angles(participant: Participant) -> Array:
    """Joint angles of all frames that were recorded of a participant, shape (F, 10) [rad]."""
    return np.concatenate([motion.angles_rad for motion in participant.recordings])


def recorded_poses(participant: Participant) -> Array:
    """Poses of all frames that were recorded of a participant, shape (F, 13)."""
    return np.concatenate([trial_to_pose(m.angles_rad) for m in participant.recordings])


def elevation_angles(participant: Participant) -> Array:
    """Joint angles of all recorded frames but those of daily tasks, shape (F, 10) [rad]."""
    return np.concatenate([motion.angles_rad for motion in participant.elevations])


def elevation_poses(participant: Participant) -> Array:
    """Poses of all recorded frames but those of daily tasks, shape (F, 13)."""
    return np.concatenate([trial_to_pose(m.angles_rad) for m in participant.elevations])


def draw_sample_angles(
    participant: Participant,
    formulation: str,
    region: Region,
    count: int,
    rng: np.random.Generator,
    accept: Callable[[Array], np.ndarray] = _all,
    further: Array | None = None,
) -> Array:
    """Joint angles, shape (P, 10) [rad], at which a formulation's geometry is sampled.

    For "quaternion" by `draw_poses`, for "euler" by `draw_angles`, which needs no turned scapulae
    because Euler angles are for tracking only; arguments are theirs. ``further`` poses (F, 13)
    count as recorded ones, for quaternions: arms that are followed without being recorded.

    Raises
    ------
    ConfigError                      unknown formulation, or a margin that cannot be used
    """
    if formulation == "quaternion":
        poses = recorded_poses(participant)
        if further is not None:
            poses = np.concatenate([poses, further])
        return pose_to_trial(draw_poses(poses, region, count, rng, accept))
    if formulation == "euler":
        return draw_angles(recorded_angles(participant), region.margin_deg, count, rng, accept)
    raise ConfigError(f"unknown formulation {formulation!r}: choose quaternion or euler")


def draw_poses(
    recorded: Array,
    region: Region,
    count: int,
    rng: np.random.Generator,
    accept: Callable[[Array], np.ndarray] = _all,
) -> Array:
    """Poses near recorded ones: scapula turned under the arm, then each joint turned at random.

    Parameters
    ----------
    recorded : array, shape (F, 13)
    region : Region                  how far; turns of SC, AC and GH about any axis are rotation
                                     vectors uniform in a ball, all others uniform in an interval
    count : int                      P
    rng : numpy Generator            seeded by the caller, so that draws can be repeated
    accept : function                poses (P, 13) -> boolean (P,); refused ones are drawn again,
                                     e.g. those with the scapula deep in the thorax

    Returns
    -------
    array, shape (P, 13)             scalar parts are >= 0

    Raises
    ------
    ConfigError                      if the margin is not between 0 and 90 degrees, or so large that
                                     fewer than FEWEST_ACCEPTED of the draws pass
    """
    recorded = np.asarray(recorded, float)
    low, high = np.deg2rad(region.scapula_turn_deg)
    girdle = np.deg2rad(region.girdle_turn_deg)

    def turned(margin: float) -> Array:
        poses = recorded[rng.integers(len(recorded), size=count)]
        scapula = np.zeros((count, 3))
        scapula[:, :2] = girdle * _uniform_in_ball(count, rng, 2)
        scapula[:, 2] = rng.uniform(low, high, count)
        clavicle = girdle * _uniform_in_ball(count, rng)
        return _turned(girdle_turned(poses, clavicle, scapula), margin, rng)

    return _draw(turned, region.margin_deg, count, accept)


def draw_angles(
    recorded: Array,
    margin_deg: float,
    count: int,
    rng: np.random.Generator,
    accept: Callable[[Array], np.ndarray] = _all,
) -> Array:
    """Joint angles near recorded ones: moved at random, on the recorded branch.

    Near gimbal lock the same orientations have angles far from each other; functions of the angles
    need samples where the recorded angles are.

    Parameters
    ----------
    recorded : array, shape (F, 10)  [rad]
    margin_deg : float               largest change of the three angles of SC, AC and GH together
                                     (uniform in a ball, as in `draw_poses`) and of the elbow
    count, rng, accept               as in `draw_poses`; accept gets the poses of the angles

    Returns
    -------
    array, shape (P, 10)             [rad]

    Raises
    ------
    ConfigError                      as in `draw_poses`
    """
    recorded = np.asarray(recorded, float)

    def moved(margin: float) -> Array:
        angles = recorded[rng.integers(len(recorded), size=count)]
        for start in (0, 3, 6):
            angles[:, start : start + 3] += margin * _uniform_in_ball(count, rng)
        angles[:, 9] += rng.uniform(-margin, margin, count)
        return angles

    return _draw(moved, margin_deg, count, lambda angles: accept(trial_to_pose(angles)))


def _draw(
    candidates: Callable[[float], Array],
    margin_deg: float,
    count: int,
    accept: Callable[[Array], np.ndarray],
) -> Array:
    """Accepted rows of `candidates(margin in rad)`, drawn until there are enough."""
    if not 0.0 <= margin_deg <= 90.0:
        raise ConfigError(f"margin {margin_deg} deg; expected 0 to 90. Recommended: 10.")
    drawn: list[Array] = []
    while sum(len(rows) for rows in drawn) < count:
        rows = candidates(np.deg2rad(margin_deg))
        drawn.append(rows[accept(rows)])
        if len(drawn[-1]) < FEWEST_ACCEPTED * count:
            raise ConfigError(
                f"margin {margin_deg} deg: {len(drawn[-1])} of {count} drawn poses are possible; "
                f"expected {FEWEST_ACCEPTED:.0%} or more. Choose a smaller margin or clearance."
            )
    return np.concatenate(drawn)[:count]


def _turned(poses: Array, margin: float, rng: np.random.Generator) -> Array:
    """Poses (P, 13), every joint turned at random by up to a margin [rad]; scalar parts >= 0."""
    count, poses = len(poses), poses.copy()
    for start in (0, 4, 8):
        turn = rotation_vector_to_quaternion(margin * _uniform_in_ball(count, rng))
        poses[:, start : start + 4] = quaternion_multiply(poses[:, start : start + 4], turn)
    poses[:, 12] += rng.uniform(-margin, margin, count)
    return positive_pose(poses)


def _uniform_in_ball(count: int, rng: np.random.Generator, axes: int = 3) -> Array:
    """Vectors, shape (P, axes), uniform in the unit ball, or in the unit disc if there are two."""
    direction = rng.normal(size=(count, axes))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * rng.uniform(size=(count, 1)) ** (1.0 / axes)
