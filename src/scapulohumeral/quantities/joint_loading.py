"""Glenohumeral joint force: size, direction, and its path in the rim of the glenoid.

Letters: N nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import sympy as sm
from scipy import constants

from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.cost_terms import glenoid_rotation

# ASSUME the rim of the glenoid is an ellipse of shear over compression: 0.32 anterior-posterior
# and, by the paper's factor (anterior-posterior / superior-inferior)^2, 0.57 superior-inferior.
# Lippitt et al. 1993 (J Shoulder Elbow Surg 2:27) found that the humeral head resists shear of up
# to 0.6 of the compression, most along the superior-inferior axis.
ANTERIOR_POSTERIOR_LIMIT = 0.32
# Sizes of one force, or of many.
Newtons = TypeVar("Newtons", float, np.ndarray)


@dataclass(frozen=True, eq=False)
class GlenohumeralLoad:
    """Force of the humeral head on the glenoid.

    Attributes
    ----------
    force : (N, 3) compression into the glenoid, superior and posterior component [N]
    magnitude : (N,) [N]
    percent_body_weight : (N,) magnitude [% of body weight]
    path : (N, 2) superior and posterior component over compression [1], the point of the glenoid
        at which the force is directed; not a number where the joint is pulled apart
    eccentricity : (N,) distance of that point from the centre over that of the rim [1], above one
        outside; infinite where the joint is pulled apart
    """

    force: np.ndarray
    magnitude: np.ndarray
    percent_body_weight: np.ndarray
    path: np.ndarray
    eccentricity: np.ndarray


def percent_body_weight(newtons: Newtons, body_mass_kg: float) -> Newtons:
    """Size of a force [N], one or many, as a share of body weight [%], at standard gravity."""
    return 100.0 * newtons / (body_mass_kg * constants.g)


def glenohumeral_load(reaction: np.ndarray, record: ModelRecord) -> GlenohumeralLoad:
    """Load of the glenoid from the reaction of a solution.

    Parameters
    ----------
    reaction : array, shape (N, 3)   force of the glenoid on the humeral head, scapula axes [N]
    record : model record: directions and rim of the glenoid, body mass; standard gravity
    """
    angles = (sm.Float(angle) for angle in glenoid_angles(record))
    axes = np.array(glenoid_rotation(*angles), dtype=float)
    # The head presses inwards and against the shear that the glenoid gives it.
    force = reaction @ axes * np.array([1.0, -1.0, -1.0])
    magnitude = np.linalg.norm(reaction, axis=1)
    pressed = force[:, :1] > 0
    path = np.full((len(force), 2), np.nan)
    np.divide(force[:, 1:], force[:, :1], out=path, where=pressed)
    eccentricity = np.hypot(
        path[:, 0] / superior_inferior_limit(record), path[:, 1] / ANTERIOR_POSTERIOR_LIMIT
    )
    return GlenohumeralLoad(
        force=force,
        magnitude=magnitude,
        percent_body_weight=percent_body_weight(magnitude, record.body_mass_kg),
        path=path,
        eccentricity=np.where(pressed[:, 0], eccentricity, np.inf),
    )


def glenoid_angles(record: ModelRecord) -> tuple[float, float]:
    """Inferior inclination and anterior version of the glenoid [rad] from a model record."""
    glenoid = record.constants.glenoid
    angles = glenoid.inferior_inclination_deg, glenoid.anterior_version_deg
    return float(np.deg2rad(angles[0])), float(np.deg2rad(angles[1]))


def superior_inferior_share(record: ModelRecord) -> float:
    """Squared shear along the superior-inferior over the anterior-posterior axis in J_GH [1]."""
    return float(record.constants.glenoid.superior_inferior_factor)


def superior_inferior_limit(record: ModelRecord) -> float:
    """Shear over compression at the upper and lower rim of the glenoid [1]."""
    return float(ANTERIOR_POSTERIOR_LIMIT / np.sqrt(superior_inferior_share(record)))
