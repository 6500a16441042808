"""Records of one movement are compared pair by pair: what differs between repeats is no noise."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES, SETTINGS, small_record

from scapulohumeral.gap.detection.single_trials import alone
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    SensorSetup,
    phase_functions,
)
from scapulohumeral.gap.residual.differences import (
    Records,
    _paired,
    mean_difference,
    repeat_noise,
)

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 4)
TURN_DEG = np.array([0.0, 0.0, 6.0])


def recorded(*, one_movement: bool) -> Records:
    """Three movements 10 to 30 deg apart in elevation, and a turned scapula in the test."""
    reference = [small_record(peak) for peak in (1.0, 1.2, 1.5)]
    test = [
        replace(one, pose=turn_frame(one.pose, "scapula", np.deg2rad(TURN_DEG)))
        for one in reference
    ]
    sides = {"lift": test}, {"lift": reference}
    if one_movement:
        sides = _paired(*sides)
    means = {"lift": sides[1]["lift"][len(sides[1]["lift"]) // 2]}
    sensors = SensorSetup(CHANNELS, np.eye(2), False)
    return Records(*sides, means, sensors, NAMES, not one_movement, one_movement)


def compared(records: Records):
    """The mean difference."""
    noise = repeat_noise(records, FUNCTIONS, SETTINGS)
    return mean_difference(records, [SimpleNamespace(task="lift")], noise, FUNCTIONS)


def test_pairs_differ_by_the_record_alone():
    found, apart = (compared(recorded(one_movement=one)) for one in (True, False))
    elevation = found.channel_rows(["GH_rz"])
    spread, scattered = (np.sqrt(np.diag(one.noise)[elevation]).max() for one in (found, apart))
    assert spread < 0.2 * scattered
    curves = found.curves(found.delta)[0]
    turn = np.linalg.norm(curves[:, 3:6], axis=1)
    np.testing.assert_allclose(turn, 6.0, atol=0.05)
    np.testing.assert_allclose(curves[:, :3], 0.0, atol=1e-9)


def test_the_mean_that_pairs_are_carried_onto_is_no_trial():
    records = recorded(one_movement=True)
    assert list(records.sides) == ["test"]
    assert [place.side for place, _ in records.thinned()] == ["test"] * 3
    # Without some of the pairs the mean stays: only what differs is told from fewer.
    for _, left in records.thinned():
        assert len(left.test["lift"]) == 2
        np.testing.assert_allclose(
            left.mean_records["lift"].pose, records.mean_records["lift"].pose
        )
    assert alone(records) == ()
