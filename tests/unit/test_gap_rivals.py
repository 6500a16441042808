"""Pairs are looked for among all effects that another one leaves something to explain."""

from dataclasses import replace

import pytest
from test_gap_attribute import DAMPING, EFFECTS, GAIN, LOAD, MASS, comparison, hypothesis, noise

from scapulohumeral.gap.attribute import fit
from scapulohumeral.gap.rivals import PARTNERS, paired

pytestmark = pytest.mark.unit

ERROR = 0.05
LEADER = hypothesis(DAMPING, 1)
OTHERS = [hypothesis(e, 10 + i) for i, e in enumerate(EFFECTS.values()) if e is not DAMPING]


def pairs(delta, others=OTHERS):
    there = comparison(delta)
    singles = [fit(h, there, ERROR) for h in (LEADER, *others)]
    return paired(singles[:1], singles, there, ERROR)


def test_a_partner_that_explains_little_by_itself_is_found():
    """Its change hides in the leader's, which is far larger."""
    second = next(h for h in OTHERS if h.effects == (MASS,))
    mostly = replace(second, slope=second.slope - LEADER.slope @ [[0.8]])
    delta = LEADER.slope @ [2.0] + second.slope @ [0.3] + noise(3)
    others = [mostly if h is second else h for h in OTHERS]
    best = max(pairs(delta, others), key=lambda f: f.log_evidence)
    assert best.label == "body/joint_damping/GH + body/segment_mass/forearm"


def test_partners_are_few_and_of_another_family():
    found = pairs(LEADER.slope @ [2.0] + noise(1))
    assert len(found) == PARTNERS
    families = [{effect.family for effect in f.hypothesis.effects} for f in found]
    assert all(len(both) == 2 for both in families)


def test_each_pair_is_fitted_once():
    there = comparison(LEADER.slope @ [2.0] + noise(1))
    singles = [fit(h, there, 0.2) for h in (LEADER, hypothesis(LOAD, 5), hypothesis(GAIN, 6))]
    found = paired(singles, singles, there, 0.2)
    assert sorted(f.label for f in found) == [
        "body/hand_load + body/joint_damping/GH",
        "body/hand_load + body/strength_loss/biceps",
        "body/joint_damping/GH + body/strength_loss/biceps",
    ]
