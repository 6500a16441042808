"""Quantities of a prediction as rows of tables: rhythm by phase, load and rotation by plane.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.quantities.joint_loading import GlenohumeralLoad, glenohumeral_load
from scapulohumeral.quantities.published_distance import ANGLES, at_level
from scapulohumeral.quantities.rhythm import range_rhythm, rhythm_by_plane, rising_part
from scapulohumeral.quantities.segment_angles import (
    ELEVATION_COLUMN,
    UPWARD_ROTATION_COLUMN,
    thorax_angles,
)

# Phase of the rhythm that a whole elevation is told by.
WHOLE_RISE = "start-90"


@dataclass(frozen=True)
class PredictionCase:
    """What tells one prediction from another.

    Attributes
    ----------
    participant, condition : names
    w_gh : weight of J_GH [1]
    capacity : factor on the active force of the muscles that the condition limits [1]
    """

    participant: str
    condition: str
    w_gh: float
    capacity: float


def rhythm_rows(
    case: PredictionCase, pose: np.ndarray, nodes: Mapping[str, tuple[int, int]]
) -> list[dict[str, Any]]:
    """Rows of the table of rhythms, one per plane and phase: the case, then `PhaseRhythm`.

    ``pose`` (N, 13) and ``nodes`` as in :func:`rhythm.rhythm_by_plane`.
    """
    return [asdict(case) | asdict(phase) for phase in rhythm_by_plane(pose, nodes)]


def plane_rows(
    case: PredictionCase,
    solution: Solution,
    record: ModelRecord,
    nodes: Mapping[str, tuple[int, int]],
) -> list[dict[str, Any]]:
    """Rows of peaks, one per plane: the case, then :func:`peaks` of the nodes of the plane.

    ``record`` is the model record, with glenoid and body mass; ``nodes`` gives the first node and
    the one after the last by plane.
    """
    load = solution_load(solution, record)
    return [
        asdict(case) | {"plane": plane} | peaks(load, solution.pose, slice(*limits))
        for plane, limits in nodes.items()
    ]


def solution_load(solution: Solution, record: ModelRecord) -> GlenohumeralLoad:
    """Glenohumeral load of a solution, with the glenoid and the body mass of its model record.

    The record's ``body_mass_source`` says whether that mass is the participant's own or the mean
    of all participants.
    """
    return glenohumeral_load(solution.reaction_N, record)


def peaks(load: GlenohumeralLoad, pose: np.ndarray, nodes: slice) -> dict[str, float]:
    """Largest values over some nodes.

    Returns
    -------
    peak_gh_force_bw [% of body weight], max_eccentricity [1], fraction_outside [1] and
    peak_upward_rotation_deg
    """
    eccentricity = load.eccentricity[nodes]
    return {
        "peak_gh_force_bw": float(load.percent_body_weight[nodes].max()),
        "max_eccentricity": float(eccentricity.max()),
        "fraction_outside": float(np.mean(eccentricity > 1.0)),
        "peak_upward_rotation_deg": float(thorax_angles(pose)[nodes, UPWARD_ROTATION_COLUMN].max()),
    }


def rise_quantities(
    angles: np.ndarray,
    force: np.ndarray,
    unit: str,
    levels_deg: Sequence[float],
    clavicle_levels_deg: Sequence[float],
) -> dict[str, float]:
    """What tables of changed predictions say of one elevation.

    Upward rotation and clavicle elevation where the rising arm reaches fixed elevations, the peak
    of upward rotation, the rhythm of the rise by the paper's estimator, and the joint force where
    the rise starts and at its largest.

    Parameters
    ----------
    angles : array, shape (N, 10)    of one elevation, in the thorax [deg]
    force : array, shape (N,)        size of the joint force
    unit : of the force, which ends the names of its columns
    levels_deg, clavicle_levels_deg : elevations of the arm for upward rotation and for the clavicle
    """
    rise = rising_part(angles[:, ELEVATION_COLUMN])
    upward = angles[:, UPWARD_ROTATION_COLUMN]
    clavicle = ANGLES["clavicle_elevation"]
    return {
        **{f"ur_{at:g}_deg": at_level(angles, UPWARD_ROTATION_COLUMN, at) for at in levels_deg},
        "ur_peak_deg": float(upward.max()),
        **{f"clavicle_{at:g}_deg": at_level(angles, clavicle, at) for at in clavicle_levels_deg},
        "rhythm": range_rhythm(angles[rise, ELEVATION_COLUMN], upward[rise])[WHOLE_RISE],
        f"gh_force_start_{unit}": float(force[rise.start]),
        f"gh_force_peak_{unit}": float(force.max()),
    }
