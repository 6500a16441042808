"""The low-pass filter keeps slow motion, removes noise, and survives gimbal lock."""

import numpy as np
import pytest

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import relative_angle, trial_to_pose
from scapulohumeral.model.smoothing import smooth_recording

pytestmark = pytest.mark.unit

TIME = np.linspace(0.0, 3.0, 301)


def elevation(amplitude: float = 0.6) -> Motion:
    angles = np.full((301, 10), 0.3)
    angles[:, 7] = 0.8 + amplitude * np.sin(2.0 * np.pi * 0.5 * TIME)
    return Motion(TIME, angles)


def humerus_error(a: Motion, b: Motion) -> np.ndarray:
    poses = [trial_to_pose(motion.angles_rad)[:, 8:12] for motion in (a, b)]
    return relative_angle(*poses)


def test_slow_motion_is_kept():
    assert (
        humerus_error(smooth_recording(elevation(), 6.0), elevation()).max() < 3e-3
    )  # the ends included


def test_half_power_at_the_cut_off():
    angles = np.full((301, 10), 0.3)
    wave = 0.01 * np.sin(2.0 * np.pi * 5.0 * TIME)
    angles[:, 9] += wave
    smooth = smooth_recording(Motion(TIME, angles), 5.0).angles_rad[:, 9] - 0.3
    middle = slice(100, 201)
    gain = np.ptp(smooth[middle]) / np.ptp(wave[middle])
    np.testing.assert_allclose(gain, np.sqrt(0.5), rtol=0.01)
    np.testing.assert_allclose(smooth[middle], gain * wave[middle], atol=2e-5)  # no delay


def test_noise_is_reduced():
    noisy = elevation()
    noise = np.random.default_rng(3).normal(0.0, 0.02, noisy.angles_rad.shape)
    raw = Motion(TIME, noisy.angles_rad + noise)
    before, after = humerus_error(raw, elevation()), humerus_error(smooth_recording(raw, 4), raw)
    smooth = humerus_error(smooth_recording(raw, 4.0), elevation())
    assert smooth.mean() < 0.5 * before.mean()
    assert after.mean() > 0.5 * before.mean()


@pytest.mark.filterwarnings("ignore:Gimbal lock")
def test_passing_gimbal_lock_leaves_no_step():
    motion = elevation()
    motion.angles_rad[:, 7] = 0.5 * np.sin(2.0 * np.pi * 0.5 * TIME)  # through zero elevation
    assert humerus_error(smooth_recording(motion, 6.0), motion).max() < 3e-3  # the ends included


def test_uneven_time_is_refused():
    time = TIME.copy()
    time[100:] += 0.1
    with pytest.raises(DataError, match="frame 100, t = 0.9900 s.*Resample"):
        smooth_recording(Motion(time, elevation().angles_rad), 6.0)


def test_cut_off_beyond_half_the_rate_is_refused():
    with pytest.raises(ConfigError, match="below 40.1 Hz for a recording at 100.0 Hz"):
        smooth_recording(elevation(), 60.0)


def test_too_short_recording_is_refused():
    with pytest.raises(DataError, match="8 frames"):
        smooth_recording(Motion(TIME[:8], elevation().angles_rad[:8]), 6.0)
