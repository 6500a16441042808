"""Polynomials for the lengths of wrapping muscles, fitted to OpenSim samples.

Muscles that cross the same joints are fitted together: terms are selected for all of them at once,
so they share monomials, which the solver pays for, and each muscle takes as many of the first
terms as it needs. Lengths and moment arms are fitted together, each in units of its target.

Muscles from thorax to scapula become a fifth as long when the arm rises. Where a path is short its
length bends sharply while its square stays smooth: for these muscles the square is the polynomial.

Letters: P poses, M muscles, V = 10 variables, B candidate monomials, G muscles of a group,
K rotations that they span, n selected terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.linalg import solve, solve_triangular

from scapulohumeral.errors import ConfigError, ModelError
from scapulohumeral.model.muscle_paths.geometry import (
    JOINT_VARIABLES,
    ROTATION_FEATURES,
    MuscleGeometry,
    crossed_joints,
    is_straight,
    straight_coefficients,
)
from scapulohumeral.model.record import ModelRecord, MuscleRecord
from scapulohumeral.model.rotations import Array

DEGREE_BY_VARIABLES = {1: 6, 3: 6, 4: 5, 6: 6, 7: 4, 9: 5, 10: 3}
# Muscles that cross exactly these joints are fitted by their squared length.
SQUARED_JOINTS = ("SC", "AC")
# Terms of a pull per pose that it is fitted to. Unlike lengths, pulls have no derivatives beside
# them: with as many terms as poses a fit runs through all of them. A seventh of 308 poses of one
# arm was left out: pulls of 12 muscles were off by 0.017 with 0.65 to 1.0, 0.015 with 0.2 to 0.5.
MOST_TERMS = 0.75
# Leaving out jumps and fitting again settles after two or three rounds.
MAX_ROUNDS = 5


@dataclass(frozen=True)
class FitSettings:
    """When terms are enough, and which samples are left out.

    Attributes
    ----------
    length_target_m, arm_target_m : selection ends for a muscle when the misfits of its lengths and
        moment arms, each over its target, have a mean square below one
    direction_target : the same for dL/dt of the humeral head, a direction cosine [1]
    rmse_change : selection ends for all when the last ``batch`` terms lowered the RMSE by less than
        this share (the paper's 3 %, stricter than there because it counts ten terms together)
    batch : number of terms that are judged together
    max_terms : largest number of terms of a group
    max_condition : terms of which less than 1/max_condition (squared norm) is new are left out
    jump_m, jump_spread : a length further than both jump_m and jump_spread times the typical
        (median) misfit from the polynomial lies on another branch of OpenSim's wrapping
    """

    length_target_m: float = 2e-4
    arm_target_m: float = 1e-3
    direction_target: float = 0.01
    rmse_change: float = 0.01
    batch: int = 10
    max_terms: int = 320
    max_condition: float = 1e7
    jump_m: float = 0.003
    jump_spread: float = 8.0

    def __post_init__(self) -> None:
        """Refuse values with which no selection could end."""
        for name in ("length_target_m", "arm_target_m", "direction_target", "rmse_change"):
            value = getattr(self, name)
            if value <= 0.0:
                raise ConfigError(f"geometry fit: {name} is {value}; expected a positive number.")


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
    smooth: np.ndarray


@dataclass(frozen=True, eq=False)
class Selection:
    """Selected terms of a group: ``order`` (n,) indices of candidates, ``counts`` (G,) how many of
    the first terms each muscle takes, ``coefficients`` (n, G), zero beyond these, and the
    ``condition`` number [1] of the scaled terms."""

    order: Array
    counts: Array
    coefficients: Array
    condition: float


@dataclass(frozen=True, eq=False)
class MuscleFit:
    """Geometry of all muscles and how it was reached.

    Attributes
    ----------
    geometry : MuscleGeometry
    condition : (M,) condition number [1] of the terms of each muscle's group; 1 if straight
    left_out : (M,) number of poses left out because some muscle of the group jumps there
    """

    geometry: MuscleGeometry
    condition: Array
    left_out: Array


def candidate_exponents(variables: Sequence[int]) -> Array:
    """Exponents (B, V) of all monomials of the given variables, constant first.

    The largest total degree depends on the number of variables (DEGREE_BY_VARIABLES).
    """
    degree = DEGREE_BY_VARIABLES[len(variables)]
    rows = [_of_degree(len(variables), d) for d in range(degree + 1)]
    exponents = np.zeros((sum(map(len, rows)), 10), dtype=int)
    exponents[:, list(variables)] = np.concatenate(rows)
    return exponents


@cache
def _of_degree(variables: int, degree: int) -> Array:
    """Exponents (B, variables) of all monomials of one degree, powers of the first rising."""
    if variables == 1:
        return np.array([[degree]])
    rest = [_of_degree(variables - 1, degree - first) for first in range(degree + 1)]
    firsts = np.repeat(np.arange(degree + 1), [len(rows) for rows in rest])
    return np.column_stack([firsts, np.concatenate(rest)])


def monomial_values(exponents: Array, variables: Array) -> Array:
    """Monomials, shape (P, B), at variables (P, V)."""
    values = np.ones((len(variables), len(exponents)))
    for column in np.flatnonzero(exponents.any(axis=0)):
        powers = variables[:, column, None] ** np.arange(exponents[:, column].max() + 1)
        values *= powers[:, exponents[:, column]]
    return values


def monomial_slopes(exponents: Array, samples: FitSamples) -> Array:
    """Derivatives of monomials by the rotations that move them, shape (K, P, B)."""
    used = np.flatnonzero(exponents.any(axis=0))
    rotations = np.flatnonzero(np.abs(samples.rate_map[:, used]).max(axis=(0, 1)) > 0)
    slopes = np.zeros((len(rotations), len(samples.variables), len(exponents)))
    for column in used:
        lower = exponents.copy()
        lower[:, column] = np.maximum(lower[:, column] - 1, 0)
        derivative = monomial_values(lower, samples.variables) * exponents[:, column]
        for slope, rotation in zip(slopes, rotations, strict=True):
            rate = samples.rate_map[:, column, rotation]
            if rate.any():
                slope += derivative * rate[:, None]
    return slopes


def select_terms(gram: Array, right: Array, error: Array, settings: FitSettings) -> Selection:
    """Forward selection of terms for several targets at once (simultaneous orthogonal matching).

    The term that lowers the summed squared error of the unfinished targets most is added, until
    all errors are at most one or hardly change (Tropp, Gilbert, Strauss 2006, Signal Processing
    86:572). The first candidate, the constant, is always used.

    Parameters
    ----------
    gram : array, shape (B, B)       products of the candidates
    right : array, shape (B, G)      products of candidates and targets
    error : array, shape (G,)        squared norms of the targets; one is good enough
    settings : FitSettings
    """
    scale = np.sqrt(np.diagonal(gram)) + np.finfo(float).tiny
    gram, right = gram / scale / scale[:, None], right / scale[:, None]
    rest, rest_right = np.diagonal(gram).copy(), right.copy()
    # Columns of the Cholesky factor of the selected terms: what of each candidate they contain.
    factor = np.zeros((min(settings.max_terms, len(gram)), len(gram)))
    order: list[int] = []
    counts = np.zeros(len(error), dtype=int)
    history = [error]
    while len(order) < len(factor) and _worth_going_on(history, settings):
        open_targets = history[-1] > 1.0
        usable = rest > 1.0 / settings.max_condition
        usable[order] = False
        gain = np.sum(rest_right[:, open_targets] ** 2, axis=1) / np.where(usable, rest, np.inf)
        best = int(np.argmax(gain)) if order else 0
        if not usable[best]:
            break
        known = factor[: len(order)]
        column = (gram[:, best] - known[:, best] @ known) / np.sqrt(rest[best])
        row = rest_right[best] / np.sqrt(rest[best])
        history.append(np.maximum(history[-1] - row**2, 0.0))
        factor[len(order)] = column
        rest_right -= np.outer(column, row)
        rest -= column**2
        order.append(best)
        counts[open_targets] = len(order)
    return _solve_selected(gram, right, scale, np.array(order), counts)


def _worth_going_on(history: list[Array], settings: FitSettings) -> bool:
    unfinished = history[-1] > 1.0
    if not unfinished.any():
        return False
    if len(history) <= settings.batch:
        return True
    earlier = np.sqrt(history[-1 - settings.batch][unfinished].sum())
    return bool(np.sqrt(history[-1][unfinished].sum()) < (1.0 - settings.rmse_change) * earlier)


def _solve_selected(gram, right, scale, order: Array, counts: Array) -> Selection:
    coefficients = np.zeros((len(order), right.shape[1]))
    for target, count in enumerate(counts):
        used = order[:count]
        solution = solve(gram[np.ix_(used, used)], right[used, target], assume_a="pos")
        coefficients[:count, target] = solution / scale[used]
    condition = float(np.sqrt(np.linalg.cond(gram[np.ix_(order, order)])))
    return Selection(order, counts, coefficients, condition)


@dataclass(frozen=True, eq=False)
class _Group:
    """Muscles that cross the same joints, with their candidates at all poses."""

    exponents: Array
    values: Array
    slopes: Array
    length: Array
    arms: Array
    smooth: np.ndarray
    squared: bool

    def targets(self) -> tuple[Array, Array, Array]:
        """What the terms are fitted to (P, G), its derivatives (K, P, G), weights of poses (P,).

        An error of dy in a squared length is one of dy/2L in the length; L is here the geometric
        mean over the group, so that all muscles share one set of normal equations.
        """
        if not self.squared:
            return self.length, self.arms, np.ones(len(self.length))
        weight = 0.5 * np.exp(-np.log(self.length).mean(axis=1))
        return self.length**2, 2.0 * self.length * self.arms, weight

    def predicted(self, selection: Selection) -> Array:
        """Lengths (P, G) [m] at all poses."""
        y = self.values[:, selection.order] @ selection.coefficients
        return np.sqrt(np.maximum(y, 0.0)) if self.squared else y

    def normal_equations(
        self, keep: np.ndarray, settings: FitSettings
    ) -> tuple[Array, Array, Array]:
        """Products of candidates and targets over the kept poses, in units of the targets.

        Each block of rows, lengths and one rotation after the other, adds to the sums; they are
        divided by the number of rows, so that an error of one means: on target.
        """
        y, slopes, weight = self.targets()
        blocks = [(self.values, y, settings.length_target_m)]
        blocks += [(s, a, settings.arm_target_m) for s, a in zip(self.slopes, slopes, strict=True)]
        size, targets = self.values.shape[1], y.shape[1]
        gram, right, error = np.zeros((size, size)), np.zeros((size, targets)), np.zeros(targets)
        rows = len(blocks) * np.count_nonzero(keep)
        for design, target, unit in blocks:
            scale = unit / weight[keep, None]
            design, target = design[keep] / scale, target[keep] / scale
            gram += design.T @ design / rows
            right += design.T @ target / rows
            error += np.sum(target**2, axis=0) / rows
        return gram, right, error


def _on_one_branch(length: Array, predicted: Array, settings: FitSettings) -> np.ndarray:
    """Which lengths (P, G) lie on the smooth branch of their path that is predicted, (P, G) bool.

    OpenSim's wrapping sometimes jumps to another branch: a point inside an ellipsoid, a path on
    the wrong side.
    """
    misfit = np.abs(predicted - length)
    limit = np.maximum(settings.jump_m, settings.jump_spread * np.median(misfit, axis=0))
    return misfit < limit


def _fit_lengths(group: _Group, settings: FitSettings) -> tuple[Selection, np.ndarray]:
    """Terms and coefficients of the lengths of a group, and the poses (P,) they are fitted to.

    A pose is left out for all muscles of the group if one of them jumps there, so that all share
    one set of normal equations.
    """
    keep = np.all(group.smooth, axis=1)
    for _ in range(MAX_ROUNDS):
        if np.count_nonzero(keep) < len(keep) // 2:
            raise ModelError(
                f"muscle paths jump in {np.count_nonzero(~keep)} of {len(keep)} sampled poses; "
                "expected less than half. Choose a smaller margin or a larger clearance."
            )
        selection = select_terms(*group.normal_equations(keep, settings), settings)
        one_branch = _on_one_branch(group.length, group.predicted(selection), settings)
        better = np.all(group.smooth & one_branch, axis=1)
        if np.array_equal(better, keep):
            break
        keep = better
    return selection, keep


def fit_directions(values: Array, target: Array, settings: FitSettings) -> Array:
    """Coefficients (n, T) of T functions (P, T) in terms whose order is given, values (P, n).

    Each takes as many of the first terms as it needs to reach ``direction_target``: with
    orthogonalised terms the remaining error is known for every number of terms. Terms beyond
    :data:`MOST_TERMS` of the poses are left at zero.
    """
    most = min(values.shape[1], int(MOST_TERMS * len(values)))
    q, r = np.linalg.qr(values[:, :most])
    projections = q.T @ target
    squares = np.sum(target**2, axis=0) - np.cumsum(projections**2, axis=0)
    reached = squares <= len(values) * settings.direction_target**2
    counts = np.where(reached.any(axis=0), np.argmax(reached, axis=0) + 1, most)
    coefficients = np.zeros((values.shape[1], target.shape[1]))
    for column, count in enumerate(counts):
        coefficients[:count, column] = solve_triangular(
            r[:count, :count], projections[:count, column]
        )
    return coefficients


def fit_geometry(record: ModelRecord, samples: FitSamples, settings: FitSettings) -> MuscleFit:
    """Geometry of all muscles of a participant's model record, "model/1"."""
    muscles = record.muscles
    straight = np.array([is_straight(muscle) for muscle in muscles])
    index: dict[tuple[int, ...], int] = {(0,) * 10: 0}
    terms: list[tuple[Array, Array, Array, Array]] = []
    condition, left_out = np.ones(len(muscles)), np.zeros(len(muscles), dtype=int)
    squared = straight.copy()
    for joints, members in _groups(muscles, straight).items():
        group = _make_group(samples, joints, members)
        selection, keep = _fit_lengths(group, settings)
        values = group.values[keep][:, selection.order]
        directions = np.zeros((values.shape[1], len(members), 3))
        if "GH" in joints:
            target = samples.translation[keep][:, members].reshape(len(values), -1)
            directions[:] = fit_directions(values, target, settings).reshape(directions.shape)
        rows = [tuple(row) for row in group.exponents[selection.order].tolist()]
        columns = np.array([index.setdefault(row, len(index)) for row in rows])
        terms.append((members, columns, selection.coefficients, directions))
        condition[members], left_out[members] = selection.condition, np.count_nonzero(~keep)
        squared[members] = group.squared
    geometry = assemble(record, squared, np.array(list(index)), terms)
    return MuscleFit(geometry, condition, left_out)


def _groups(muscles: Sequence[MuscleRecord], straight: np.ndarray) -> dict[tuple[str, ...], Array]:
    """Indices of the muscles to fit, by the joints that they cross."""
    groups: dict[tuple[str, ...], list[int]] = {}
    for m in np.flatnonzero(~straight).tolist():
        groups.setdefault(crossed_joints(muscles[m]), []).append(m)
    return {joints: np.array(members) for joints, members in groups.items()}


def _make_group(samples: FitSamples, joints: tuple[str, ...], members: Array) -> _Group:
    variables = [v for joint in joints for v in JOINT_VARIABLES[joint]]
    exponents = candidate_exponents(variables)
    moved = np.flatnonzero(np.abs(samples.rate_map[:, variables]).max(axis=(0, 1)) > 0)
    return _Group(
        exponents=exponents,
        values=monomial_values(exponents, samples.variables),
        slopes=monomial_slopes(exponents, samples),
        length=samples.length[:, members],
        arms=np.moveaxis(samples.length_gradient[:, members][:, :, moved], 2, 0),
        smooth=samples.smooth[:, members],
        squared=joints == SQUARED_JOINTS,
    )


def assemble(
    record: ModelRecord,
    squared: np.ndarray,
    exponents: np.ndarray,
    terms: Sequence[tuple[np.ndarray, ...]],
) -> MuscleGeometry:
    """Geometry of fitted muscles and exact ones.

    Parameters
    ----------
    squared : (M,) whether the square of a length is the polynomial
    exponents : (Fm, V) of all monomials
    terms : of each group its members (G,), their monomials (n,), coefficients of lengths (n, G) and
        of pulls (n, G, 3); who is in no group is exact
    """
    muscles, size = record.muscles, len(exponents)
    length = np.zeros((len(muscles), size + ROTATION_FEATURES))
    translation = np.zeros((3, *length.shape))
    for members, columns, coefficients, directions in terms:
        length[np.ix_(members, columns)] = coefficients.T
        translation[np.ix_(np.arange(3), members, columns)] = directions.transpose(2, 1, 0)
    fitted = {m for members, *_ in terms for m in members.tolist()}
    for m in (m for m in range(len(muscles)) if m not in fitted):
        square, arms = straight_coefficients(record, muscles[m])
        length[m, 0], length[m, size:] = square[0], square[1:]
        translation[:, m, 0], translation[:, m, size:] = arms[:, 0], arms[:, 1:]
    return MuscleGeometry(record.muscle_names, exponents, length, translation, squared)
