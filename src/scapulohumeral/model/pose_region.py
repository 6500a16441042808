"""The region of poses over which muscle geometry is fitted: the recorded motions with a margin.

Letters: F recorded frames, P drawn poses. A pose has the thirteen numbers of ``rotations``.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from scapulohumeral.errors import ConfigError
from scapulohumeral.model.participant import Participant
from scapulohumeral.model.rotations import (
    Array,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)

# Below this share of accepted draws the margin asks for poses that no shoulder takes.
FEWEST_ACCEPTED = 0.05


def _all(poses: Array) -> np.ndarray:
    return np.ones(len(poses), bool)


def recorded_poses(participant: Participant) -> Array:
    """Poses of all frames of all trials of a participant, shape (F, 13)."""
    return np.concatenate(
        [trial_to_pose(trial.motion.angles_rad) for trial in participant.trials.values()]
    )


def draw_poses(
    recorded: Array,
    margin_deg: float,
    count: int,
    rng: np.random.Generator,
    accept: Callable[[Array], np.ndarray] = _all,
) -> Array:
    """Poses near recorded ones: each joint turned from its recorded orientation at random.

    Parameters
    ----------
    recorded : array, shape (F, 13)
    margin_deg : float               largest turn of SC, AC and GH about any axis (rotation vector
                                     uniform in a ball), and of the elbow (uniform in an interval)
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
    if not 0.0 <= margin_deg <= 90.0:
        raise ConfigError(f"margin {margin_deg} deg; expected 0 to 90. Recommended: 15.")
    drawn: list[Array] = []
    while sum(len(poses) for poses in drawn) < count:
        poses = _perturbed(np.asarray(recorded, float), np.deg2rad(margin_deg), count, rng)
        drawn.append(poses[accept(poses)])
        if len(drawn[-1]) < FEWEST_ACCEPTED * count:
            raise ConfigError(
                f"margin {margin_deg} deg: {len(drawn[-1])} of {count} drawn poses are possible; "
                f"expected {FEWEST_ACCEPTED:.0%} or more. Choose a smaller margin."
            )
    return np.concatenate(drawn)[:count]


def _perturbed(recorded: Array, margin: float, count: int, rng: np.random.Generator) -> Array:
    poses = recorded[rng.integers(len(recorded), size=count)]
    for start in (0, 4, 8):
        turn = rotation_vector_to_quaternion(margin * _uniform_in_ball(count, rng))
        turned = quaternion_multiply(poses[:, start : start + 4], turn)
        poses[:, start : start + 4] = turned * np.where(turned[:, :1] < 0.0, -1.0, 1.0)
    poses[:, 12] += rng.uniform(-margin, margin, count)
    return poses


def _uniform_in_ball(count: int, rng: np.random.Generator) -> Array:
    """Vectors, shape (P, 3), uniform in the unit ball."""
    direction = rng.normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return direction * np.cbrt(rng.uniform(size=(count, 1)))
