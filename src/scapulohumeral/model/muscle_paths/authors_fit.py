"""Muscle paths sampled and fitted as the authors' MATLAB scripts do it.

Of zoufaond/Quaternion-Predictive-SHR (MIT, 98b9480): create_files.m and noise2data.m draw poses,
das3_polynomials.m fits. Each muscle that wraps or does not begin at the thorax is a cubic
polynomial of its own, whose terms are added until one lowers the error by less than 3 %. Over so
wide a range of poses moment arms of the muscles over the thorax are off by centimetres, and the
optimum of their predictions is that of these paths, not of OpenSim's.

Letters: P poses, F frames, V = 10 variables, B candidate monomials, K variables of a muscle.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from scapulohumeral.model.muscle_paths.authors_thorax import (
    CONTACT_POINTS_M,
    THORAX_CENTRE_M,
    THORAX_RADII_M,
)
from scapulohumeral.model.muscle_paths.fit import (
    FitSamples,
    MuscleFit,
    assemble,
    monomial_values,
)
from scapulohumeral.model.muscle_paths.geometry import (
    BODY_JOINTS,
    JOINT_VARIABLES,
    crossed_joints,
    is_straight,
)
from scapulohumeral.model.muscle_paths.thorax_clearance import chain_frames, level_set
from scapulohumeral.model.record import ModelRecord, MuscleRecord
from scapulohumeral.model.rotations import (
    Array,
    euler_to_quaternion,
    pose_to_trial,
    positive_pose,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_euler,
    segment_orientations,
    trial_to_pose,
)

# create_files.m: frames of the motion, every other of which is a base; draws for each; least and
# largest noise of the joint angles [deg], half of which scapula and elbow get; axial rotations of
# the clavicle under each scapula [deg].
FRAMES, DRAWS = 40, 3
NOISE_DEG = np.array(
    [[-35, -35, 0, -35, -35, -35, -25, -25, -25, -10], [35, 35, 0, 35, 35, 35, 25, 25, 25, 115]]
)
CLAVICLE_ROTATIONS_DEG = np.linspace(-10.0, 50.0, 8)
# noise2data.m: largest glenohumeral elevation [deg], least scalar parts of the quaternions, least
# flexion of the elbow [rad], middle and half width of the distance of both contact points from the
# thorax as a level [1].
LARGEST_ELEVATION_DEG = 140.0
LEAST_SCALARS = {0: 0.8, 4: 0.8, 8: 0.3}
LEAST_FLEXION_RAD = 0.01
DISTANCE = (0.45, 1.2)
# das3_polynomials.m: total degree; change of the error that ends the choice of terms; how many
# median absolute deviations an arm or length may lie above the median.
DEGREE = 3
STOP, STOP_THORAX = 0.03, 0.015
THORAX_MUSCLES = ("serr", "pect")
SPREAD = 4.0
# das3_polynomials.m adds this to the variables that it fits lengths and arms to, against zeros: it
# takes slopes of terms by dividing by variables. Slopes here divide by nothing; it stays because
# the fit is to be theirs.
NOT_ZERO = 1e-6
# Less than this share (squared norm) of a term must be new, or the choice of terms ends with it.
LEAST_NEW = 1e-9


def draw_poses(record: ModelRecord, motion: Array, count: int, rng: np.random.Generator) -> Array:
    """Poses (count, 13) around a composite motion, poses (F, 13), as the authors' noise draws them.

    Every base frame takes the arms of all others, each turned at random, under a scapula turned at
    random. Their scripts draw once, which gives some 2800 poses; here draws go on up to the count.
    """
    frames = np.round(np.linspace(0, len(motion) - 1, FRAMES)).astype(int)[::2]
    base, drawn = pose_to_trial(motion[frames]), np.zeros((0, 13))
    while len(drawn) < count:
        drawn = np.concatenate([drawn, _draw(record, base, rng)])
    return rng.permutation(drawn)[:count]


def _draw(record: ModelRecord, base: Array, rng: np.random.Generator) -> Array:
    """One draw around base frames (F, 10) [rad]."""

    def noise() -> Array:
        return np.deg2rad(rng.uniform(NOISE_DEG[0], NOISE_DEG[1], base.shape))

    poses = []
    for frame in base:
        turned = base.copy()
        turned[:, 6:9] += noise()[:, 6:9]
        humerus = segment_orientations(trial_to_pose(turned))["humerus"]
        poses += [_under_arms(frame + noise() / 2.0, humerus) for _ in range(DRAWS)]
    kept = np.concatenate(poses)
    kept = kept[_is_near_thorax(record, kept) & _is_outside(record, kept)]
    rotated = np.concatenate([_with_clavicle(kept, turn) for turn in CLAVICLE_ROTATIONS_DEG])
    scalars = [rotated[:, column] >= least for column, least in LEAST_SCALARS.items()]
    return rotated[np.all(scalars, axis=0) & (rotated[:, 12] >= LEAST_FLEXION_RAD)]


def _under_arms(angles: Array, humerus: Array) -> Array:
    """Poses of a girdle (F, 10) [rad] under humeri (F, 4) in the thorax."""
    poses = trial_to_pose(angles)
    scapula = segment_orientations(poses)["scapula"]
    poses[:, 8:12] = quaternion_multiply(quaternion_conjugate(scapula), humerus)
    return positive_pose(poses)


def _with_clavicle(poses: Array, rotation_deg: float) -> Array:
    """Poses (P, 13) with another axial rotation of the clavicle under the same scapula."""
    scapula = segment_orientations(poses)["scapula"]
    angles = quaternion_to_euler(poses[:, :4], "YZX")
    angles[:, 2] = np.deg2rad(rotation_deg)
    rotated = poses.copy()
    rotated[:, :4] = euler_to_quaternion(angles, "YZX")
    rotated[:, 4:8] = quaternion_multiply(quaternion_conjugate(rotated[:, :4]), scapula)
    return positive_pose(rotated)


def _is_near_thorax(record: ModelRecord, poses: Array) -> np.ndarray:
    """Whether contact points lie where a scapula may be, and the arm is not raised too far."""
    thorax = np.array(THORAX_CENTRE_M), np.array(THORAX_RADII_M)
    levels = [_levels(record, poses, "scapula_r", p, *thorax) for p in CONTACT_POINTS_M.values()]
    middle, width = DISTANCE
    elevation = pose_to_trial(poses)[:, 7]
    return (np.abs(middle - np.hypot(*levels)) < width) & (
        np.abs(elevation) <= np.deg2rad(LARGEST_ELEVATION_DEG)
    )


def _is_outside(record: ModelRecord, poses: Array) -> np.ndarray:
    """Whether serratus anterior and latissimus dorsi end outside of what they wrap over first."""
    surfaces = {surface.name: surface for surface in record.wrap_objects}
    outside = np.ones(len(poses), dtype=bool)
    for muscle in record.muscles:
        if not muscle.name.startswith(("serr_ant", "lat_dorsi")):
            continue
        surface = surfaces[muscle.wraps[0]]
        end = max(muscle.points, key=lambda point: len(BODY_JOINTS[point.body]))
        centre, radii = np.array(surface.translation_m), np.array(surface.dimensions_m)
        outside &= _levels(record, poses, end.body, end.location_m, centre, radii) >= 0.0
    return outside


def _levels(
    record: ModelRecord, poses: Array, body: str, point: ArrayLike, centre: Array, radii: Array
) -> Array:
    """Level-set values (P,) [1] of an ellipsoid of the thorax at a point of a body: 0 on it.

    Parameters
    ----------
    poses : (P, 13); point : (3,) in the frame of the body [m]
    centre, radii : (3,) of the ellipsoid, along the axes of the thorax [m]
    """
    joints = {name: record.joints[name].location_m for name in ("sc1", "ac1", "gh1")}
    origin, axes = chain_frames(joints, poses)[body]
    return level_set(origin + axes @ np.array(point), centre, radii)


def fit_paths(record: ModelRecord, samples: FitSamples) -> MuscleFit:
    """Geometry of all muscles of a participant's model record in quaternions.

    Parameters
    ----------
    samples : lengths and their gradients at P poses of :func:`draw_poses`
    """
    index: dict[tuple[int, ...], int] = {(0,) * samples.variables.shape[1]: 0}
    exact = np.array([_is_exact(muscle) for muscle in record.muscles])
    terms, left_out = [], np.zeros(len(exact), dtype=int)
    for m in np.flatnonzero(~exact).tolist():
        keep, found = _fit_muscle(record.muscles[m], samples, m)
        columns = np.array([index.setdefault(row, len(index)) for row in found])
        coefficients = np.array(list(found.values()))
        terms.append((np.array([m]), columns, coefficients[:, :1], coefficients[:, None, 1:]))
        left_out[m] = np.count_nonzero(~keep)
    geometry = assemble(record, exact, np.array(list(index)), terms)
    return MuscleFit(geometry, np.ones(len(exact)), left_out)


def _is_exact(muscle: MuscleRecord) -> bool:
    return is_straight(muscle) and muscle.points[0].body == "thorax"


def _fit_muscle(
    muscle: MuscleRecord, samples: FitSamples, m: int
) -> tuple[np.ndarray, dict[tuple[int, ...], Array]]:
    """Poses (P,) that count, and coefficients (4,) of length and pull by exponents of a term."""
    columns = [v for joint in crossed_joints(muscle) for v in JOINT_VARIABLES[joint]]
    # Each variable of a joint has the place of one of its rotations.
    turns = samples.rate_map[:, columns][:, :, columns].transpose(0, 2, 1)
    gradient = samples.length_gradient[:, m, columns]
    arms, length = np.linalg.solve(turns, gradient[..., None])[..., 0], samples.length[:, m]
    keep = samples.smooth[:, m].copy()
    for size in (np.abs(arms).max(axis=1), length):
        middle = np.median(size[keep])
        keep &= size < middle + SPREAD * np.median(np.abs(size[keep] - middle))
    candidates = _candidates(len(columns))
    exponents = np.zeros((len(candidates), samples.variables.shape[1]), dtype=int)
    exponents[:, columns] = candidates
    variables = samples.variables[keep] + NOT_ZERO
    values = monomial_values(exponents, variables)
    largest = np.abs(arms[keep]).max(axis=0)
    weights = largest.max() / largest
    design = [_slopes(exponents, variables, c) * w for c, w in zip(columns, weights, strict=True)]
    targets = [arms[keep, k] * weight for k, weight in enumerate(weights)]
    stop = STOP_THORAX if muscle.name.startswith(THORAX_MUSCLES) else STOP
    chosen = [
        _chosen(np.concatenate([*design, values]), np.concatenate([*targets, length[keep]]), stop)
    ]
    if "GH" in crossed_joints(muscle):
        chosen += [_chosen(values, samples.translation[keep, m, axis], STOP) for axis in range(3)]
    found: dict[tuple[int, ...], Array] = {}
    for place, coefficients in enumerate(chosen):
        for term, coefficient in coefficients.items():
            found.setdefault(tuple(exponents[term].tolist()), np.zeros(4))[place] = coefficient
    return keep, found


def _candidates(variables: int) -> Array:
    """Exponents (B, K) of all monomials up to the degree."""
    powers = product(range(DEGREE + 1), repeat=variables)
    return np.array([exponents for exponents in powers if sum(exponents) <= DEGREE])


def _slopes(exponents: Array, variables: Array, column: int) -> Array:
    """Derivatives (P, B) of monomials by one variable."""
    lower = exponents.copy()
    lower[:, column] = np.maximum(lower[:, column] - 1, 0)
    return monomial_values(lower, variables) * exponents[:, column]


def _chosen(design: Array, target: Array, stop: float) -> dict[int, float]:
    """Coefficients of the chosen among B terms (P, B), each the one that lowers the error most."""
    scale = np.sqrt(np.sum(design**2, axis=0))
    gram, right = design.T @ design / scale / scale[:, None], design.T @ target / scale
    rest, factor = np.ones(len(gram)), np.zeros((len(gram), len(gram)))
    order: list[int] = []
    error = target @ target
    while len(order) < len(gram) - 1:
        usable = rest > LEAST_NEW
        usable[order] = False
        gain = np.where(usable, right**2 / np.where(usable, rest, 1.0), 0.0)
        best = int(np.argmax(gain))
        left = max(error - gain[best], 0.0)
        if order and np.sqrt(left) > (1.0 - stop) * np.sqrt(error):
            break
        known = factor[: len(order)]
        column = (gram[:, best] - known[:, best] @ known) / np.sqrt(rest[best])
        factor[len(order)] = column
        right = right - column * right[best] / np.sqrt(rest[best])
        rest = rest - column**2
        order.append(best)
        error = left
    solution = np.linalg.lstsq(design[:, order], target, rcond=None)[0]
    return dict(zip(order, solution.tolist(), strict=True))
