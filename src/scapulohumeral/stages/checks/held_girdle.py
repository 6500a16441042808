"""What it costs a prediction to have its girdle where a motion has it.

The problem of a prediction is solved again while clavicle and scapula follow a motion: the recorded
one, or on a published arm the published prediction. What the prediction minimises is then higher by
the price of that motion. A small price says that the optimum lies in a flat valley, along which
small differences of a model move the scapula far; a high one, that the model itself disagrees with
the motion, and the terms and muscle groups that pay say where.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.model.rotations import Array, trial_to_pose
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.problems.posed_problem import PosedProblem, joint_pose, solve_posed
from scapulohumeral.quantities.muscle_groups import most_changed
from scapulohumeral.quantities.population import UPWARD_ROTATION
from scapulohumeral.quantities.rhythm import rising_part
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN, thorax_angles
from scapulohumeral.stages.prediction import (
    Condition,
    PredictionFiles,
    PredictionSettings,
    girdle_held,
)

FREE = 0.0
# Terms of the objective by what they pay for.
TERMS = {
    "arm": ("humerus", "elbow", "norm", "anchor"),
    "activation": ("activation",),
    "stability": ("stability",),
    "rates": ("speed_rate", "excitation_rate", "reaction_rate"),
}


def held_girdle(
    condition: Condition,
    files: PredictionFiles,
    settings: PredictionSettings,
    solution: Path,
    shares: Sequence[float],
) -> pd.DataFrame:
    """A row for the free prediction and one per share of the tracking weight that holds the girdle.

    Columns: variant, participant, held_to, share, status; objective without what holds the girdle,
    its price over the free one [%], and its parts; ur_<plane>_deg, RMS of upward rotation from the
    motion over the rising arm [deg]; paying, groups whose effort differs most from the free one. A
    solve that failed has its reason and no numbers.

    Parameters
    ----------
    solution : of the free prediction
    shares : firmest first; each solve starts from the one before

    Raises
    ------
    SolveError                       the free prediction failed
    """
    before = read_solution(solution)
    free, held = girdle_held(condition, files, settings)
    about = {
        "variant": settings.variant,
        "participant": before.header["participant"],
        "held_to": "recording" if files.arm is None else "published prediction",
    }
    at_optimum = free.reader.trajectory(before.free)
    motion = held(max(shares)).target.reference_rad
    planes: Mapping[str, Sequence[int]] = before.header["planes"]

    def row(share: float, found: Trajectory) -> dict[str, Any]:
        return {
            **about,
            "share": share,
            "status": "optimal",
            **_prices(free, found, at_optimum),
            **_distances(joint_pose(free.model.forces.dynamics.name, found), motion, planes),
            "paying": "" if share == FREE else _paying(free, found, at_optimum),
        }

    rows, start = [row(FREE, at_optimum)], Start(before.free)
    for share in shares:
        result = solve_posed(held(share), start, settings.solve, None)
        if not result.optimal:
            rows.append({**about, "share": share, "status": result.message})
            continue
        start = Start(result.point.free)
        rows.append(row(share, free.reader.trajectory(start.free)))
    return pd.DataFrame(rows)


def _prices(free: PosedProblem, found: Trajectory, at_optimum: Trajectory) -> dict[str, float]:
    """The free problem's objective, its price over the optimum [%], and its parts."""
    terms, least = free.objective.terms(found), free.objective.value(at_optimum)
    parts = {part: sum(terms.get(name, 0.0) for name in names) for part, names in TERMS.items()}
    objective = sum(terms.values())
    return {"objective": objective, "price_percent": 100.0 * (objective / least - 1.0), **parts}


def _distances(
    pose: Array, motion_rad: Array, planes: Mapping[str, Sequence[int]]
) -> dict[str, float]:
    """RMS of upward rotation from the motion while the arm rises, by plane [deg]."""
    angles, followed = thorax_angles(pose), thorax_angles(trial_to_pose(motion_rad))
    found = {}
    for plane, (first, stop) in planes.items():
        rise = rising_part(followed[first:stop, ELEVATION_COLUMN])
        apart = (angles - followed)[first:stop][rise, UPWARD_ROTATION]
        found[f"ur_{plane}_deg"] = float(np.sqrt(np.mean(apart**2)))
    return found


def _paying(free: PosedProblem, found: Trajectory, at_optimum: Trajectory) -> str:
    """Groups whose effort differs most from that of the free prediction."""
    efforts = free.objective.effort_by_muscle
    change = efforts(found) - efforts(at_optimum)
    return most_changed(change, np.array(free.model.record.muscle_groups))
