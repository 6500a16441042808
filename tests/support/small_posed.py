"""The small model as a stage sees it: a participant's model and a problem posed from it."""

from dataclasses import replace

import numpy as np
from skeleton import CONSTANTS, muscle, skeleton_record
from small_arm import NAMES, STEP, small_forces, small_motion, small_muscles, small_parameters
from synthetic_study import solution

from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.model.constants import Glenoid
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.problems.model_files import ShoulderModel
from scapulohumeral.problems.posed_problem import (
    PosedProblem,
    SolveSettings,
    Target,
    make_objective,
)

GLENOID = Glenoid(6.0, -3.0, 0.31)
WEIGHTS = {
    "trajectory_quaternion": 200.0,
    "trajectory_euler": 50.0,
    "clavicle_point_m": 0.5,
    "activation": 1.0,
    "regularisation": 1e-2,
    "reaction_rate": 1e-6,
    "excitation_rate": 1e-3,
    "quaternion_norm": 150.0,
}


class SmallModel(ShoulderModel):
    """Three muscles on an arm that is no participant's."""

    def parameters(self, hand_load_kg: float = 0.0) -> np.ndarray:
        """Run-time parameters of the small arm."""
        return pack({**unpack(small_parameters()), "mass_load": hand_load_kg})


def small_model(equations) -> SmallModel:
    """The small model on given equations; each muscle is a group of its own."""
    record = replace(
        skeleton_record(),
        constants=replace(CONSTANTS, glenoid=GLENOID),
        muscles=tuple(muscle(name, group=name) for name in NAMES),
    )
    return SmallModel(record, {}, small_forces(equations))


def small_settings(step: float = STEP, **weights: float) -> SolveSettings:
    """Settings with further weights."""
    return SolveSettings(step, 1e-8, 500, "automatic", {**WEIGHTS, **weights})


def small_tracked(plane: str, status: str = "optimal") -> Solution:
    """A tracked elevation of par2, with no more muscles than the small model has."""
    solved = solution("par2", plane, "quaternion", status)
    few = {name: getattr(solved, name)[:, : len(NAMES)] for name in ("activation", "excitation")}
    return replace(solved, **few)


def small_target(nodes: int, step: float = STEP, **changes) -> Target:
    """The slow elevation as a target."""
    motion = {
        "time_s": step * np.arange(nodes),
        "reference_rad": small_motion(nodes),
        "activity": np.ones(nodes),
    }
    return Target(**(motion | changes))


def small_posed(equations, target: Target, settings: SolveSettings, **changes) -> PosedProblem:
    """The small model follows a target."""
    model = small_model(equations)
    parts = {
        "model": model,
        "muscles": small_muscles(),
        "parameters": small_parameters(),
        "objective": make_objective(model, target, settings),
        "target": target,
    }
    return PosedProblem(**(parts | changes))
