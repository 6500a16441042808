"""Errors of measurement put into recorded motions turn one segment and nothing else."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scapulohumeral.model.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    trial_to_pose,
)
from simulated_persons.spoilt import spoilt

pytestmark = pytest.mark.unit
DURATION = np.linspace(0.0, 1.0, 41)
# A scapula that rises with the arm, to 130 deg of elevation.
ANGLES = np.deg2rad(
    np.column_stack(
        [
            -25.0 + 0.0 * DURATION,
            5.0 + 10.0 * DURATION,
            0.0 * DURATION,
            45.0 + 0.0 * DURATION,
            5.0 + 25.0 * DURATION,
            0.0 * DURATION,
            0.0 * DURATION,
            5.0 + 90.0 * DURATION,
            0.0 * DURATION,
            10.0 + 0.0 * DURATION,
        ]
    )
)


def segments(angles: np.ndarray) -> dict[str, np.ndarray]:
    """Orientations (T, 4) of clavicle, scapula and humerus in the thorax."""
    pose = trial_to_pose(angles)
    clavicle = pose[:, :4]
    scapula = quaternion_multiply(clavicle, pose[:, 4:8])
    return {
        "clavicle": clavicle,
        "scapula": scapula,
        "humerus": quaternion_multiply(scapula, pose[:, 8:12]),
    }


def turned(segment: str, axis: str, deg: float, growing: bool = False) -> dict[str, np.ndarray]:
    """Rotation vectors (T, 3) [deg] of the segments, in their own axes."""
    before, after = segments(ANGLES), segments(spoilt(ANGLES, segment, axis, deg, growing))
    return {
        name: np.rad2deg(
            Rotation.from_matrix(
                quaternion_to_matrix(
                    quaternion_multiply(quaternion_conjugate(before[name]), after[name])
                )
            ).as_rotvec()
        )
        for name in before
    }


@pytest.mark.parametrize("segment", ["scapula", "humerus"])
def test_a_turned_frame_turns_one_segment(segment: str) -> None:
    for name, vectors in turned(segment, "y", 8.0).items():
        expected = [0.0, 8.0, 0.0] if name == segment else 0.0
        np.testing.assert_allclose(vectors, np.broadcast_to(expected, vectors.shape), atol=1e-6)


def test_a_turned_thorax_turns_all_segments() -> None:
    for vectors in turned("thorax", "x", 8.0).values():
        np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), 8.0, rtol=1e-6)


def test_skin_slides_over_a_lifted_scapula_alone() -> None:
    vectors = turned("scapula", "z", 12.0, growing=True)["scapula"]
    np.testing.assert_allclose(vectors[:5], 0.0, atol=1e-6)
    axis = quaternion_to_matrix(segments(ANGLES)["humerus"])[:, :, 1]
    elevation = np.rad2deg(np.arccos(axis[:, 1]))
    np.testing.assert_allclose(np.interp(120.0, elevation, vectors[:, 2]), 12.0, atol=0.1)
    assert np.all(np.diff(vectors[:, 2]) > -1e-9)


def test_skin_of_the_upper_arm_loses_a_share_of_axial_rotation() -> None:
    rolling = ANGLES[:1].repeat(len(DURATION), 0)
    # With the arm nearly hanging, the last angle is axial rotation.
    rolling[:, 7] = 0.0
    rolling[:, 8] = np.deg2rad(90.0 * DURATION)
    kept = np.rad2deg(spoilt(rolling, "humerus", "y", 24.0, growing=True) - rolling)
    np.testing.assert_allclose(kept[:, 6] + kept[:, 8], -36.0 * DURATION, atol=1e-6)
    np.testing.assert_allclose(kept[:, [0, 1, 2, 3, 4, 5, 7, 9]], 0.0, atol=1e-6)
    vectors = turned("humerus", "y", 24.0, growing=True)["humerus"]
    np.testing.assert_allclose(vectors[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(vectors[:, [0, 2]], 0.0, atol=1e-6)


@pytest.mark.parametrize(("segment", "axis"), [("humerus", "x"), ("thorax", "y")])
def test_only_known_skin_slides(segment: str, axis: str) -> None:
    with pytest.raises(ValueError, match=f"growing error of the {segment} about {axis}"):
        spoilt(ANGLES, segment, axis, 8.0, growing=True)
