"""What would be recorded of a solution, and how it changes with it."""

import numpy as np
import pytest

from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.observables import (
    _averaged,
    carried,
    difference,
    predicted,
    predicted_changes,
)
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.ocp.objective import Trajectory

pytestmark = pytest.mark.unit

NODES, MUSCLES, STEP = 5, 4, 1e-5
CHANNELS, ELECTRODES = ("EMG_a", "EMG_b"), np.array([[1.0, 0, 0, 0], [0, 0.5, 0.5, 0]])


def trajectory(rng: np.random.Generator) -> Trajectory:
    """A trajectory of any numbers."""
    widths = {"q": 13, "u": 10, "a": MUSCLES, "e": MUSCLES, "reaction": 3}
    return Trajectory(**{name: rng.normal(size=(NODES, width)) for name, width in widths.items()})


@pytest.mark.parametrize("channels", [(), CHANNELS])
@pytest.mark.parametrize("contact", [False, True])
def test_changes_are_differences_of_what_is_recorded(channels, contact):
    rng = np.random.default_rng(3)
    x, *steps = (trajectory(rng) for _ in range(3))
    found = predicted_changes(x, steps, channels, ELECTRODES, contact)
    for change, step in zip(found, steps, strict=True):
        ahead, behind = (
            predicted(
                Trajectory(
                    **{
                        name: getattr(x, name) + sign * STEP * getattr(step, name)
                        for name in ("q", "u", "a", "e", "reaction")
                    }
                ),
                1.0,
                channels,
                ELECTRODES,
                contact,
            )
            for sign in (1.0, -1.0)
        )
        expected = difference(ahead, behind) / (2.0 * STEP)
        np.testing.assert_allclose(change, expected, rtol=1e-6, atol=1e-6)


def test_a_carried_record_differs_as_a_record_does_from_its_partner():
    rng = np.random.default_rng(5)

    def record():
        angles = rng.normal(0.0, 0.4, (NODES, 10))
        emg, force = rng.normal(size=(NODES, 2)), rng.normal(size=(NODES, 3))
        return Observation(1.0, trial_to_pose(angles), CHANNELS, emg, force)

    one, partner, onto = record(), record(), record()
    found = difference(carried(one, partner, onto), onto)
    np.testing.assert_allclose(found, difference(one, partner), atol=1e-9)


def test_what_ends_a_little_early_is_held():
    """A clock may be off by more than half a step of the nodes."""
    times = np.linspace(0.0, 1.0, 41)
    time_s = np.linspace(0.0, 0.95, 96)
    found = _averaged(time_s, np.stack([time_s, 1.0 + 0.0 * time_s], axis=1), times)
    inside = slice(1, -3)
    np.testing.assert_allclose(found[inside, 0], times[inside], atol=1e-9)
    np.testing.assert_allclose(found[:, 1], 1.0)
    np.testing.assert_allclose(found[-1, 0], 0.95)
