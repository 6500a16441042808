"""The tracked motion of a case of the sensitivity: on another mesh, or with another start."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scapulohumeral.model.rotations import girdle_turned
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.problems.sensitivity import Case
from scapulohumeral.problems.solution_mesh import on_mesh, with_pose

# Activations of a random start: from hardly any to half of all.
RANDOM_ACTIVATION = (0.01, 0.5)


def changed_tracking(tracked: Solution, case: Case, random_turn_deg: float) -> Solution:
    """The tracked motion of a case: another mesh, or another girdle under the same arm.

    A prediction follows humerus and elbow of this motion and starts from all of it. Speeds are not
    changed with the girdle: no start has to be a motion.

    Raises
    ------
    ConfigError                      a mesh that does not end where the motion ends
    """
    if case.time_step_s is not None:
        return on_mesh(tracked, case.time_step_s)
    if case.seed is not None:
        return _random(tracked, case.seed, random_turn_deg)
    turn = np.array([0.0, 0.0, np.deg2rad(case.scapula_turn_deg)])
    return with_pose(tracked, girdle_turned(tracked.pose, np.zeros(3), turn))


def _random(tracked: Solution, seed: int, turn_deg: float) -> Solution:
    """A girdle turned by constant random rotations, random activations of constant size."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(2, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turns = np.deg2rad(turn_deg) * rng.uniform(size=(2, 1)) * axes
    effort = np.tile(rng.uniform(*RANDOM_ACTIVATION, len(tracked.muscles)), (len(tracked.q), 1))
    turned = with_pose(tracked, girdle_turned(tracked.pose, *turns))
    return replace(turned, activation=effort, excitation=effort)
