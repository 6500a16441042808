"""Which girdle a model would rather have under a still arm, and what the recorded one costs it.

At recorded poses of the rising arm: the girdle of least effort, and the recorded girdle held where
it is. Free of rates and of the motion before, the difference is that of muscles, springs and
surfaces. Effort and joint stability weigh as in the prediction.

Letters: M muscles.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.errors import SolveError
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import Array, positive_pose
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.problems.least_joint_force import least_joint_force
from scapulohumeral.problems.model_files import ModelFiles, load_model
from scapulohumeral.problems.posed_problem import effort_factors
from scapulohumeral.problems.static_posture import Posture, StaticSolution, static_posture
from scapulohumeral.quantities.joint_loading import glenohumeral_load, percent_body_weight
from scapulohumeral.quantities.muscle_groups import most_changed
from scapulohumeral.quantities.population import POSTERIOR_TILT, UPWARD_ROTATION
from scapulohumeral.quantities.recording_distance import CLAVICLE_ELEVATION
from scapulohumeral.quantities.rhythm import node_near
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN, thorax_angles
from scapulohumeral.stages.calibration import calibrated_muscles
from scapulohumeral.stages.tracking import held_load

# Elevations at which postures are taken, as far as the arm goes [deg].
LEVELS_DEG = (15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
ANGLES = ("upward_rotation", "tilt", "clavicle_elevation")
COSTS = ("effort", "stability", "force_bw")
COLUMNS = (
    *("participant", "plane", "arm_deg", "status"),
    *(f"{name}_{angle}_deg" for angle in ANGLES for name in ("recorded", "free")),
    *(f"{name}_{cost}" for cost in COSTS for name in ("free", "held")),
    *("least_force_bw", "paying"),
)


@dataclass(frozen=True)
class PostureFiles:
    """A participant's model, EMG channels, scalers (None: generic), and tracked elevations."""

    model: ModelFiles
    channels: Path
    calibration: Path | None
    tracked: Sequence[Path]


def static_postures(files: PostureFiles, weights: Mapping[str, float], w_gh: float) -> pd.DataFrame:
    """A row per plane and elevation; failed solves have their reason and no numbers.

    Columns: participant, plane, arm_deg; upward rotation, posterior tilt and clavicle elevation
    recorded and of least effort [deg]; effort and objective of both; joint force [% of body
    weight], of both and the least that any activations need for the recorded girdle; groups whose
    effort rises most when the recorded girdle is held; status.

    Parameters
    ----------
    weights : of the prediction; w_gh : weight of joint stability
    """
    model = load_model(files.model)
    muscles = calibrated_muscles(model.record, files.channels, files.calibration)
    posture = Posture(
        forces=model.forces,
        muscles=muscles,
        parameters=model.free_parameters(),
        glenoid=model.glenoid,
        stability=(w_gh * model.superior_inferior_share, w_gh),
        effort=weights["activation"] * effort_factors(muscles, weights["strength_exponent"]),
        clavicle_point_m=weights["clavicle_point_m"],
    )
    rows = []
    for path in files.tracked:
        tracked = read_solution(path)
        load = held_load(files.model, [tracked.header["trial"]])
        loaded = replace(posture, parameters=model.free_parameters(load))
        for level, pose in _recorded(tracked.reference_pose):
            about = {"participant": tracked.header["participant"]}
            about |= {"plane": tracked.header["trial"], "arm_deg": level}
            rows.append(about | _row(loaded, pose, model.record, weights["trajectory_quaternion"]))
    return pd.DataFrame(rows, columns=list(COLUMNS))


def _recorded(poses: Array) -> Iterator[tuple[float, Array]]:
    """Recorded poses at fixed elevations of the rise; signs of quaternions as solvers want them."""
    elevation = thorax_angles(poses)[:, ELEVATION_COLUMN]
    for level in LEVELS_DEG:
        node = node_near(elevation, level)
        if node is not None:
            yield level, positive_pose(poses[node])


def _row(posture: Posture, pose: Array, record: ModelRecord, held_by: float) -> dict[str, Any]:
    """Postures free and held: `held_by` weighs the recorded girdle, which stays within a degree or
    two.
    """
    try:
        free, held = static_posture(posture, pose), static_posture(posture, pose, [held_by])
    except SolveError as error:
        return {"status": str(error)}
    costs = _costs("free", posture, free, record) | _costs("held", posture, held, record)
    if np.isnan([costs["free_stability"], costs["held_stability"]]).any():
        return {"status": "static posture: the glenohumeral joint is pulled apart"}
    return {
        **_angles("recorded", pose),
        **_angles("free", free.pose),
        **costs,
        "least_force_bw": percent_body_weight(
            least_joint_force(posture, held.pose), record.body_mass_kg
        ),
        "paying": _paying(posture, free, held, record),
        "status": "optimal",
    }


def _angles(name: str, pose: Array) -> dict[str, float]:
    angles = thorax_angles(pose[None])[0]
    return {
        f"{name}_upward_rotation_deg": float(angles[UPWARD_ROTATION]),
        f"{name}_tilt_deg": float(angles[POSTERIOR_TILT]),
        f"{name}_clavicle_elevation_deg": float(angles[CLAVICLE_ELEVATION]),
    }


def _costs(
    name: str, posture: Posture, found: StaticSolution, record: ModelRecord
) -> dict[str, float]:
    """Effort and stability of a posture, without what holds it, and its joint force."""
    load = glenohumeral_load(found.reaction_N[None], record)
    superior, posterior = load.path[0]
    shear = np.array([superior, posterior])
    return {
        f"{name}_effort": float(posture.effort @ found.activation**2),
        f"{name}_stability": float(np.array(posture.stability) @ shear**2),
        f"{name}_force_bw": float(load.percent_body_weight[0]),
    }


def _paying(
    posture: Posture, free: StaticSolution, held: StaticSolution, record: ModelRecord
) -> str:
    """Groups whose effort differs most between the held and the free girdle, largest first."""
    change = posture.effort * (held.activation**2 - free.activation**2)
    return most_changed(change, np.array(record.muscle_groups))
