"""Recorded motions at other times."""

import numpy as np
import pytest

from scapulohumeral.model.motion import Motion, resampled
from scapulohumeral.model.rotations import relative_angle, trial_to_pose
from scapulohumeral.model.smoothing import smooth_recording

pytestmark = pytest.mark.unit


def through_the_singularity(time: np.ndarray) -> np.ndarray:
    """Angles (T, 10) [rad] of an arm that passes zero glenohumeral elevation."""
    angles = np.full((len(time), 10), 0.3)
    angles[:, 7] = 0.5 * np.cos(np.pi * time)
    return angles


@pytest.mark.filterwarnings("ignore:Gimbal lock")
@pytest.mark.parametrize("rate_hz", [60, 100, 120])
@pytest.mark.parametrize("smoothed", [False, True])
def test_motion_between_frames_is_that_of_the_arm(rate_hz, smoothed):
    time = np.arange(0.0, 2.0, 1.0 / rate_hz)
    motion = Motion(time, through_the_singularity(time))
    if smoothed:
        motion = smooth_recording(motion, 6.0)
    for first in np.linspace(0.0, 0.03, 4):
        mesh = np.arange(first, time[-1], 0.04)
        found, true = resampled(motion, mesh), through_the_singularity(mesh)
        np.testing.assert_allclose(found, true, atol=0.02)
        error = relative_angle(*(trial_to_pose(angles)[:, 8:12] for angles in (found, true)))
        assert np.rad2deg(error.max()) < 0.3


def test_frames_in_the_other_form_are_the_same_motion():
    time = np.linspace(0.0, 2.0, 121)
    angles = through_the_singularity(time)
    folded = angles.copy()
    folded[angles[:, 7] < 0.0, 6:9] *= [1, -1, 1]
    folded[angles[:, 7] < 0.0, 6:9] += [np.pi, 0, -np.pi]
    mesh = np.arange(0.005, 2.0, 0.04)
    np.testing.assert_allclose(
        resampled(Motion(time, folded), mesh), through_the_singularity(mesh), atol=1e-5
    )
