"""Distances to a published motion, told of motions that differ in known angles."""

import numpy as np
import pytest

from scapulohumeral.model.published_arm import PUBLISHED_NODES, PUBLISHED_PLANES
from scapulohumeral.model.rotations import (
    euler_to_quaternion,
    quaternion_conjugate,
    quaternion_multiply,
)
from scapulohumeral.quantities.published_distance import GIRDLE, at_level, published_distances
from scapulohumeral.quantities.segment_angles import ELEVATION_COLUMN

pytestmark = pytest.mark.unit

HUMERUS_DEG = (0.0, 60.0, 0.0)
ELEVATIONS = [0.0, 10.0, 20.0, 15.0, 18.0, 30.0, 12.0]


def motion(retraction=(20.0, 40.0), turned=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Poses (268, 13): the clavicle goes back, the scapula is turned about its own three angles.

    Humerus and scapula are told in the thorax, so joints undo what carries them.
    """
    back = -np.linspace(*retraction, PUBLISHED_NODES)
    zero = np.zeros(PUBLISHED_NODES)
    clavicle = euler_to_quaternion(np.deg2rad(np.stack([back, zero + 5.0, zero], axis=1)), "YZX")
    angles = np.array([30.0, 20.0, -5.0]) + np.array(turned)
    scapula = euler_to_quaternion(np.deg2rad(np.tile(angles, (PUBLISHED_NODES, 1))), "YZX")
    arm = np.linspace(20.0, 100.0, PUBLISHED_NODES)
    humerus = euler_to_quaternion(np.deg2rad(np.stack([zero, arm, zero], axis=1)), "YZY")
    joints = [
        clavicle,
        quaternion_multiply(quaternion_conjugate(clavicle), scapula),
        quaternion_multiply(quaternion_conjugate(scapula), humerus),
    ]
    return np.concatenate([*joints, zero[:, None]], axis=1)


def told(ours: np.ndarray, theirs: np.ndarray) -> dict[tuple[str, str, str], tuple[float, float]]:
    found = published_distances(ours, theirs, {})
    return {(c.plane, c.phase, c.quantity): (c.published, c.reproduced) for c in found}


def test_every_angle_of_the_girdle_has_its_own_distance():
    """Tilt and internal rotation, too: a scapula that is wrong in them alone is wrong."""
    found = told(motion(turned=(3.0, 0.0, -7.0)), motion())
    expected = {"internal_rotation": 3.0, "posterior_tilt": 7.0}
    for plane in PUBLISHED_PLANES:
        for name in GIRDLE:
            error = found[plane, "elevation", f"{name}_rmse_deg"]
            assert error == (0.0, pytest.approx(expected.get(name, 0.0), abs=1e-6)), name


def test_peak_of_retraction_is_the_most_retracted():
    found = told(motion(retraction=(20.0, 45.0)), motion(retraction=(20.0, 40.0)))
    theirs, ours = found["sagittal", "peak", "clavicle_retraction_deg"]
    assert (theirs, ours) == (pytest.approx(-40.0, abs=0.1), pytest.approx(-45.0, abs=0.1))
    assert found["sagittal", "peak", "clavicle_elevation_deg"][1] == pytest.approx(5.0)


@pytest.mark.parametrize(
    ("level", "node"), [(0.0, 0.0), (5.0, 0.5), (20.0, 2.0), (22.0, 4.0 + 4.0 / 12.0), (30.0, 5.0)]
)
def test_the_first_time_at_an_elevation_counts(level: float, node: float) -> None:
    angles = np.zeros((len(ELEVATIONS), 11))
    angles[:, ELEVATION_COLUMN] = ELEVATIONS
    angles[:, 10] = np.arange(len(ELEVATIONS))
    assert at_level(angles, 10, level) == pytest.approx(node)


@pytest.mark.parametrize("level", [-1.0, 31.0])
def test_an_elevation_that_is_not_reached_has_no_angle(level: float) -> None:
    angles = np.zeros((len(ELEVATIONS), 10))
    angles[:, ELEVATION_COLUMN] = ELEVATIONS
    assert np.isnan(at_level(angles, 0, level))
