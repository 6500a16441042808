"""Muscle-tendon lengths as functions of the coordinates, from OpenSim samples.

Straight paths are exact: their squared length is affine in the entries of rotation matrices.
Wrapping paths are polynomials of the ten polynomial variables (quaternion vector parts and elbow
angle, or Euler angles and elbow angle), selected term by term. Lengths and their derivatives with
respect to small rotations are fitted together, because forces need both.

Letters: P poses, M muscles, V = 10 variables, Fm monomials, F = Fm + 36 features,
B candidate monomials of one muscle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from scapulohumeral.errors import ModelError
from scapulohumeral.model.rotations import Array

BODY_JOINTS = {
    "thorax": (),
    "clavicle_r": ("SC",),
    "scapula_r": ("SC", "AC"),
    "humerus_r": ("SC", "AC", "GH"),
    "ulna_r": ("SC", "AC", "GH", "EL"),
    "radius_r": ("SC", "AC", "GH", "EL"),
}
JOINT_VARIABLES = {"SC": (0, 1, 2), "AC": (3, 4, 5), "GH": (6, 7, 8), "EL": (9,)}
ROTATION_BLOCKS = ("SC", "AC", "TS", "GH")
DEGREE_BY_VARIABLES = {1: 6, 3: 6, 4: 5, 6: 4, 7: 4, 9: 4}


@dataclass(frozen=True, eq=False)
class MuscleGeometry:
    """Lengths and joint-centre derivatives of all muscles, linear in shared features.

    Attributes
    ----------
    names : M muscle names
    exponents : (Fm, V) exponents of the monomials
    length : (M, F) coefficients C; y = C f is the length [m], or its square [m^2] if straight
    translation : (3, M, F) coefficients D; dL/dt_k = D_k f, or D_k f / L if straight; t moves the
        humeral head along scapula axes [m]
    straight : (M,) bool
    """

    names: tuple[str, ...]
    exponents: Array
    length: Array
    translation: Array
    straight: Array


@dataclass(frozen=True)
class FitSettings:
    """How terms are selected.

    Attributes
    ----------
    rmse_change : selection ends when the last ``batch`` terms lowered the RMSE by less than this
        share (the paper's 3 %, stricter than there because it counts ten terms together)
    batch : number of terms that are judged together
    max_terms : largest number of terms per function
    max_condition : terms that would raise the condition number beyond this are left out
    jump_m, jump_spread : a length further than both jump_m and jump_spread times the typical
        (median) misfit from the polynomial lies on another branch of OpenSim's wrapping
    """

    rmse_change: float = 0.03
    batch: int = 10
    max_terms: int = 210
    max_condition: float = 1e7
    jump_m: float = 0.006
    jump_spread: float = 8.0


@dataclass(frozen=True, eq=False)
class FitSamples:
    """Sampled geometry in the variables of one formulation.

    Attributes
    ----------
    variables : (P, V); length : (P, M) [m]
    length_gradient : (P, M, 10) dL/d(rotations behind the speeds) [m/rad]
    rate_map : (P, V, 10) d variables / d(rotations behind the speeds)
    translation : (P, M, 3) dL/d(translation of the humeral head)
    smooth : (P, M) bool, False where OpenSim's wrapping jumps within the difference steps
    """

    variables: Array
    length: Array
    length_gradient: Array
    rate_map: Array
    translation: Array
    smooth: Array


def crossed_joints(muscle: dict) -> tuple[str, ...]:
    """Joints between the bodies that a muscle's path points lie on."""
    chains = [set(BODY_JOINTS[point["body"]]) for point in muscle["points"]]
    crossed = set.union(*chains) - set.intersection(*chains)
    return tuple(joint for joint in JOINT_VARIABLES if joint in crossed)


def candidate_exponents(variables: tuple[int, ...]) -> Array:
    """Exponents (B, V) of all monomials of the given variables up to the degree for their number."""
    degree = DEGREE_BY_VARIABLES[len(variables)]
    rows = [e for e in product(range(degree + 1), repeat=len(variables)) if sum(e) <= degree]
    exponents = np.zeros((len(rows), 10), dtype=int)
    exponents[:, variables] = rows
    return exponents[np.argsort(exponents.sum(axis=1), kind="stable")]


def monomial_values(exponents: Array, variables: Array) -> Array:
    """Monomials, shape (P, B), at variables (P, V)."""
    values = np.ones((len(variables), len(exponents)))
    for column in range(exponents.shape[1]):
        if exponents[:, column].any():
            powers = variables[:, column, None] ** np.arange(exponents[:, column].max() + 1)
            values *= powers[:, exponents[:, column]]
    return values


def monomial_gradients(exponents: Array, variables: Array) -> Array:
    """Derivatives of monomials by variable, shape (P, B, V)."""
    gradient = np.zeros((len(variables), *exponents.shape))
    for column in np.flatnonzero(exponents.any(axis=0)):
        lower = exponents.copy()
        lower[:, column] = np.maximum(lower[:, column] - 1, 0)
        gradient[:, :, column] = monomial_values(lower, variables) * exponents[:, column]
    return gradient


def select_terms(design: Array, target: Array, settings: FitSettings) -> tuple[Array, Array]:
    """Forward selection of columns (orthogonal least squares) on the normal equations.

    Columns are added in the order of the error they remove, until the RMSE hardly changes. The
    first column, the constant, is always used.

    Returns indices of the chosen columns and their coefficients.
    """
    scale = np.sqrt(np.einsum("ij,ij->j", design, design))
    scale[scale == 0] = np.inf
    scaled = design / scale
    gram, right = scaled.T @ scaled, scaled.T @ target
    chosen: list[int] = []
    errors: list[float] = []
    residual_gram, residual_right = gram.copy(), right.copy()
    error = float(target @ target)
    while len(chosen) < min(settings.max_terms, design.shape[1]):
        pivot = np.diagonal(residual_gram).copy()
        usable = pivot > 1.0 / settings.max_condition
        usable[chosen] = False
        gain = np.where(usable, residual_right**2 / np.where(usable, pivot, 1.0), 0.0)
        best = 0 if not chosen else int(np.argmax(gain))
        if not usable[best]:
            break
        error = max(error - gain[best], 0.0)
        errors.append(np.sqrt(error))
        column = residual_gram[:, best] / pivot[best]
        residual_right = residual_right - column * residual_right[best]
        residual_gram = residual_gram - np.outer(column, residual_gram[best])
        chosen.append(best)
        earlier = errors[max(len(errors) - 1 - settings.batch, 0)]
        if len(errors) > settings.batch and errors[-1] > (1 - settings.rmse_change) * earlier:
            break
    index = np.array(chosen, dtype=int)
    coefficients = np.linalg.lstsq(scaled[:, index], target, rcond=None)[0]
    return index, coefficients / scale[index]


def fit_polynomial(
    samples: FitSamples, muscle: int, variables: tuple[int, ...], settings: FitSettings
) -> tuple[Array, Array]:
    """Exponents (n, V) and coefficients (n,) of one muscle's length polynomial.

    OpenSim's wrapping sometimes jumps to another branch (a point inside an ellipsoid, a path on
    the wrong side). Such samples are recognised by :func:`on_one_branch` and left out.
    """
    keep = on_one_branch(samples, muscle, None, settings)
    exponents = candidate_exponents(variables)
    for _ in range(4):
        chosen, coefficients = _fit_terms(samples, keep, muscle, variables, exponents, settings)
        predicted = monomial_values(chosen, samples.variables) @ coefficients
        better = on_one_branch(samples, muscle, predicted, settings)
        if np.array_equal(better, keep):
            break
        keep = better
    return chosen, coefficients


def on_one_branch(
    samples: FitSamples, muscle: int, predicted: Array | None, settings: FitSettings
) -> Array:
    """Poses (P,) whose sampled length belongs to the smooth branch of the muscle's path."""
    keep = samples.smooth[:, muscle].copy()
    if predicted is not None:
        misfit = np.abs(predicted - samples.length[:, muscle])
        limit = max(settings.jump_m, settings.jump_spread * float(np.median(misfit)))
        keep &= misfit < limit
    return keep


def _fit_terms(samples, keep, muscle, variables, exponents, settings) -> tuple[Array, Array]:
    samples = FitSamples(
        samples.variables[keep],
        samples.length[keep],
        samples.length_gradient[keep],
        samples.rate_map[keep],
        samples.translation[keep],
        samples.smooth[keep],
    )
    values = monomial_values(exponents, samples.variables)
    gradients = monomial_gradients(exponents, samples.variables)
    speeds = np.flatnonzero(np.abs(samples.rate_map[:, variables, :]).max(axis=(0, 1)) > 0)
    slopes = np.einsum(
        "pbv,pvk->pkb",
        gradients[:, :, variables],
        samples.rate_map[:, variables][:, :, speeds],
        optimize=True,
    )
    design = np.vstack([values, slopes.reshape(-1, len(exponents))])
    target = np.concatenate(
        [samples.length[:, muscle], samples.length_gradient[:, muscle][:, speeds].ravel()]
    )
    index, coefficients = select_terms(design, target, settings)
    return exponents[index], coefficients


def fit_translation(
    samples: FitSamples,
    keep: Array,
    muscle: int,
    axis: int,
    variables: tuple[int, ...],
    settings: FitSettings,
) -> tuple[Array, Array]:
    """Exponents and coefficients of one component of dL/dt, a direction cosine."""
    target = samples.translation[:, muscle, axis]
    exponents = candidate_exponents(variables)
    design = monomial_values(exponents, samples.variables[keep])
    index, coefficients = select_terms(design, target[keep], settings)
    return exponents[index], coefficients


def straight_coefficients(record: dict, muscle: dict) -> tuple[Array, Array]:
    """Exact rotation-feature coefficients of a two-point straight path.

    Returns
    -------
    constant and feature coefficients of the squared length, shape (1 + 36,) [m^2], and of the
    three components of dL/dt times L, shape (3, 1 + 36) [m]

    The line from origin o to insertion x is d = a + R x - o with R the rotation between their
    bodies and a the joint offsets, so |d|^2 is affine in the rotation matrices in between.
    """
    origin, insertion = muscle["points"]
    order = list(BODY_JOINTS)
    if order.index(origin["body"]) > order.index(insertion["body"]):
        origin, insertion = insertion, origin
    o, x = np.array(origin["location_m"]), np.array(insertion["location_m"])
    r_sc, r_ac, r_gh = (np.array(record["joints"][j]["location_m"]) for j in ("sc1", "ac1", "gh1"))
    squared, arms = np.zeros(37), np.zeros((3, 37))

    def affine(block: str, left: Array, right: Array) -> None:
        """Add 2 left . R_block right to the squared length."""
        start = 1 + 9 * ROTATION_BLOCKS.index(block)
        squared[start : start + 9] += 2 * np.outer(left, right).ravel()

    bodies = (origin["body"], insertion["body"])
    if bodies == ("thorax", "clavicle_r"):
        squared[0] = np.sum((r_sc - o) ** 2) + x @ x
        affine("SC", r_sc - o, x)
    elif bodies == ("thorax", "scapula_r"):
        squared[0] = np.sum((r_sc - o) ** 2) + r_ac @ r_ac + x @ x
        affine("SC", r_sc - o, r_ac)
        affine("TS", r_sc - o, x)
        affine("AC", r_ac, x)
    elif bodies == ("scapula_r", "humerus_r"):
        squared[0] = np.sum((r_gh - o) ** 2) + x @ x
        affine("GH", r_gh - o, x)
        arms[:, 0] = r_gh - o
        start = 1 + 9 * ROTATION_BLOCKS.index("GH")
        for row in range(3):
            arms[row, start + 3 * row : start + 3 * row + 3] = x
    else:
        raise ModelError(
            f"muscle {muscle['name']}: no straight path from {bodies[0]} to {bodies[1]} is known"
        )
    return squared, arms


def fit_geometry(record: dict, samples: FitSamples, settings: FitSettings) -> MuscleGeometry:
    """Geometry of all muscles of a participant's model record."""
    muscles = record["muscles"]
    index: dict[tuple[int, ...], int] = {(0,) * 10: 0}
    terms: list[tuple[int, int, tuple[int, ...], float]] = []
    straight = np.array([not m["wraps"] and len(m["points"]) == 2 for m in muscles])
    for m, muscle in enumerate(muscles):
        if straight[m]:
            continue
        joints = crossed_joints(muscle)
        variables = tuple(v for j in joints for v in JOINT_VARIABLES[j])
        fits = [(-1, fit_polynomial(samples, m, variables, settings))]
        if "GH" in joints:
            predicted = monomial_values(fits[0][1][0], samples.variables) @ fits[0][1][1]
            keep = on_one_branch(samples, m, predicted, settings)
            fits += [
                (axis, fit_translation(samples, keep, m, axis, variables, settings))
                for axis in range(3)
            ]
        for axis, (exponents, coefficients) in fits:
            for row, c in zip(exponents.tolist(), coefficients.tolist(), strict=True):
                index.setdefault(tuple(row), len(index))
                terms.append((m, axis, tuple(row), c))
    size = len(index)
    length = np.zeros((len(muscles), size + 36))
    translation = np.zeros((3, len(muscles), size + 36))
    for m, axis, row, c in terms:
        (length[m] if axis < 0 else translation[axis, m])[index[row]] = c
    for m in np.flatnonzero(straight):
        squared, arms = straight_coefficients(record, muscles[m])
        length[m, 0], length[m, size:] = squared[0], squared[1:]
        translation[:, m, 0], translation[:, m, size:] = arms[:, 0], arms[:, 1:]
    return MuscleGeometry(
        tuple(m["name"] for m in muscles), np.array(list(index)), length, translation, straight
    )


def save_geometry(geometry: MuscleGeometry, path: Path) -> None:
    """Write a geometry as ``.npz``."""
    np.savez_compressed(
        path,
        names=np.array(geometry.names),
        exponents=geometry.exponents,
        length=geometry.length,
        translation=geometry.translation,
        straight=geometry.straight,
    )


def load_geometry(path: Path) -> MuscleGeometry:
    """Read what :func:`save_geometry` wrote."""
    with np.load(path, allow_pickle=False) as data:
        return MuscleGeometry(
            tuple(str(n) for n in data["names"]),
            data["exponents"],
            data["length"],
            data["translation"],
            data["straight"],
        )
