"""Centre of the glenohumeral joint, which carries no marker: regression, model, or fit of a sphere.

Letters: T frames. Positions are in metres.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.markers.frames import Points, axes_matrix, unit
from scapulohumeral.model.rotations import Array
from scapulohumeral.model.tables import ModelTables

# Coefficients of Meskers et al. 1998 (J Biomech 31:93) for millimetres in scapula axes with the
# origin in AC: x along TS to AC, z normal to AC, TS and AI, to the back; as used since then.
MESKERS_X = (18.9743, 0.2434, 0.2341, 0.1590, 0.0558)
MESKERS_Y = (-3.8791, -0.1002, 0.1732, -0.3940, 0.1205)
MESKERS_Z = (9.2629, -0.2403, 1.0255, 0.1720)
# Arm motion that fixes a centre: standard deviation of the direction cosines of the markers in
# the direction in which they spread least. Elevations to 90 deg in three planes with circles have
# 0.10, to 120 deg 0.14; about one axis alone there is none, and the centre may lie anywhere along
# it. Skin that slides by 5 mm as the arm rises moves a centre of the latter by 4 mm.
LEAST_SPREAD = 0.08
# Largest root mean square distance of the markers from their spheres: skin moves by a centimetre.
LARGEST_RESIDUAL_M = 0.015


@dataclass(frozen=True, eq=False)
class Centre:
    """A fitted centre (3,) in scapula axes from AA, and how well it fits."""

    position_m: Array
    residual_m: float


def meskers_centre(points: Points) -> Array:
    """Centre by the regression of Meskers et al. 1998, (T, 3), from AC, AA, TS, AI and PC.

    Its scapula axes differ from those of the ISB: the acromioclavicular joint is their origin.
    """
    ac, aa, ts, ai, pc = (1e3 * points[name] for name in ("AC", "AA", "TS", "AI", "PC"))
    x = unit(ac - ts)
    z = unit(np.cross(x, ac - ai))
    axes = axes_matrix(x, np.cross(z, x))
    pc_local, ai_local = (np.einsum("tji,tj->ti", axes, p - ac) for p in (pc, ai))

    def length(a: Array, b: Array) -> Array:
        return np.linalg.norm(a - b, axis=1)

    one = np.ones(len(ac))
    columns_x = [one, pc_local[:, 0], ai_local[:, 0], length(ai, aa), pc_local[:, 1]]
    columns_y = [one, length(ac, pc), pc_local[:, 1], length(ac, aa), ai_local[:, 0]]
    columns_z = [one, pc_local[:, 1], pc_local[:, 2], length(ts, pc)]
    rules = ((MESKERS_X, columns_x), (MESKERS_Y, columns_y), (MESKERS_Z, columns_z))
    local = np.stack([np.array(rule) @ np.array(columns) for rule, columns in rules], axis=1)
    return 1e-3 * (ac + np.einsum("tij,tj->ti", axes, local))


def model_centre(tables: ModelTables, points: Points, scapula: Array) -> Array:
    """Centre of the model's scapula, scaled to the length from TS to AA, (T, 3).

    Parameters
    ----------
    tables : markers AA, TS and joint gh1
    points : landmarks AA, TS
    scapula : array, shape (T, 3, 3)
    """
    aa, ts = (np.array(tables.markers[name].location_m) for name in ("AA", "TS"))
    length = np.median(np.linalg.norm(points["AA"] - points["TS"], axis=1))
    offset = (np.array(tables.joints["gh1"].location_m) - aa) * length / np.linalg.norm(aa - ts)
    return points["AA"] + scapula @ offset


def fit_centre(source: str, markers: Sequence[Array], names: Sequence[str]) -> Centre:
    """Common centre of the spheres on which markers of the upper arm move about the scapula.

    Parameters
    ----------
    source : str                     recording, named in errors
    markers : arrays of shape (T, 3), positions in scapula axes from AA
    names : of the markers

    Returns
    -------
    Centre                           least squares of the distances to the spheres

    Raises
    ------
    DataError                        the arm hardly moves, or the markers do not stay on spheres
    """

    def distances(centre: Array) -> list[Array]:
        return [np.linalg.norm(marker - centre, axis=1) for marker in markers]

    def residuals(centre: Array) -> Array:
        return np.concatenate([d - d.mean() for d in distances(centre)])

    fit = least_squares(residuals, _linear_start(markers))
    spread = float(np.linalg.svd(np.asarray(fit.jac), compute_uv=False)[-1] / np.sqrt(len(fit.fun)))
    if spread < LEAST_SPREAD:
        raise DataError(
            f"{source}: the arm moves too little for a centre: {', '.join(names)} spread by "
            f"{spread:.2f} of their distance in one direction; expected {LEAST_SPREAD}. Record "
            "elevations in two planes and circles, or choose another glenohumeral.method."
        )
    residual = float(np.sqrt(np.mean(fit.fun**2)))
    if residual > LARGEST_RESIDUAL_M:
        raise DataError(
            f"{source}: markers {', '.join(names)} leave their spheres by {1e3 * residual:.1f} mm "
            f"RMS; expected at most {1e3 * LARGEST_RESIDUAL_M:.0f} mm. Look for swapped markers."
        )
    return Centre(fit.x, residual)


def _linear_start(markers: Sequence[Array]) -> Array:
    """Centre by linear least squares of |p|^2 = 2 c p + constant, of all markers together."""
    rows = np.concatenate([2.0 * (marker - marker.mean(axis=0)) for marker in markers])
    squares = [np.sum(marker**2, axis=1) for marker in markers]
    right = np.concatenate([square - square.mean() for square in squares])
    return np.linalg.lstsq(rows, right, rcond=None)[0]
