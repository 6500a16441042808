"""What an explanation says of a task left out is a conditional density, by brute force."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_hypotheses import DAMPING, MASS, hypothesis, noise, residual
from scipy.special import logsumexp
from scipy.stats import multivariate_normal

from scapulohumeral.gap.isolation.held_out import left_out, log_predictive, log_predictive_of_others
from scapulohumeral.gap.isolation.hypothesis import pair
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.suppositions import Supposition, integrated, log_weight
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE

pytestmark = pytest.mark.unit

TASKS = ("a", "b")
EVERY = [Supposition(f, size) for f in (1.0, 10.0) for size in (0.0, 6.0)]
HYPOTHESES = {
    1.0: hypothesis(DAMPING, 1, size=0.5),
    10.0: replace(hypothesis(DAMPING, 2, size=0.5), stiffness=10.0),
}
CAUSE = HYPOTHESES[1.0].slope @ [1.5] + HYPOTHESES[10.0].slope @ [1.5]


def residuals(delta=None):
    """The same movement, and another one whose changes both tasks share."""
    same = residual(CAUSE + noise(3) if delta is None else delta)
    shared = np.random.default_rng(5).normal(size=(len(same.delta), 3))
    return {
        0.0: same,
        6.0: replace(same, covariance=same.covariance + shared @ shared.T, moved_deg=6.0),
    }


def normal(there, hypothesis_, rows=slice(None)):
    """The difference with an effect, a linear-Gaussian model, of some coefficients."""
    slope = hypothesis_.slope * hypothesis_.prior_sd
    covariance = there.covariance + slope @ slope.T
    covariance = covariance[rows][:, rows]
    return multivariate_normal(np.zeros(len(covariance)), covariance)


def conditional(there, hypothesis_, known, asked):
    """Log density of some coefficients given others, by mean and covariance."""
    slope = hypothesis_.slope * hypothesis_.prior_sd
    covariance = there.covariance + slope @ slope.T
    gain = covariance[np.ix_(asked, known)] @ np.linalg.inv(covariance[np.ix_(known, known)])
    left = covariance[np.ix_(asked, asked)] - gain @ covariance[np.ix_(known, asked)]
    mean = gain @ there.delta[known]
    return multivariate_normal(mean, 0.5 * (left + left.T)).logpdf(there.delta[asked])


def test_one_effect_predicts_as_a_conditional_density():
    """The prior of an amplitude counts once: the tasks known have told it."""
    there, known = residuals()[0.0], HYPOTHESES[1.0]
    every = [Supposition(1.0, 0.0)]
    found = log_predictive([fit(known, there, 0.0)], {0.0: there}, every, 0.0)
    rows = {task: there.rows([task]) for task in TASKS}
    expected = conditional(there, known, rows["a"], rows["b"])
    expected += conditional(there, known, rows["b"], rows["a"])
    assert found == {known.label: pytest.approx(expected, abs=1e-3)}


def test_suppositions_are_weighed_by_what_the_known_tasks_say_of_them():
    parts = residuals()
    fits = [fit(HYPOTHESES[one.stiffness], parts[one.moved_deg], 0.0) for one in EVERY]
    assert np.ptp([f.log_evidence for f in fits]) > 5.0
    found = log_predictive(fits, parts, EVERY, 0.0)[fits[0].label]
    expected = 0.0
    for task in TASKS:
        asked, known = (
            parts[0.0].rows([t for t in TASKS if (t == task) == own]) for own in (True, False)
        )
        told = [
            log_weight(one, EVERY, body=True)
            + normal(parts[one.moved_deg], HYPOTHESES[one.stiffness], known).logpdf(
                parts[0.0].delta[known]
            )
            for one in EVERY
        ]
        densities = [
            conditional(parts[one.moved_deg], HYPOTHESES[one.stiffness], known, asked)
            for one in EVERY
        ]
        expected += logsumexp(np.array(told) + densities) - logsumexp(told)
    # Suppositions far below the best one are left out.
    assert found == pytest.approx(expected, abs=0.01)


def test_the_others_predict_as_conditional_densities():
    parts = residuals()
    same, other = parts[0.0], parts[6.0]
    nothing = np.zeros((len(same.delta), 1))
    flat = replace(HYPOTHESES[1.0], slope=0.0 * HYPOTHESES[1.0].slope)
    found = log_predictive_of_others(parts, nothing)
    rows = [same.rows([task]) for task in TASKS]

    def both(there):
        return sum(conditional(there, flat, known, asked) for known, asked in (rows, rows[::-1]))

    assert found[NO_GAP] == pytest.approx(both(same), abs=1e-6)
    assert found[MOVED] == pytest.approx(both(other), abs=1e-6)
    assert NONE in found


def test_what_tasks_disagree_about_counts_against_a_cause():
    """Evidence of all tasks may grow where the prediction of each from the other fails."""
    known = hypothesis(DAMPING, 1)
    factor = np.repeat([0.0, 2.0], len(known.slope) // 2)
    every = [Supposition(1.0, 0.0)]
    agreed, apart = (
        residual(known.slope @ [1.5] * by + noise(3)) for by in (np.ones(len(factor)), factor)
    )
    nothing = np.zeros((len(factor), 1))
    gains = []
    for there in (agreed, apart):
        fitted = fit(known, there, 0.0)
        assert fitted.log_evidence > no_gap_evidence(there) + 100.0
        own = log_predictive([fitted], {0.0: there}, every, 0.0)[known.label]
        gains.append(own - log_predictive_of_others({0.0: there}, nothing)[NO_GAP])
    assert gains[0] > 100.0
    assert gains[1] < 0.0


def test_a_pair_pays_for_mimicry_once():
    """Not once for each task that is left out."""
    one, two = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    there = residual(one.slope @ [1.5] + two.slope @ [0.2] + noise(3))
    singles = [fit(h, there, 0.2) for h in (one, two)]
    every = [Supposition(1.0, 0.0)]
    [both] = paired(singles, {f.label: 0.5 for f in singles}, there, 0.2)
    free = fit(pair(*singles), there, 0.2)
    assert both.mimicked == pytest.approx(free.log_evidence - both.log_evidence)
    assert both.mimicked > 1.0
    paid, unpaid = (log_predictive([f], {0.0: there}, every, 0.2)[f.label] for f in (both, free))
    assert unpaid - paid == pytest.approx(both.mimicked)


def test_tasks_are_left_out_one_at_a_time():
    there = residual(noise(1))
    assert left_out(there) == [["b"], ["a"]]
    assert left_out(there.part(["a"])) == []
    [found] = integrated([fit(HYPOTHESES[1.0], there, 0.0)], EVERY[:1])
    alone = there.part(["a"])
    own = replace(found, hypothesis=found.hypothesis.part(there.rows(["a"])))
    assert log_predictive([own], {0.0: alone}, EVERY[:1], 0.0) == {found.label: 0.0}
