"""From a recording to what an optimal control problem follows."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from small_arm import small_motion
from small_posed import small_model, small_settings, small_tracked

from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.errors import DataError
from scapulohumeral.model.motion import Motion
from scapulohumeral.stages import tracking

pytestmark = pytest.mark.unit

SOURCE = Path("lifting.csv")


def recorded(first_s: float, last_s: float, frames: int = 61) -> Motion:
    return Motion(np.linspace(first_s, last_s, frames), small_motion(frames))


def test_mesh_starts_with_the_recording_and_ends_inside_it():
    motion = recorded(5.0, 6.03)
    time_s, angles = tracking.resample(motion, 0.04, SOURCE)
    np.testing.assert_allclose(time_s, 5.0 + 0.04 * np.arange(26))
    np.testing.assert_allclose(angles[0], motion.angles_rad[0], atol=1e-12)
    columns = [np.interp(time_s, motion.time_s, column) for column in motion.angles_rad.T]
    np.testing.assert_allclose(angles, np.stack(columns, axis=1), atol=1e-3)


def test_a_recording_of_whole_intervals_is_followed_to_its_end():
    time_s, angles = tracking.resample(recorded(0.0, 0.4), 0.04, SOURCE)
    assert len(time_s) == 11
    np.testing.assert_allclose(angles[-1], small_motion(61)[-1], atol=1e-9)


def test_a_recording_below_ten_intervals_is_refused():
    with pytest.raises(DataError, match=r"lifting.csv: .* 0.39 s, which is 9 intervals of 0.04 s"):
        tracking.resample(recorded(0.0, 0.39), 0.04, SOURCE)


def test_the_hand_holds_what_it_held(quaternion_equations, monkeypatch):
    monkeypatch.setattr(tracking, "load_model", lambda _: small_model(quaternion_equations))
    trial = SimpleNamespace(motion=recorded(0.0, 1.0), file=SOURCE, hand_load_kg=1.5)
    posed = tracking.pose_tracking(trial, SimpleNamespace(), small_settings())
    assert unpack(posed.parameters)["mass_load"] == 1.5
    assert len(posed.target.time_s) == 26


def test_an_elbow_that_extends_further_than_most_may_be_followed(quaternion_equations, monkeypatch):
    """The usual end of -0.2 rad would hold it there, and the solve would still be optimal."""
    monkeypatch.setattr(tracking, "load_model", lambda _: small_model(quaternion_equations))
    motion = recorded(0.0, 1.0)
    motion.angles_rad[:, 9] = np.linspace(0.3, -0.45, 61)
    trial = SimpleNamespace(motion=motion, file=SOURCE, hand_load_kg=0.0)
    problem = tracking.pose_tracking(trial, SimpleNamespace(), small_settings()).reader
    elbow = problem.layout.index("x", np.array(12), np.arange(problem.layout.nodes))
    assert (problem.lower_bound[elbow] < -0.45).all()


def test_motions_that_were_not_tracked_are_named():
    motions = [small_tracked("frontal"), small_tracked("sagittal", "failed")]
    assert tracking.tracking_failure(motions) == "tracking of sagittal failed"
    assert tracking.tracking_failure(motions[:1]) == ""
