"""One prediction solved again: a weight, the mesh or the start changed, one at a time.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from scapulohumeral.configuration.sensitivity import Sensitivity
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import (
    Array,
    girdle_turned,
    pose_to_trial,
)
from scapulohumeral.ocp.solution import Solution

BASE = "base"
STABILITY = "w_gh"
# Activations of a random start: from hardly any to half of all.
RANDOM_ACTIVATION = (0.01, 0.5)
# Below this share of an interval a number of intervals counts as whole.
WHOLE_INTERVALS = 1e-6


@dataclass(frozen=True)
class Case:
    """One change.

    Attributes
    ----------
    name : of the case, and of its files
    kind : "base" (nothing is changed), "weight", "mesh" or "start"
    change : in words
    factors : factor on weights, by name
    time_step_s : mesh interval; None: that of the tracked motion
    scapula_turn_deg : turn of the scapula of the start about its z axis
    seed : of a random start; None: the tracked motion
    """

    name: str
    kind: str
    change: str
    factors: Mapping[str, float] = field(default_factory=dict)
    time_step_s: float | None = None
    scapula_turn_deg: float = 0.0
    seed: int | None = None


def sensitivity_cases(settings: Sensitivity) -> dict[str, Case]:
    """All cases by name, the unchanged prediction first."""
    cases = [Case(BASE, "base", "nothing")]
    for weight in settings.weights:
        for word, sign, power in (("divided", "/", -1), ("times", "×", 1)):
            about = f"{weight.replace('_', ' ')} {sign} {settings.factor:g}"
            factors: dict[str, float] = {weight: settings.factor**power}
            cases.append(Case(f"{weight}_{word}", "weight", about, factors))
    for step in settings.time_steps_s:
        name = f"mesh_{round(1000 * step)}ms"
        cases.append(Case(name, "mesh", f"mesh interval {step:g} s", time_step_s=step))
    for turn in settings.scapula_turns_deg:
        name = f"start_{'down' if turn < 0 else 'up'}_{abs(turn):g}".replace(".", "p")
        about = f"scapula of the start turned by {turn:+g} deg"
        cases.append(Case(name, "start", about, scapula_turn_deg=turn))
    for seed in settings.random_seeds:
        cases.append(Case(f"start_random_{seed}", "start", f"random start {seed}", seed=seed))
    return {case.name: case for case in cases}


def changed_weights(case: Case, weights: Mapping[str, float]) -> dict[str, float]:
    """Weights of the objective of a case; that of joint stability is in its condition."""
    return {key: value * case.factors.get(key, 1.0) for key, value in weights.items()}


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
    return _with_pose(tracked, girdle_turned(tracked.pose, np.zeros(3), turn))


def on_mesh(tracked: Solution, time_step_s: float) -> Solution:
    """A quaternion solution on another mesh of the same duration, without its multipliers.

    Raises
    ------
    ConfigError                      a mesh that does not end where the motion ends
    """
    duration = tracked.time_s[-1] - tracked.time_s[0]
    intervals = round(duration / time_step_s)
    if abs(duration / time_step_s - intervals) > WHOLE_INTERVALS * intervals:
        raise ConfigError(
            f"mesh interval {time_step_s:g} s: expected one that divides {duration:g} s, the time "
            f"of {tracked.header['trial']}. Choose the configured one divided by a whole number"
        )
    time = tracked.time_s[0] + time_step_s * np.arange(intervals + 1)

    def smooth(values: Array) -> Array:
        return CubicSpline(tracked.time_s, values, axis=0)(time)

    def straight(values: Array) -> Array:
        columns = [np.interp(time, tracked.time_s, column) for column in values.T]
        return np.stack(columns, axis=1)

    straights = ("activation", "excitation", "muscle_force_N", "fibre_length", "reaction_N")
    kinked: dict[str, Any] = {name: straight(getattr(tracked, name)) for name in straights}
    finer = replace(
        tracked,
        time_s=time,
        u=smooth(tracked.u),
        reference_rad=smooth(np.unwrap(tracked.reference_rad, axis=0)),
        reference_pose=_normalised(smooth(tracked.reference_pose)),
        **kinked,
    )
    return _with_pose(finer, _normalised(smooth(tracked.q)))


def _random(tracked: Solution, seed: int, turn_deg: float) -> Solution:
    """A girdle turned by constant random rotations, random activations of constant size."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(2, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    turns = np.deg2rad(turn_deg) * rng.uniform(size=(2, 1)) * axes
    effort = np.tile(rng.uniform(*RANDOM_ACTIVATION, len(tracked.muscles)), (len(tracked.q), 1))
    turned = _with_pose(tracked, girdle_turned(tracked.pose, *turns))
    return replace(turned, activation=effort, excitation=effort)


def _with_pose(tracked: Solution, pose: Array) -> Solution:
    """A solution in another pose; as a start it has no multipliers."""
    none = np.zeros(0)
    return replace(
        tracked,
        q=pose,
        pose=pose,
        angles_rad=pose_to_trial(pose),
        free=none,
        multipliers=none,
        lower=none,
        upper=none,
    )


def _normalised(pose: Array) -> Array:
    """Poses (N, 13) whose quaternions have unit norm."""
    unit = pose.copy()
    for first in (0, 4, 8):
        unit[:, first : first + 4] /= np.linalg.norm(pose[:, first : first + 4], axis=1)[:, None]
    return unit
