"""Thorax ellipsoid on which the recorded scapula of a participant slides.

With a generic ellipsoid the contact points of the recorded scapula lie deep inside the thorax and
the contact forces exceed the weight of the arm many times over. Centre and radii are therefore
fitted to the recordings, close to the scaled model's own ellipsoid.

Letters: F recorded frames, C = 2 contact points. Positions are in thorax axes, from its origin.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from scapulohumeral.errors import DataError, ModelError
from scapulohumeral.model.motion import Motion, read_motion
from scapulohumeral.model.muscle_paths.thorax_clearance import level_set, segment_frames
from scapulohumeral.model.participant import participant_of
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.model.rotations import Array, trial_to_pose

PRIOR_SURFACE = "serr_ant"
# Standard deviations of the three kinds of residual [1, m, 1]. The first is the distance from the
# surface that marker error alone causes: 4 mm, times twice the curvature of a radius of 0.16 m.
# The others say how far a thorax of given size differs from the scaled one; they decide only what
# the two contact points leave open.
LEVEL_SD = 0.05
CENTRE_SD_M = 0.03
LOG_RADIUS_SD = 0.15
# No thorax differs from the scaled one by more: share of each radius.
LARGEST_RADIUS_CHANGE = 0.3


def fit_participant_thorax(model: Path, participant: Path, thorax: Path) -> None:
    """As :func:`fit_thorax`, to the elevations of a participant.yaml, smoothed as it says.

    Raises
    ------
    ConfigError                      if participant.yaml is wrong
    """
    _fit(model, participant_of(participant).elevations, thorax)


def fit_thorax(model: Path, recordings: Sequence[Path], thorax: Path) -> None:
    """Fit the ellipsoid of a participant and write it as JSON, schema "thorax/1".

    Parameters
    ----------
    model : Path                     model record, "model/1"
    recordings : paths               arm elevations of the participant, taken as they are
    thorax : Path                    file to write: centre and radii [m] along thorax axes, the
                                     remaining level-set values [1], and the prior

    Raises
    ------
    ModelError                       if the model has no ellipsoid to start from
    DataError                        if a recording cannot be read or the fit does not converge
    """
    _fit(model, [read_motion(path) for path in recordings], thorax)


def _fit(model: Path, motions: Sequence[Motion], thorax: Path) -> None:
    record = read_record(model)
    prior = prior_ellipsoid(record)
    poses = np.concatenate([trial_to_pose(motion.angles_rad) for motion in motions])
    points = contact_points(record, poses)
    inside_factor = record.constants.scapulothoracic_contact.inside_factor
    centre, radii = fit_ellipsoid(points.reshape(-1, 3), *prior, inside_factor)
    level = level_set(points, centre, radii)
    document = {
        "schema": "thorax/1",
        "participant": record.participant,
        "centre_m": centre.tolist(),
        "radii_m": radii.tolist(),
        "level_mean": float(level.mean()),
        "level_sd": float(level.std()),
        "level_min": float(level.min()),
        "level_max": float(level.max()),
        "prior": {
            "surface": PRIOR_SURFACE,
            "centre_m": prior[0].tolist(),
            "radii_m": prior[1].tolist(),
            "level_mean": float(level_set(points, *prior).mean()),
            "level_sd": LEVEL_SD,
            "inside_factor": inside_factor,
            "centre_sd_m": CENTRE_SD_M,
            "log_radius_sd": LOG_RADIUS_SD,
        },
    }
    thorax.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def prior_ellipsoid(record: ModelRecord) -> tuple[Array, Array]:
    """Centre (3,) and radii (3,) [m] of the ellipsoid over which serratus anterior wraps.

    As scaled: what is flattened for the paths of muscles is no measure of the thorax.

    Raises
    ------
    ModelError                       the model has no such surface
    """
    for surface in record.wrap_objects:
        if surface.name == PRIOR_SURFACE:
            return np.array(surface.translation_m), np.array(surface.scaled_dimensions_m)
    raise ModelError(
        f"model of {record.participant}: no wrapping surface {PRIOR_SURFACE!r}, which the fit "
        "of the thorax starts from. Add it to wrap_objects.csv."
    )


def contact_points(record: ModelRecord, poses: Array) -> Array:
    """Positions of the scapulothoracic contact points, shape (F, C, 3) [m], at poses (F, 13)."""
    origin, matrix = segment_frames(record, poses)["scapula_r"]
    names = record.constants.scapulothoracic_contact.points
    local = np.array([record.markers[name].location_m for name in names])
    return origin[:, None] + np.einsum("fij,cj->fci", matrix, local)


def fit_ellipsoid(
    points: Array, centre: Array, radii: Array, inside_factor: float
) -> tuple[Array, Array]:
    """Centre and radii [m] of the ellipsoid on which points (F, 3) lie best, near a prior one.

    Least squares of the level-set values (their mean square counts, so that the prior has the same
    weight for every number of frames), of the shift of the centre and of the logarithms of the
    radii, each over its standard deviation. Points inside count ``inside_factor`` times.

    Raises
    ------
    DataError                        if the fit does not converge
    """
    weight = 1.0 / (LEVEL_SD * np.sqrt(len(points)))

    def residuals(x: Array) -> Array:
        level = level_set(points, centre + x[:3], radii * np.exp(x[3:]))
        level = np.where(level < 0, inside_factor, 1.0) * level
        return np.concatenate([weight * level, x[:3] / CENTRE_SD_M, x[3:] / LOG_RADIUS_SD])

    lower, upper = np.log1p(-LARGEST_RADIUS_CHANGE), np.log1p(LARGEST_RADIUS_CHANGE)
    bounds = ([-np.inf] * 3 + [lower] * 3, [np.inf] * 3 + [upper] * 3)
    result = least_squares(residuals, np.zeros(6), bounds=bounds, x_scale="jac")
    if not result.success:
        raise DataError(
            f"thorax ellipsoid: the fit to {len(points)} points ended with {result.message!r}; "
            "expected convergence. Check the scapula angles of the recordings."
        )
    return centre + result.x[:3], radii * np.exp(result.x[3:])
