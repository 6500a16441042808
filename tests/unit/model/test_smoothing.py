"""The low-pass filter keeps slow motion, removes noise, and survives gimbal lock."""

from pathlib import Path

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


@pytest.mark.parametrize("rate_hz", [20, 25, 50, 1000])
def test_half_power_at_the_cut_off_whatever_the_rate(rate_hz: int) -> None:
    time = np.arange(0.0, 8.0, 1.0 / rate_hz)
    angles = np.full((len(time), 10), 0.3)
    angles[:, 9] += 0.01 * np.sin(2.0 * np.pi * 6.0 * time)
    smooth = smooth_recording(Motion(time, angles), 6.0).angles_rad[:, 9] - 0.3
    middle = slice(2 * rate_hz, 6 * rate_hz)
    # The root of mean squares does not depend on which points of the wave were sampled.
    gain = np.sqrt(np.mean(smooth[middle] ** 2)) / (0.01 * np.sqrt(0.5))
    assert gain == pytest.approx(np.sqrt(0.5), rel=5e-3)


@pytest.mark.parametrize("rate_hz", [50, 100, 1000])
def test_a_trial_that_is_cut_in_motion_keeps_its_speed_at_the_ends(rate_hz: int) -> None:
    time = np.arange(0.0, 1.0, 1.0 / rate_hz)
    angles = np.full((len(time), 10), 0.3)
    angles[:, 9] += 1.5 * time
    smooth = smooth_recording(Motion(time, angles), 6.0).angles_rad[:, 9]
    assert np.gradient(smooth, time)[[0, -1]] == pytest.approx([1.5, 1.5], rel=0.02)


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
    smooth = smooth_recording(motion, 6.0)
    assert humerus_error(smooth, motion).max() < 3e-3  # the ends included
    # Nor do the angles, which take the form of those that were recorded.
    np.testing.assert_allclose(smooth.angles_rad, motion.angles_rad, atol=0.02)


def test_uneven_time_is_refused():
    time = TIME.copy()
    time[100:] += 0.1
    message = "lift.csv, row 102, column time_s: 0.110000 s after the row before.*Resample"
    with pytest.raises(DataError, match=message):
        smooth_recording(Motion(time, elevation().angles_rad), 6.0, Path("lift.csv"))


@pytest.mark.parametrize("rate_hz", [30, 60, 120])
def test_times_may_be_rounded_to_milliseconds(rate_hz: int) -> None:
    exact = np.arange(301) / rate_hz
    angles = elevation().angles_rad
    of_exact, of_rounded = (
        smooth_recording(Motion(time, angles), 6.0).angles_rad for time in (exact, exact.round(3))
    )
    np.testing.assert_allclose(of_rounded, of_exact, atol=1e-5)


def test_cut_off_beyond_half_the_rate_is_refused():
    with pytest.raises(ConfigError, match="below 50.0 Hz for a recording at 100.0 Hz"):
        smooth_recording(elevation(), 60.0)


def test_too_short_recording_is_refused():
    with pytest.raises(DataError, match="8 frames"):
        smooth_recording(Motion(TIME[:8], elevation().angles_rad[:8]), 6.0)
