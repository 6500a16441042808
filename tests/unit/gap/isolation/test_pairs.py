"""Pairs are looked for among all effects that another one leaves something to explain."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from made_up_hypotheses import DAMPING, EFFECTS, GAIN, LOAD, MASS, hypothesis, noise, residual

from scapulohumeral.gap.isolation import pairs as pairs_module
from scapulohumeral.gap.isolation.empirical_bayes import _density
from scapulohumeral.gap.isolation.hypothesis import pair
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.pairs import PARTNERS, paired
from scapulohumeral.gap.isolation.suppositions import Supposition

pytestmark = pytest.mark.unit

ERROR = 0.05
EMG_GAIN = EFFECTS["measurement/emg_gain/EMG_a"]
LEADER = hypothesis(DAMPING, 1)
OTHERS = [hypothesis(e, 10 + i) for i, e in enumerate(EFFECTS.values()) if e is not DAMPING]


def even(singles):
    return {f.label: 1.0 / len(singles) for f in singles}


def pairs(delta, others=OTHERS):
    there = residual(delta)
    singles = [fit(h, there, ERROR) for h in (LEADER, *others)]
    return paired(singles, even(singles), there, ERROR)


def test_a_partner_that_explains_little_by_itself_is_found():
    """Its change hides in the leader's, which is far larger."""
    second = next(h for h in OTHERS if h.effects == (MASS,))
    mostly = replace(second, slope=second.slope - LEADER.slope @ [[0.8]])
    delta = LEADER.slope @ [2.0] + second.slope @ [0.3] + noise(3)
    others = [mostly if h is second else h for h in OTHERS]
    best = max(pairs(delta, others), key=lambda f: f.log_evidence)
    assert best.label == "body/joint_damping/GH + body/segment_mass/forearm"


def test_partners_are_few_and_of_another_family(monkeypatch):
    monkeypatch.setattr(pairs_module, "LEADERS", 1)
    found = pairs(LEADER.slope @ [2.0] + noise(1))
    assert len(found) == PARTNERS
    families = [{effect.family for effect in f.hypothesis.effects} for f in found]
    assert all(len(both) == 2 for both in families)


def test_each_pair_is_fitted_once():
    there = residual(LEADER.slope @ [2.0] + noise(1))
    singles = [fit(h, there, 0.2) for h in (LEADER, hypothesis(LOAD, 5), hypothesis(GAIN, 6))]
    found = paired(singles, even(singles), there, 0.2)
    assert sorted(f.label for f in found) == [
        "body/hand_load + body/joint_damping/GH",
        "body/hand_load + body/strength_loss/biceps",
        "body/joint_damping/GH + body/strength_loss/biceps",
    ]


@pytest.mark.parametrize("error", [0.0, 0.1, 0.3])
def test_pairs_pay_for_what_errors_of_the_stronger_effect_may_mimic(error):
    """In proportion to its log evidence, and to the mean square of the errors."""
    weak = hypothesis(LOAD, 5)
    for strong, share in ((LEADER, error), (hypothesis(EMG_GAIN, 7), 0.5 * error)):
        there = residual(strong.slope @ [1.0] + noise(2))
        one, other = fit(strong, there, error), fit(weak, there, error)
        [both] = paired([one, other], even([one, other]), there, error)
        paid = fit(pair(one, other), there, error).log_evidence - both.log_evidence
        alone = one.log_evidence - no_gap_evidence(there)
        assert alone > 50.0
        assert paid == pytest.approx(share**2 / 3.0 * alone)


def test_what_one_of_two_effects_leaves_is_no_change_of_session():
    second = hypothesis(GAIN, 12, size=1.0)
    delta = LEADER.slope @ [2.0] + second.slope @ [-2.0, 0.0] + noise(4)
    steady, moving = residual(delta), residual(delta, 2.0)
    assert density(steady, [LEADER, second]) > density(moving, [LEADER, second])
    assert density(steady, [LEADER]) < density(moving, [LEADER])


def density(there, hypotheses):
    singles = tuple(fit(h, there, ERROR) for h in hypotheses)
    labels = [f.label for f in singles]
    prior = {**dict.fromkeys(labels, 0.05), " + ".join(sorted(labels)): 0.001}
    return _density(
        SimpleNamespace(
            residuals={0.0: there},
            fits={Supposition(1.0, 0.0): singles},
            prior=prior,
            unknown_inputs=SimpleNamespace(columns=noise(9)[:, None]),
            settings=SimpleNamespace(prior_none=0.1, prior_no_gap=0.2, signature_error=ERROR),
        )
    )
