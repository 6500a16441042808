"""One prediction solved again: a weight, the mesh or the start changed, one at a time.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from scapulohumeral.configuration.sensitivity import Sensitivity
from scapulohumeral.model.rotations import girdle_turned
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.problems.solution_mesh import on_mesh, with_pose

BASE = "base"
STABILITY = "w_gh"
# Activations of a random start: from hardly any to half of all.
RANDOM_ACTIVATION = (0.01, 0.5)


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
