"""How deep a cause is resolved by what it cannot be told from, and what it leaves of the gap."""

import numpy as np
import pytest
from made_up_hypotheses import DAMPING, hypothesis, residual

from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.verdict.candidates import Doubt, _level, effect_classes, share_left
from scapulohumeral.gap.verdict.posterior import Posterior

pytestmark = pytest.mark.unit

INFRA, SUPRA = "body/strength_loss/infra", "body/strength_loss/supra"
LOAD, GAIN = "body/hand_load", "measurement/emg_gain/EMG_infra"


@pytest.mark.parametrize(
    ("label", "mates", "level"),
    [
        (INFRA, [], "member"),
        (INFRA, [SUPRA], "family"),
        (INFRA, [LOAD], "side"),
        (INFRA, [f"{GAIN} + {INFRA}"], "member"),
        (f"{INFRA} + {GAIN}", [f"{SUPRA} + {GAIN}"], "family"),
        (f"{INFRA} + {GAIN}", [f"{LOAD} + {GAIN}"], "side"),
    ],
)
def test_a_label_is_as_deep_as_its_mates_agree(label: str, mates: list[str], level: str) -> None:
    assert _level(label, [[label, *mates]]) == level


def left_share(least: float, factor: float = 1.0) -> float:
    """Share of a difference that a cause leaves, where smooth causes leave these squares."""
    one = hypothesis(DAMPING, 1)
    there = residual(one.slope @ [0.5])
    return share_left(there, factor * fit(one, there, 0.1).predicted, least)


def test_what_smooth_causes_leave_is_not_unexplained() -> None:
    assert left_share(0.0) < 0.1
    assert left_share(10.0) == 0.0


def test_of_a_gap_that_smooth_causes_would_leave_as_well_everything_is_left() -> None:
    whole = float(np.sum((hypothesis(DAMPING, 1).slope @ [0.5]) ** 2))
    assert left_share(1.01 * whole) == left_share(2.0 * whole) == 1.0


def test_a_cause_that_makes_a_gap_larger_leaves_all_of_it() -> None:
    assert left_share(0.0, factor=-1.0) == 1.0
    assert left_share(0.0, factor=3.0) == 1.0


def test_where_no_gap_is_found_no_cause_is_told_from_others() -> None:
    found = Posterior({INFRA: 0.3, SUPRA: 0.2, LOAD: 0.1}, 0.1, 0.3)
    groups = [[INFRA, SUPRA], [LOAD]]
    told, alone = effect_classes(groups, found, {}, present=True, doubt=Doubt.NONE)
    assert "these trials cannot tell" in told.text
    assert "stands alone" in alone.text
    assert (told.p, told.p_correct_within) == (pytest.approx(0.5), pytest.approx(0.6))
    [only] = effect_classes(groups[1:], found, {}, present=True, doubt=Doubt.NONE)
    assert "no other cause is probable enough" in only.text
    unsure = effect_classes(groups[::-1], found, {}, present=True, doubt=Doubt.UNTOLD)
    assert "motion cannot tell" in unsure[0].text
    undecided = effect_classes(groups[::-1], found, {}, present=True, doubt=Doubt.UNDECIDED)
    assert "is not named" in undecided[0].text
    assert "stands alone" not in undecided[0].text
    for one in effect_classes(groups, found, {}, present=False, doubt=Doubt.NONE):
        assert all(label in one.text for label in one.labels)
        assert "no gap shows" in one.text
