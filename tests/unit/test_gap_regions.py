"""Regions of a thin gap, the prior of pairs, and how deep a label is resolved beside pairs."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from gap_movement import CHANNELS, NODES

from scapulohumeral.gap.decide import PAIRS, _level, pair_priors
from scapulohumeral.gap.floor import Comparison
from scapulohumeral.gap.locate import POINTWISE_SIGMA, Shows, shown_regions
from scapulohumeral.gap.observe import KINEMATIC_CHANNELS, phase_functions

pytestmark = pytest.mark.unit

NAMES = (*KINEMATIC_CHANNELS, *CHANNELS)
FUNCTIONS = phase_functions(NODES, 4)


def found(peak):
    """A map with one channel above zero in its last third."""
    sigma = np.zeros((NODES, len(NAMES)))
    sigma[-4:, 3] = peak
    null = np.sort(np.linspace(1.0, 4.0, 100))
    return Shows(sigma, sigma, peak, 3.9, 0.01, null)


def comparison():
    size = len(NAMES) * 4
    return Comparison(np.zeros(size), np.eye(size), np.eye(size), FUNCTIONS, ("a",), NAMES, 5)


def test_regions_above_the_threshold_of_the_map_are_certain():
    [region] = shown_regions(found(5.0), comparison(), [])
    assert region.channel == "AC_rx"
    assert region.p_value == pytest.approx(1 / 101)
    assert region.share == 1.0


def test_a_thin_gap_has_regions_that_say_how_uncertain_they_are():
    thin = found(2.5)
    assert not thin.standing_out
    [region] = shown_regions(thin, comparison(), [])
    assert region.p_value == pytest.approx((1 + np.sum(thin.null >= 2.5)) / 101)
    assert region.p_value > 0.4
    nothing = replace(thin, sigma=thin.sigma * (0.9 * POINTWISE_SIGMA / 2.5))
    assert shown_regions(nothing, comparison(), []) == ()


def test_all_pairs_of_families_share_their_prior():
    single = dict.fromkeys("abcdefghijklmnopq", (1.0 - 0.3) / 17)
    every = pair_priors(single, 0.3)
    assert set(every) == {f"{one} + {two}" for one, two in combinations("abcdefghijklmnopq", 2)}
    assert sum(every.values()) == pytest.approx(PAIRS * (1.0 - 1.0 / 17))


def test_a_pair_with_the_label_does_not_make_it_vague():
    tilt, pair = "input/thorax_tilt", "body/hand_load + input/thorax_tilt"
    assert _level(tilt, [[tilt, pair]]) == "member"
    assert _level(tilt, [[tilt, "body/hand_load"]]) == "side"
