"""A label's evidence is the mean over what may be supposed of the person, weighed by the prior."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_hypotheses import DAMPING, EFFECTS, MASS, hypothesis, noise, residual

from scapulohumeral.gap.isolation.hypothesis import pair
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.suppositions import (
    OTHER_MOVEMENT,
    UNDOUBTED,
    Supposition,
    integrated,
    log_odds_of_moving,
    log_weight,
    supposed,
)

pytestmark = pytest.mark.unit

STIFFNESSES, SIZES = (1.0, 10.0, 1000.0), (0.0, 2.0, 6.0)
EVERY = [Supposition(f, size) for f in STIFFNESSES for size in SIZES]
RECORD = next(e for e in EFFECTS.values() if not e.changes_body)
PLAIN = {
    effect.label: fit(hypothesis(effect, 1), residual(noise(2)), 0.1)
    for effect in (DAMPING, MASS, RECORD)
}


def made(effect, one, log_evidence):
    """A fit of an effect under a supposition, with some log evidence."""
    plain = PLAIN[effect.label]
    kept = replace(plain.hypothesis, stiffness=one.stiffness)
    return replace(plain, hypothesis=kept, moved_deg=one.moved_deg, log_evidence=log_evidence)


@pytest.mark.parametrize("sizes", [SIZES, (0.0, 2.0), (0.0,)])
@pytest.mark.parametrize("stiffnesses", [STIFFNESSES, (1.0,)])
def test_what_may_be_supposed_adds_up_to_one(stiffnesses, sizes):
    every = [Supposition(f, size) for f in stiffnesses for size in sizes]
    assert sum(np.exp(log_weight(one, every, body=True)) for one in every) == pytest.approx(1.0)
    on_record = [one for one in every if one.stiffness == 1.0]
    assert sum(np.exp(log_weight(one, every, body=False)) for one in on_record) == pytest.approx(
        1.0
    )


def test_evidence_is_the_mean_over_suppositions_weighed_by_the_prior():
    logs = dict(zip(EVERY, np.random.default_rng(1).normal(-40.0, 3.0, len(EVERY)), strict=True))
    [found] = integrated([made(DAMPING, one, log) for one, log in logs.items()], EVERY)
    moved = OTHER_MOVEMENT[True]
    weights = {
        one: (moved / 2 if one.moved_deg > 0.0 else 1.0 - moved) / len(STIFFNESSES) for one in EVERY
    }
    expected = np.log(sum(weights[one] * np.exp(logs[one]) for one in EVERY))
    assert found.log_evidence == pytest.approx(expected)
    best = max(EVERY, key=lambda one: logs[one] + np.log(weights[one]))
    assert supposed(found) == best


def test_the_prior_decides_between_equal_suppositions():
    """Of a change of the record people know nothing: rarely they move in another way as well."""
    for effect, share in ((DAMPING, OTHER_MOVEMENT[True]), (RECORD, OTHER_MOVEMENT[False])):
        every = [Supposition(1.0, 0.0), Supposition(1.0, 6.0)]
        ahead = np.log((1.0 - share) / share)
        for more, moved_deg in ((ahead + 0.1, 6.0), (ahead - 0.1, 0.0)):
            fits = [made(effect, one, more * (one.moved_deg > 0.0)) for one in every]
            [found] = integrated(fits, every)
            assert found.moved_deg == moved_deg


def test_effects_on_the_record_know_no_stiffness():
    """They are fitted once for each size, and lose nothing to suppositions that are all alike."""
    loosest = [one for one in EVERY if one.stiffness == 1.0]
    [found] = integrated([made(RECORD, one, -7.0) for one in loosest], EVERY)
    assert found.log_evidence == pytest.approx(-7.0)
    [found] = integrated([made(DAMPING, one, -7.0) for one in EVERY], EVERY)
    assert found.log_evidence == pytest.approx(-7.0)
    few = EVERY[:3]
    [one_in_three] = integrated([made(DAMPING, one, -7.0) for one in few], EVERY)
    assert one_in_three.log_evidence == pytest.approx(-7.0 - np.log(3.0))


def test_pairs_with_an_effect_on_the_body_are_integrated_as_it_is():
    both = pair(made(DAMPING, EVERY[0], 0.0), made(RECORD, EVERY[0], 0.0))
    fits = [
        replace(
            PLAIN[DAMPING.label],
            hypothesis=replace(both, stiffness=one.stiffness),
            moved_deg=one.moved_deg,
            log_evidence=-3.0,
        )
        for one in EVERY
    ]
    [found] = integrated(fits, EVERY)
    assert found.log_evidence == pytest.approx(-3.0)


def test_each_label_is_integrated_by_itself():
    fits = [
        made(effect, one, log) for one in EVERY for effect, log in ((DAMPING, -1.0), (MASS, -2.0))
    ]
    found = {f.label: f.log_evidence for f in integrated(fits, EVERY)}
    assert found == pytest.approx({DAMPING.label: -1.0, MASS.label: -2.0})


def test_odds_of_another_movement_are_those_of_its_suppositions():
    logs = dict(zip(EVERY, np.random.default_rng(3).normal(-40.0, 3.0, len(EVERY)), strict=True))
    fits = [made(DAMPING, one, log) for one, log in logs.items()]
    parts = {True: 0.0, False: 0.0}
    for one, log in logs.items():
        parts[one.moved_deg > 0.0] += np.exp(log + log_weight(one, EVERY, body=True))
    found = log_odds_of_moving(fits, EVERY)
    assert found == {DAMPING.label: pytest.approx(np.log(parts[True] / parts[False]))}


def test_what_was_fitted_under_one_movement_alone_is_not_doubted():
    """Nor are odds that no data can have."""
    every = [Supposition(1.0, 0.0), Supposition(1.0, 6.0)]
    same, other = (made(MASS, one, 0.0) for one in every)
    assert log_odds_of_moving([same], every) == {MASS.label: -UNDOUBTED}
    assert log_odds_of_moving([other], every) == {MASS.label: UNDOUBTED}
    sure = log_odds_of_moving([same, other.with_evidence(1e4)], every)
    assert sure == {MASS.label: UNDOUBTED}
