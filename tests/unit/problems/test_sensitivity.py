"""Cases of the sensitivity: what each changes, and what it leaves alone."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_study import solution

from scapulohumeral.configuration.check import read_sensitivity
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.rotations import quaternion_multiply, relative_angle, segment_orientations
from scapulohumeral.problems.changed_tracking import changed_tracking
from scapulohumeral.problems.composite import compose
from scapulohumeral.problems.sensitivity import (
    Case,
    changed_weights,
    sensitivity_cases,
)

pytestmark = pytest.mark.unit

STEP = 0.04


@pytest.fixture
def tracked():
    return solution("par2", "scapular", "quaternion")


def test_every_case_changes_one_thing():
    settings = read_sensitivity()
    cases = sensitivity_cases(settings)
    assert next(iter(cases)) == "base"
    kinds = [case.kind for case in cases.values()]
    assert kinds.count("weight") == 2 * len(settings.weights)
    assert kinds.count("mesh") == len(settings.time_steps_s)
    starts = len(settings.scapula_turns_deg) + len(settings.random_seeds)
    assert kinds.count("start") == starts
    nothing = Case("", "", "")
    for case in cases.values():
        same = replace(nothing, name=case.name, kind=case.kind, change=case.change)
        changed = [key for key, value in vars(case).items() if value != vars(same)[key]]
        assert len(changed) == (case.kind != "base"), case.name


def test_weights_are_divided_and_multiplied():
    cases = sensitivity_cases(replace(read_sensitivity(), factor=4.0))
    weights = {"activation": 2.0, "regularisation": 3.0}
    more = changed_weights(cases["activation_times"], weights)
    less = changed_weights(cases["regularisation_divided"], weights)
    assert (more, less) == (
        {"activation": 8.0, "regularisation": 3.0},
        {"activation": 2.0, "regularisation": 0.75},
    )
    assert changed_weights(cases["w_gh_times"], weights) == weights
    assert cases["w_gh_times"].factors == {"w_gh": 4.0}


def test_finer_mesh_is_the_same_motion(tracked):
    finer = changed_tracking(tracked, Case("", "mesh", "", time_step_s=STEP / 4), 15.0)
    assert len(finer.time_s) == 4 * (len(tracked.time_s) - 1) + 1
    for name in ("q", "u", "activation", "excitation", "reaction_N", "reference_pose"):
        np.testing.assert_allclose(getattr(finer, name)[::4], getattr(tracked, name), atol=1e-9)
    for first in (0, 4, 8):
        norms = np.linalg.norm(finer.q[:, first : first + 4], axis=1)
        np.testing.assert_allclose(norms, 1.0, atol=1e-12)
    joined = compose([finer], STEP / 4, 1.0)
    assert joined.time_s[-1] == pytest.approx(tracked.time_s[-1])


def test_mesh_has_to_end_with_the_motion(tracked):
    with pytest.raises(ConfigError, match=r"0.027 s: expected one that divides .* of scapular"):
        changed_tracking(tracked, Case("", "mesh", "", time_step_s=0.027), 15.0)


@pytest.mark.parametrize("case", [{"scapula_turn_deg": -20.0}, {"seed": 3}])
def test_other_starts_keep_the_arm(tracked, case):
    start = changed_tracking(tracked, Case("", "start", "", **case), 15.0)
    before, after = (segment_orientations(one.pose) for one in (tracked, start))
    np.testing.assert_allclose(relative_angle(before["humerus"], after["humerus"]), 0, atol=1e-7)
    np.testing.assert_array_equal(start.pose[:, 12], tracked.pose[:, 12])
    turned = np.rad2deg(relative_angle(before["scapula"], after["scapula"]))
    moved = np.rad2deg(relative_angle(before["clavicle"], after["clavicle"]))
    np.testing.assert_allclose(turned, turned[0], atol=1e-6)
    if "seed" in case:
        assert 0.1 < turned[0] <= 15.0
        assert 0.1 < moved[0] <= 15.0
        assert (start.activation != tracked.activation).any(axis=0).all()
        again = changed_tracking(tracked, Case("", "start", "", **case), 15.0)
        np.testing.assert_array_equal(again.activation, start.activation)
    else:
        assert turned[0] == pytest.approx(20.0)
        np.testing.assert_allclose(moved, 0.0, atol=1e-6)
        np.testing.assert_array_equal(start.activation, tracked.activation)


def test_positive_turns_go_upward(tracked):
    """About the z axis of the scapula: the second angle of its Y-Z-X sequence grows."""
    start = changed_tracking(tracked, Case("", "start", "", scapula_turn_deg=5.0), 15.0)
    scapula = segment_orientations(tracked.pose)["scapula"]
    half = np.deg2rad(2.5)
    expected = quaternion_multiply(scapula, [np.cos(half), 0.0, 0.0, np.sin(half)])
    found = segment_orientations(start.pose)["scapula"]
    np.testing.assert_allclose(relative_angle(found, expected), 0.0, atol=1e-7)
