"""Generalised forces of a force on the forearm or the hand.

Letters: N poses.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from scapulohumeral.dynamics.compiled import CompiledDynamics
from scapulohumeral.model.rotations import (
    Array,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)

# ASSUME: cuffs of arm supports and exoskeletons sit half way from the elbow to the hand.
ALONG = {"hand": 1.0, "forearm": 0.5}


def force_levers(
    dynamics: CompiledDynamics, parameters: Mapping[str, Array], pose: Array
) -> dict[str, Array]:
    """Generalised forces of 1 N along each thorax axis, by point of :data:`ALONG`.

    A force F at r turns a joint at o by R^T ((r - o) x F) in the axes R of its child, as the speeds
    count, and pushes the humeral head by F.

    Parameters
    ----------
    parameters : blocks of the dynamics parameters; `com_load` is the centre of the hand
    pose : (N, 13) joint quaternions and elbow angle

    Returns
    -------
    (N, 13, 3) by point: rows of the ten speeds [m], then of the humeral head along scapula axes
    """
    turns, joints = _joints(dynamics, parameters, pose)
    forearm = turns[-1]
    axis = turns[2] @ np.ravel(parameters["axis_EL"])
    found = {}
    for point, share in ALONG.items():
        place = joints[-1] + share * (forearm @ np.ravel(parameters["com_load"]))
        arms = [_cross(place - joint) for joint in joints]
        rows = [turn.transpose(0, 2, 1) @ arm for turn, arm in zip(turns, arms[:3], strict=False)]
        elbow = np.einsum("ni,nij->nj", axis, arms[3])[:, None]
        found[point] = np.concatenate([*rows, elbow, turns[1].transpose(0, 2, 1)], axis=1)
    return found


def _joints(
    dynamics: CompiledDynamics, parameters: Mapping[str, Array], pose: Array
) -> tuple[list[Array], list[Array]]:
    """Axes (N, 3, 3) of clavicle, scapula, humerus and forearm, and places (N, 3) of their joints.

    All in the thorax.
    """
    turns = list(np.moveaxis(dynamics.pose_matrices(pose), 1, 0))
    bend = pose[:, 12:] * np.ravel(parameters["axis_EL"])
    turns.append(turns[-1] @ quaternion_to_matrix(rotation_vector_to_quaternion(bend)))
    place = np.tile(np.ravel(parameters["offset_SC"]), (len(pose), 1))
    places = [place]
    for joint, turn in zip(("AC", "GH", "EL"), turns, strict=False):
        place = place + turn @ np.ravel(parameters[f"offset_{joint}"])
        places.append(place)
    return turns, places


def _cross(vector: Array) -> Array:
    """Matrices (N, 3, 3) that multiply a vector as `vector` (N, 3) x does."""
    return np.cross(vector[:, None], np.eye(3)).transpose(0, 2, 1)
