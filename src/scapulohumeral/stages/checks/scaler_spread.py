"""How uncertain a prediction is because calibrated muscle parameters are.

The solution moves with the scalers as its optimality conditions say; one factorisation of their
matrix gives its derivatives by all of them (:mod:`scapulohumeral.ocp.optimality.sensitivity`). With
the covariance of the calibration these are a covariance of the prediction, to first order and with
the same active bounds.

Letters: N nodes, G groups, P = 2 G scalers, forces first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.emg.channels import read_channels
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.record import read_record
from scapulohumeral.ocp.optimality.kkt import assemble_kkt
from scapulohumeral.ocp.optimality.sensitivity import (
    ProblemParts,
    condition_derivatives,
    parts_of,
    sensitivity,
)
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.problems.calibrated_groups import muscle_groups
from scapulohumeral.problems.posed_problem import PosedProblem
from scapulohumeral.quantities.published_distance import LEVELS_DEG, at_level
from scapulohumeral.quantities.segment_angles import UPWARD_ROTATION_COLUMN, thorax_angles
from scapulohumeral.stages.calibration import KINDS, read_covariance, read_scalers
from scapulohumeral.stages.prediction import (
    Condition,
    PredictionFiles,
    PredictionSettings,
    posing,
)

# Step along a derivative for differences of angles, as a share of one whole scaler [1].
SHARE = 1e-4
COLUMNS = (
    *("participant", "condition", "plane", "arm_deg"),
    *("mostly_by", "upward_rotation_deg", "sd_deg", "by_it_deg"),
)


def scaler_spread(
    solution: Path, condition: Condition, files: PredictionFiles, settings: PredictionSettings
) -> pd.DataFrame:
    """Upward rotation of a prediction with its standard deviation from that of the scalers.

    Returns
    -------
    table, one row per plane and elevation of the rising arm; none of a solve that failed
        participant, condition, plane, arm_deg, upward_rotation_deg, sd_deg; mostly_by, the scaler
        that alone would leave most of it, and by_it_deg, how much

    Raises
    ------
    ConfigError                      a prediction with generic muscles
    """
    if files.calibration is None:
        raise ConfigError(
            f"prediction {condition.name}: its muscles are generic, so no calibration makes it "
            "uncertain; choose a condition with calibrated parameters"
        )
    solved = read_solution(solution, allow_failed=True)
    if not solved.optimal:
        return pd.DataFrame(columns=list(COLUMNS))
    record = read_record(files.model.model)
    scalers = muscle_groups(record, read_channels(files.channels))
    values, generic = read_scalers(files.calibration, scalers), muscle_parameters(record)
    posed_for = posing(condition, files, settings)

    def posed_with(theta: np.ndarray) -> PosedProblem:
        return posed_for(scalers.apply(generic, theta.reshape(values.shape)))

    slopes = upward_rotation_slopes(posed_with, solved.start, values.ravel())
    covariance = read_covariance(files.calibration)
    alone = np.abs(slopes) * np.sqrt(np.diag(covariance))
    sd = np.sqrt(np.einsum("np,pk,nk->n", slopes, covariance, slopes))
    names = [f"{kind} of {group}" for kind in KINDS for group in scalers.names]
    angles = thorax_angles(solved.pose)
    rows = []
    for plane, (first, stop) in solved.header["planes"].items():
        for level in LEVELS_DEG:
            after = _node_at(angles[first:stop], level)
            if after is None:
                continue
            node = first + after
            worst = int(np.argmax(alone[node]))
            rows.append(
                {
                    "participant": solved.header["participant"],
                    "condition": condition.name,
                    "plane": plane,
                    "arm_deg": level,
                    "mostly_by": names[worst],
                    "upward_rotation_deg": angles[node, UPWARD_ROTATION_COLUMN],
                    "sd_deg": sd[node],
                    "by_it_deg": alone[node, worst],
                }
            )
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _node_at(angles: np.ndarray, level: float) -> int | None:
    """Node at which the rising arm is nearest to an elevation [deg], None if it never is there."""
    nodes = np.column_stack([angles, np.arange(len(angles))])
    place = at_level(nodes, nodes.shape[1] - 1, level)
    return None if np.isnan(place) else round(place)


def upward_rotation_slopes(
    posed_with: Callable[[np.ndarray], PosedProblem], point: Start, theta: np.ndarray
) -> np.ndarray:
    """Derivatives (N, P) of upward rotation by parameters of the muscles [deg per one].

    Parameters
    ----------
    posed_with : problem for parameters (P,) of the muscles; theta : those of the solution
    point : solution with multipliers
    """
    problem = posed_with(theta).problem("exact")
    base = parts_of(problem)

    def parts_for(changed: np.ndarray) -> ProblemParts:
        posed = posed_with(changed)
        collocation = replace(base.collocation, muscles=posed.muscles)
        return replace(base, collocation=collocation, objective=posed.objective)

    kkt = assemble_kkt(problem, point)
    moves = sensitivity(kkt, condition_derivatives(kkt, point, parts_for, theta)).free
    q = problem.trajectory(point.free).q
    slopes = []
    for move in moves.T:
        step = SHARE * problem.trajectory(move).q
        above, below = (
            thorax_angles(q + sign * step)[:, UPWARD_ROTATION_COLUMN] for sign in (1.0, -1.0)
        )
        slopes.append((above - below) / (2.0 * SHARE))
    return np.column_stack(slopes)
