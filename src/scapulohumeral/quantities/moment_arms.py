"""Moment arms of muscles for movements that anatomists measure, from fitted muscle lengths.

A moment arm is how much a muscle shortens per angle of one movement, with all other joints still;
positive: the muscle helps the movement.

Letters: N poses, M muscles.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import (
    Array,
    quaternion_to_euler,
    quaternion_to_matrix,
    segment_orientations,
)
from scapulohumeral.quantities.segment_angles import SEGMENT_SEQUENCES

# Movement: segment that turns, and columns of the rotations of its joint.
JOINTS = {
    "elevation": ("humerus", slice(6, 9)),
    "axial_rotation": ("humerus", slice(6, 9)),
    "upward_rotation": ("scapula", slice(3, 6)),
    "clavicle_elevation": ("clavicle", slice(0, 3)),
}


def movement_arms(forces: MuscleForces, pose: Array) -> dict[str, Array]:
    """Moment arms (N, M) [m] by movement.

    ``elevation`` raises the humerus in the plane that it is in, with the scapula still;
    ``axial_rotation`` turns it inwards about its long axis; ``upward_rotation`` turns the scapula
    at the acromioclavicular joint, the arm with it; ``clavicle_elevation`` raises the clavicle,
    and all else with it.

    Parameters
    ----------
    forces : in quaternions, whose speeds are angular velocities in distal axes
    pose : (N, 13), the arm not hanging: without elevation there is no plane of it

    Raises
    ------
    ConfigError                      in Euler angles, whose rates are no rotations about fixed axes
    """
    if forces.dynamics.name != "quaternion":
        raise ConfigError(
            f"moment arms in the formulation '{forces.dynamics.name}': expected 'quaternion', "
            "whose speeds are rotations about orthogonal axes"
        )
    arms = -forces.gradients(pose)
    axes = _axes(pose)
    return {
        movement: np.einsum("nmk,nk->nm", arms[:, :, columns], axes[movement])
        for movement, (_, columns) in JOINTS.items()
    }


def _axes(pose: Array) -> dict[str, Array]:
    """Unit axis (N, 3) of each movement in the axes of the segment that turns."""
    orientations = segment_orientations(pose)
    matrices = {name: quaternion_to_matrix(q) for name, q in orientations.items()}
    upright, long_axis = np.array([0.0, 1.0, 0.0]), matrices["humerus"][:, :, 1]
    raising = np.cross(upright, long_axis)
    in_thorax = {
        "elevation": raising / np.linalg.norm(raising, axis=1, keepdims=True),
        "axial_rotation": long_axis,
        "upward_rotation": _second_axis(orientations["scapula"], "scapula"),
        "clavicle_elevation": _second_axis(orientations["clavicle"], "clavicle"),
    }
    return {
        movement: np.einsum("nij,ni->nj", matrices[JOINTS[movement][0]], axis)
        for movement, axis in in_thorax.items()
    }


def _second_axis(orientation: Array, segment: str) -> Array:
    """Axis (N, 3) in the thorax about which the second angle of Y-Z-X turns."""
    first = quaternion_to_euler(orientation, SEGMENT_SEQUENCES[segment])[:, 0]
    return np.stack([np.sin(first), np.zeros(len(first)), np.cos(first)], axis=1)
