"""Rows that are missing inside a recording: what many frames beside a hole agree on fills it."""

import numpy as np
import pytest
from places import REPOSITORY

from scapulohumeral.gap.recording.holes import filled, holes
from scapulohumeral.gap.recording.movement_window import smoothed
from scapulohumeral.model.motion import Motion, read_motion, resampled
from scapulohumeral.model.rotations import relative_angle, segment_orientations, trial_to_pose

pytestmark = pytest.mark.unit

NOISE_DEG, HOLE_S = 0.5, 0.3


@pytest.fixture(scope="module")
def elevation() -> Motion:
    """A recorded elevation at 100 frames per second."""
    recorded = read_motion(REPOSITORY / "config" / "participants" / "par2" / "frontal.csv")
    time_s = np.arange(recorded.time_s[0], recorded.time_s[-1], 0.01)
    return Motion(time_s, resampled(recorded, time_s))


def cut(motion: Motion, seed: int) -> Motion:
    """The motion with noise and without some rows in its middle."""
    rng = np.random.default_rng(seed)
    noisy = motion.angles_rad + np.deg2rad(NOISE_DEG) * rng.normal(size=motion.angles_rad.shape)
    start = rng.uniform(motion.time_s[0] + 0.5, motion.time_s[-1] - 0.5 - HOLE_S)
    kept = (motion.time_s < start) | (motion.time_s > start + HOLE_S)
    return Motion(motion.time_s[kept], noisy[kept])


def farthest_deg(motion: Motion, time_s: np.ndarray, truth: Motion) -> float:
    """Largest turn of a segment from the truth [deg]."""
    found, true = (
        segment_orientations(trial_to_pose(angles))
        for angles in (resampled(motion, time_s), truth.angles_rad)
    )
    return max(float(np.rad2deg(relative_angle(found[k], true[k])).max()) for k in true)


def test_a_filled_hole_is_nearer_to_the_truth_than_a_spline_across_it(elevation):
    parts = [cut(elevation, seed) for seed in range(8)]
    across, through = (
        np.median([farthest_deg(smoothed(way(one)), elevation.time_s, elevation) for one in parts])
        for way in (lambda one: one, filled)
    )
    assert through < 3.0
    assert across > 2.0 * through


def test_frames_that_are_there_stay_and_the_hole_is_closed(elevation):
    part = cut(elevation, 1)
    [(start, end)] = holes(part.time_s)
    assert end - start == pytest.approx(HOLE_S, abs=0.02)
    whole = filled(part)
    assert not holes(whole.time_s)
    there = np.isin(whole.time_s, part.time_s)
    np.testing.assert_array_equal(whole.time_s[there], part.time_s)
    poses = trial_to_pose(whole.angles_rad[there]), trial_to_pose(part.angles_rad)
    np.testing.assert_allclose(*poses, atol=1e-9)


def test_a_recording_without_holes_is_the_same(elevation):
    assert filled(elevation) is elevation
    assert holes(elevation.time_s) == []
