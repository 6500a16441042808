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
    at_one_tempo,
    folds,
    halves,
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


def left_out(records: Records):
    """Trials that are left out."""
    noise = repeat_noise(records, FUNCTIONS, SETTINGS)
    return folds(records, [SimpleNamespace(task="lift")], noise, FUNCTIONS), noise


def test_what_is_odd_in_a_reference_trial_is_not_removed_from_a_fold_by_itself():
    """One reference trial is turned: it is either in what is left out or in the rest."""
    plain = recorded(one_movement=False)
    reference = plain.reference["lift"]
    odd = replace(reference[0], pose=turn_frame(reference[0].pose, "scapula", np.deg2rad(TURN_DEG)))
    records = replace(plain, test={"lift": reference}, reference={"lift": [odd, *reference[1:]]})
    found, noise = left_out(records)
    assert len(found) == 3
    turned = found[0].left_out.channel_rows(["AC_rz"])
    shown = np.array([[one.left_out.delta[turned][0], one.rest[turned][0]] for one in found])
    scale = np.abs(shown).max()
    with_odd = np.abs(shown) > 0.1 * scale
    np.testing.assert_array_equal(with_odd, [[True, False], [False, True], [False, True]])
    np.testing.assert_allclose(
        found[0].left_out.covariance, 2.0 * noise.covariances["lift"], rtol=1e-12
    )


def test_one_trial_on_a_side_leaves_nothing_to_be_left_out():
    records = recorded(one_movement=False)
    one_reference = replace(records, reference={"lift": records.reference["lift"][:1]})
    one_test = replace(records, test={"lift": records.test["lift"][:1]})
    assert left_out(one_reference)[0] == left_out(one_test)[0] == ()
    assert halves(one_test, [SimpleNamespace(task="lift")], FUNCTIONS) == ()
    assert len(halves(records, [SimpleNamespace(task="lift")], FUNCTIONS)) == 2
    # The reference of records of one movement is exact.
    [first, *_], noise = left_out(recorded(one_movement=True))
    np.testing.assert_allclose(first.left_out.covariance, noise.covariances["lift"])


def test_what_another_tempo_asks_for_is_taken_off_and_said():
    records = recorded(one_movement=False)
    slower = [replace(one, duration_s=1.5 * one.duration_s) for one in records.test["lift"]]
    records = replace(records, test={"lift": slower})
    tempo = np.zeros((NODES, len(NAMES)))
    tempo[:, -1] = 0.125
    warnings: list[str] = []
    same = at_one_tempo(records, [SimpleNamespace(task="lift", tempo=tempo)], warnings)
    for before, after in zip(slower, same.test["lift"], strict=True):
        np.testing.assert_array_equal(after.pose, before.pose)
        np.testing.assert_allclose(before.emg - after.emg, tempo[:, -2:])
    assert same.reference == records.reference
    [said] = warnings
    assert "task lift last 1.50 times as long" in said
