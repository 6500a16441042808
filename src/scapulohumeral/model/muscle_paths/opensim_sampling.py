"""Muscle geometry and joint torques from OpenSim, at poses given by quaternions or joint angles.

Letters: P poses, M muscle elements. A pose has the thirteen numbers of ``rotations``: SC, AC and GH
quaternions (scalar first, ``v_parent = R(q) v_child``) and the elbow angle [rad].
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence

import numpy as np
import opensim

from scapulohumeral.errors import ModelError
from scapulohumeral.model.muscle_paths.body_chain import CHAIN_POSITION
from scapulohumeral.model.muscle_paths.thorax_clearance import chain_frames
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    Array,
    pose_to_trial,
    quaternion_multiply,
    rotation_vector_to_quaternion,
)

# Steps of the central differences, chosen so that truncation (below 1e-5 of the values) and the
# tolerance of OpenSim's iterative ellipsoid wrapping both stay invisible.
ROTATION_STEP_RAD = 1e-3
TRANSLATION_STEP_M = 2e-4
# Over such steps second differences are below 8e-6 m in 99.9 % of all cases. Beyond that the
# wrapping changed its mind and the length jumped, by up to centimetres.
JUMP_M = 1e-5
# A path under unit tension pulls at the humeral head with unit force, never more.
LARGEST_UNIT_FORCE = 1.02
# No muscle passes the elbow at this distance; in one of a thousand poses the wrapping answers the
# two steps of a difference with two paths, and the biceps seems to have an arm of 0.24 m.
LARGEST_ELBOW_ARM_M = 0.12
GH_JOINT = "gh1"
# Joints of the girdle, and the segments that they turn.
GIRDLE_JOINTS = {"SC": "clavicle_r", "AC": "scapula_r"}
JOINT_COLUMNS = {"SC": slice(0, 3), "AC": slice(3, 6), "GH": slice(6, 9), "EL": slice(9, 10)}


class _Sampler:
    """A model with a state and handles, fetched once because fetching costs more than a length."""

    def __init__(
        self, model: opensim.Model, muscles: Sequence[str], angles: Sequence[str] = ANGLE_NAMES
    ) -> None:
        self.model = model
        self.state = model.initSystem()
        coordinates = model.updCoordinateSet()
        self.coordinates = [coordinates.get(name) for name in angles]
        owners = [model.updMuscles().get(name) for name in muscles]
        self.paths = [opensim.GeometryPath.safeDownCast(owner.updPath()) for owner in owners]

    def set(self, angles: Sequence[float], columns: slice = slice(None)) -> None:
        state = self.state
        for coordinate, angle in zip(self.coordinates[columns], angles, strict=True):
            coordinate.setValue(state, angle, False)
        self.model.realizePosition(state)

    def lengths(self, muscles: Sequence[int]) -> list[float]:
        state, paths = self.state, self.paths
        return [paths[i].getLength(state) for i in muscles]


def muscle_names(model: opensim.Model) -> tuple[str, ...]:
    """Names of all muscle elements of a model, in its order."""
    muscles = model.getMuscles()
    return tuple(muscles.get(i).getName() for i in range(muscles.getSize()))


def muscle_lengths(
    model: opensim.Model,
    angles: Array,
    muscles: Sequence[str] | None = None,
    coordinates: Sequence[str] = ANGLE_NAMES,
) -> Array:
    """Muscle-tendon lengths at joint angles.

    Parameters
    ----------
    model : opensim.Model
    angles : array, shape (P, N)     [rad]
    muscles : names, default all
    coordinates : names of the N coordinates, default the ten of ``rotations.ANGLE_NAMES``; others
        stay at their defaults

    Returns
    -------
    array, shape (P, M)              [m]
    """
    names = muscle_names(model) if muscles is None else muscles
    sampler = _Sampler(model, names, coordinates)
    everything = range(len(sampler.paths))
    result = np.empty((len(angles), len(sampler.paths)))
    for row, pose in zip(result, np.asarray(angles, float).tolist(), strict=True):
        sampler.set(pose)
        row[:] = sampler.lengths(everything)
    return result


def sample_geometry(
    model: opensim.Model, poses: Array, muscles: Sequence[str] | None = None
) -> dict[str, Array]:
    """Lengths of the muscle elements, and how they change with each joint and with the GH centre.

    Parameters
    ----------
    model : opensim.Model
    poses : array, shape (P, 13)
    muscles : names, default all

    Returns
    -------
    dict
        q : (P, 13)                    the poses
        length_m : (P, M)
        rotation_gradient_m : (P, M, 10)
            change per small rotation [m/rad] about the child's axes, SC xyz, AC xyz, GH xyz
            (R <- R exp(delta)), then per elbow angle; minus the moment arm
        gh_translation : (P, M, 3)     change per translation of the humeral head centre along the
                                       scapula axes; exactly zero if the muscle does not cross GH
        smooth : (P, M) bool           no jump of the wrapping within the steps; where False, the
                                       numbers above are no property of the muscle: leave them out
    """
    poses = np.asarray(poses, float)
    names = muscle_names(model) if muscles is None else tuple(muscles)
    sampler = _Sampler(model, names)
    crossing = crossing_muscles(sampler)
    past = muscles_past_girdle(sampler)
    girdle = {joint: [m for m in crossing[joint] if m not in past] for joint in GIRDLE_JOINTS}
    length, gradient, jump = _rotational(sampler, poses, {**crossing, **girdle})
    translation, gh_jump = _translational(model, names, poses, length, crossing["GH"])
    gradient[:, past, :6] = _girdle_arms(
        model, poses, gradient[:, past, JOINT_COLUMNS["GH"]], translation[:, past]
    )
    force = np.linalg.norm(translation, axis=2)
    smooth = (np.maximum(jump, gh_jump) < JUMP_M) & (force < LARGEST_UNIT_FORCE)
    smooth &= np.abs(gradient[:, :, JOINT_COLUMNS["EL"]]).max(axis=2) < LARGEST_ELBOW_ARM_M
    return {
        "q": poses,
        "length_m": length,
        "rotation_gradient_m": gradient,
        "gh_translation": translation,
        "smooth": smooth,
    }


def crossing_muscles(sampler: _Sampler) -> dict[str, list[int]]:
    """Which muscles span each joint with their path points and wrapping surfaces."""
    spans = [sorted(set(_chain_positions(path))) for path in sampler.paths]
    return {
        joint: [m for m, span in enumerate(spans) if span[0] <= k < span[-1]]
        for k, joint in enumerate(JOINT_COLUMNS)
    }


def muscles_past_girdle(sampler: _Sampler) -> list[int]:
    """Muscles from the thorax to the arm that touch neither clavicle nor scapula.

    Their lengths depend only on where the humerus is in the thorax. How they change with the girdle
    follows from how they change with GH: these muscles wrap over ellipsoids and cost the most.
    """
    spans = [set(_chain_positions(path)) for path in sampler.paths]
    girdle = {CHAIN_POSITION["clavicle_r"], CHAIN_POSITION["scapula_r"]}
    arm = CHAIN_POSITION["humerus_r"]
    return [m for m, s in enumerate(spans) if 0 in s and max(s) >= arm and not s & girdle]


def _girdle_arms(model: opensim.Model, poses: Array, gh_arms: Array, translation: Array) -> Array:
    """Length changes (P, m, 6) [m/rad] per rotation of SC and AC of muscles that pass the girdle.

    A turn of the girdle by e turns the humerus by e and moves its head by e x r, where r is the way
    from the joint to the humeral head.

    Parameters
    ----------
    gh_arms : array, shape (P, m, 3)       change per rotation of GH, about the humerus's axes
    translation : array, shape (P, m, 3)   change per translation of the head, along the scapula's
    """
    joints = {name: _joint_location(model, name) for name in ("sc1", "ac1", GH_JOINT)}
    frames = chain_frames(joints, poses)
    head, humerus = frames["humerus_r"]
    turn = np.einsum("pij,pmj->pmi", humerus, gh_arms)
    pull = np.einsum("pij,pmj->pmi", frames["scapula_r"][1], translation)
    arms = []
    for segment in GIRDLE_JOINTS.values():
        centre, axes = frames[segment]
        about = turn + np.cross((head - centre)[:, None], pull)
        arms.append(np.einsum("pij,pmi->pmj", axes, about))
    return np.concatenate(arms, axis=2)


def _joint_location(model: opensim.Model, name: str) -> list[float]:
    location = model.getJointSet().get(name).get_frames(0).get_translation()
    return [location.get(i) for i in range(3)]


def _chain_positions(path: opensim.GeometryPath) -> Iterator[int]:
    points, wraps = path.getPathPointSet(), path.getWrapSet()
    frames = [points.get(i).getParentFrame() for i in range(points.getSize())]
    frames += [wraps.get(i).getWrapObject().getFrame() for i in range(wraps.getSize())]
    for frame in frames:
        name = frame.getName()
        if name not in CHAIN_POSITION:
            raise ModelError(
                f"a muscle path is attached to {name}; expected {', '.join(CHAIN_POSITION)}."
            )
        yield CHAIN_POSITION[name]


def _angles(poses: Array) -> Array:
    with warnings.catch_warnings():
        # At gimbal lock scipy picks one of the equivalent angle triples, which is all we need.
        warnings.filterwarnings("ignore", message="Gimbal lock")
        return pose_to_trial(poses)


def _rotational(
    sampler: _Sampler, poses: Array, crossing: dict[str, list[int]]
) -> tuple[Array, Array, Array]:
    """Lengths (P, M), their central differences (P, M, 10) for small joint rotations, and the
    largest second differences (P, M) [m]."""
    base = _angles(poses)
    everything = range(len(sampler.paths))
    length = np.empty((len(poses), len(sampler.paths)))
    gradient = np.zeros((*length.shape, 10))
    jump = np.zeros_like(length)
    turned = {name: _turned(poses, base, name) for name in JOINT_COLUMNS}
    for p, angles in enumerate(base.tolist()):
        sampler.set(angles)
        length[p] = sampler.lengths(everything)
        for name, columns in JOINT_COLUMNS.items():
            muscles = crossing[name]
            for k, pair in enumerate(turned[name][p].tolist()):
                sampler.set(pair[0], columns)
                above = np.array(sampler.lengths(muscles))
                sampler.set(pair[1], columns)
                below = np.array(sampler.lengths(muscles))
                change = (above - below) / (2.0 * ROTATION_STEP_RAD)
                gradient[p, muscles, columns.start + k] = change
                second = np.abs(above + below - 2.0 * length[p, muscles])
                jump[p, muscles] = np.maximum(jump[p, muscles], second)
            sampler.set(angles[columns], columns)
    return length, gradient, jump


def _turned(poses: Array, base: Array, joint: str) -> Array:
    """Joint angles (P, axes, 2, angles) after small positive and negative rotations of a joint."""
    columns = JOINT_COLUMNS[joint]
    if joint == "EL":
        steps = np.array([ROTATION_STEP_RAD, -ROTATION_STEP_RAD])
        return base[:, None, None, columns] + steps[None, None, :, None]
    start = 4 * (columns.start // 3)
    turned = np.repeat(poses[None], 6, axis=0)
    steps = ROTATION_STEP_RAD * np.stack([np.eye(3), -np.eye(3)], axis=1).reshape(6, 1, 3)
    small = rotation_vector_to_quaternion(steps)
    turned[..., start : start + 4] = quaternion_multiply(poses[:, start : start + 4], small)
    angles = _angles(turned.reshape(-1, 13))[:, columns].reshape(3, 2, len(poses), 3)
    return np.moveaxis(angles, 2, 0)


def _translational(
    model: opensim.Model, names: Sequence[str], poses: Array, length: Array, muscles: list[int]
) -> tuple[Array, Array]:
    """Central differences (P, M, 3) for small shifts of the GH centre in the scapula, and the
    largest second differences (P, M) [m]."""
    base = _angles(poses).tolist()
    gradient = np.zeros((*length.shape, 3))
    jump = np.zeros_like(length)
    for axis in range(3):
        shifted = np.tile(length, (2, 1, 1))
        for side, sign in enumerate((1.0, -1.0)):
            sampler = _Sampler(_shifted(model, axis, sign * TRANSLATION_STEP_M), names)
            for p, angles in enumerate(base):
                sampler.set(angles)
                shifted[side, p, muscles] = sampler.lengths(muscles)
        gradient[:, :, axis] = (shifted[0] - shifted[1]) / (2.0 * TRANSLATION_STEP_M)
        jump = np.maximum(jump, np.abs(shifted[0] + shifted[1] - 2.0 * length))
    return gradient, jump


def _shifted(model: opensim.Model, axis: int, distance_m: float) -> opensim.Model:
    copy = model.clone()
    moved = _joint_location(copy, GH_JOINT)
    moved[axis] += distance_m
    copy.updJointSet().get(GH_JOINT).upd_frames(0).set_translation(opensim.Vec3(*moved))
    copy.finalizeConnections()
    return copy
