"""Regions of a thin gap, the prior of pairs, and how deep a label is resolved beside pairs."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES

from scapulohumeral.gap.detection.presence import DifferenceMap
from scapulohumeral.gap.detection.regions import POINTWISE_SIGMA, entered_regions, shown_regions
from scapulohumeral.gap.isolation.priors import PAIRS, pair_priors
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import UnknownInputs
from scapulohumeral.gap.signatures.nuisances import SMOOTH
from scapulohumeral.gap.verdict.candidates import _level

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 4)


def found(peak):
    """A map with one channel above zero in its last third."""
    sigma = np.zeros((NODES, len(NAMES)))
    sigma[-4:, 3] = peak
    null = np.sort(np.linspace(1.0, 4.0, 100))
    single = np.full(sigma.shape, 1.96)
    return DifferenceMap(sigma, sigma, peak, 3.9, 0.01, null, single, sigma[None])


def residual():
    size = len(NAMES) * 4
    noise = 0.99 * np.eye(size)
    return Residual(np.zeros(size), np.eye(size), noise, FUNCTIONS, ("a",), NAMES, (5.0,))


def test_regions_above_the_threshold_of_the_map_are_certain():
    [region] = shown_regions(found(5.0), residual(), [])
    assert region.channel == "AC_rx"
    assert region.p_value == pytest.approx(1 / 101)
    assert region.share == 1.0


def test_a_region_extends_as_far_as_its_points_would_stand_out_alone():
    """From a tip above the threshold of the map; a run without such a tip is none."""
    wide = found(5.0)
    wide.sigma[-6:-1, 3] = 2.5
    wide.sigma[:4, 3] = -3.0
    wide.sigma[:, 5] = 3.0
    [region] = shown_regions(wide, residual(), [])
    assert region.phase_percent == (100.0 * (NODES - 6) / (NODES - 1), 100.0)
    assert (region.channel, region.peak_percent, region.sign) == ("AC_rx", 100.0, 1)
    wide.sigma[:4, 3] = -4.5
    first, second = shown_regions(wide, residual(), [])
    assert {first.channel, second.channel} == {"AC_rx"}
    assert (first.sign, second.sign) == (-1, 1)
    assert first.share > second.share


def test_regions_that_both_halves_of_the_trials_have_are_repeated():
    there = residual()
    seen, unseen = (there.compress([0.5 * sign * found(60.0).sigma]) for sign in (1.0, -1.0))
    assert shown_regions(found(5.0), there, [seen, seen])[0].repeated is True
    assert shown_regions(found(5.0), there, [seen, unseen])[0].repeated is False
    assert shown_regions(found(5.0), there, [])[0].repeated is None


def test_forces_enter_where_they_explain_the_difference():
    """A force changes one channel by its own shape; only that one is found, if it repeats."""
    there = residual()
    shapes = phase_functions(NODES, SMOOTH) * np.sqrt(NODES)
    columns = []
    for i in range(len(KINEMATIC_CHANNELS)):
        curves = np.zeros((SMOOTH, NODES, len(NAMES)))
        curves[:, :, i] = shapes.T
        columns.append(there.compress([curves]))
    names = tuple(("dof", name) for name in KINEMATIC_CHANNELS)
    unknown_inputs = UnknownInputs(np.hstack(columns), names, (shapes,) * len(names))
    delta = unknown_inputs.columns[:, 2 * SMOOTH] * 10.0
    for halves, repeated in (([delta, delta], True), ([2.0 * delta, 0.0 * delta], False)):
        regions, rows = entered_regions(
            replace(there, delta=delta), unknown_inputs, halves, 0.05, 1
        )
        assert [region.name for region in regions] == [KINEMATIC_CHANNELS[2]]
        assert regions[0].effect == pytest.approx(10.0, rel=0.1)
        assert regions[0].repeated is repeated
        assert len(rows) == len(names)


def test_a_thin_gap_has_regions_that_say_how_uncertain_they_are():
    thin = found(2.5)
    assert not thin.standing_out
    [region] = shown_regions(thin, residual(), [])
    assert region.p_value == pytest.approx((1 + np.sum(thin.null >= 2.5)) / 101)
    assert region.p_value > 0.4
    nothing = replace(thin, sigma=thin.sigma * (0.9 * POINTWISE_SIGMA / 2.5))
    assert shown_regions(nothing, residual(), []) == ()


def test_all_pairs_of_families_share_their_prior():
    single = dict.fromkeys("abcdefghijklmnopq", (1.0 - 0.3) / 17)
    every = pair_priors(single, 0.3)
    assert set(every) == {f"{one} + {two}" for one, two in combinations("abcdefghijklmnopq", 2)}
    assert sum(every.values()) == pytest.approx(PAIRS * (1.0 - 1.0 / 17))


def test_a_pair_with_the_label_does_not_make_it_vague():
    tilt, pair = "input/thorax_tilt", "body/hand_load + input/thorax_tilt"
    assert _level(tilt, [[tilt, pair]]) == "member"
    assert _level(tilt, [[tilt, "body/hand_load"]]) == "side"


def test_a_gap_of_one_task_is_told_where_the_mean_over_tasks_hides_it():
    by_task = np.zeros((2, NODES, len(NAMES)))
    by_task[1, 5, 3], by_task[0, 5, 3] = 8.0, -7.5
    thin = found(0.3)
    hidden = replace(thin, by_task=by_task)
    assert not hidden.standing_out
    assert hidden.in_one_task == (1, 5, 3)
    assert thin.in_one_task is None
