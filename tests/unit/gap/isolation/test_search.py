"""Every effect is fitted under each supposition of the person; the strongest are solved again."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from gap_movement import CHANNELS
from made_up_evidence import (
    COLUMNS,
    ERROR,
    GAIN,
    LABELS,
    LOOSE,
    SAME,
    bare,
    records,
    supposed_residuals,
)
from made_up_hypotheses import (
    DAMPING,
    FUNCTIONS,
    MASS,
    SIZE,
    TASKS,
    noise,
    residual,
)
from scipy.special import logsumexp

from scapulohumeral.gap.isolation import empirical_bayes, search
from scapulohumeral.gap.isolation.empirical_bayes import SCATTER, of_person, others_of
from scapulohumeral.gap.isolation.hypothesis import strongest
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence
from scapulohumeral.gap.isolation.pairs import paired
from scapulohumeral.gap.isolation.search import fit_all, screened_only
from scapulohumeral.gap.isolation.suppositions import Supposition, integrated, supposed
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS
from scapulohumeral.gap.residual.differences import Fold
from scapulohumeral.gap.residual.noise import log_density_of_scatter
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import unknown_input_evidence

pytestmark = pytest.mark.unit


@pytest.fixture
def evidence():
    return bare()


def solved_at(linear, x):
    """The same hypothesis as if movements had been solved with parameters (P,)."""
    return replace(linear, at=x, value=(linear.slope @ x)[:, None])


def solving(monkeypatch, gain):
    """Solves again with so much more evidence; None where it fails."""
    asked = []

    def refit_or_keep(first, residual_, *_):
        asked.append((first.label, *supposed(first), residual_.moved_deg))
        if gain is None:
            return None
        own = empirical_bayes.fit(first.hypothesis, residual_, ERROR)
        solved = replace(own, hypothesis=solved_at(first.hypothesis, own.x))
        return solved.with_evidence(own.log_evidence + gain)

    monkeypatch.setattr(search, "_refit_or_keep", refit_or_keep)
    return asked


def test_effects_are_fitted_under_all_suppositions_but_records_once(evidence):
    assert set(evidence.fits) == {Supposition(f, s) for f in (1.0, 10.0) for s in (0.0, 6.0)}
    for one, fits in evidence.fits.items():
        labels = [f.label for f in fits]
        body = [DAMPING.label, MASS.label]
        assert labels == (body if one.stiffness > 1.0 else [*body, GAIN.label])
        for f in fits:
            assert supposed(f) == one
            residual_ = evidence.residuals[one.moved_deg]
            assert (
                f.log_evidence == empirical_bayes.fit(f.hypothesis, residual_, ERROR).log_evidence
            )
        person = of_person(evidence.fits, one)
        assert sorted(f.label for f in person) == sorted([*body, GAIN.label])
        assert {f.moved_deg for f in person} == {one.moved_deg}


def test_screened_effects_are_integrated(evidence):
    every = [f for fits in evidence.fits.values() for f in fits]
    expected = integrated(every, evidence.suppositions)
    found = screened_only(evidence)
    assert [f.label for f in found.integrated] == [f.label for f in expected]
    assert [f.log_evidence for f in found.integrated] == [f.log_evidence for f in expected]
    assert set(found.every) == set(every)


@pytest.mark.parametrize(("gain", "counts"), [(9.0, True), (-9.0, False)])
def test_a_new_solution_counts_only_with_more_evidence(evidence, monkeypatch, gain, counts):
    """It replaces the derivative under the supposition that it was solved with, and no other.

    Each effect is solved with both degrees of stiffness.
    """
    [first] = strongest(evidence.screened, evidence.prior, 1)
    asked = solving(monkeypatch, gain)
    found = fit_all(evidence, None, 1, [])
    other = supposed(first)._replace(stiffness=11.0 - supposed(first).stiffness)
    tried = [supposed(first), other]
    assert asked == [(DAMPING.label, *one, one.moved_deg) for one in tried]
    before = {
        supposed(f): f.log_evidence
        for fits in evidence.fits.values()
        for f in fits
        if f.label == DAMPING.label
    }
    after = {supposed(f): f.log_evidence for f in found.every if f.label == DAMPING.label}
    for one in tried:
        before[one] += gain if counts else 0.0
    assert after == pytest.approx(before)
    [whole] = [f for f in found.integrated if f.label == DAMPING.label]
    assert supposed(whole) == supposed(first)
    [expected] = integrated(
        [f for f in found.every if f.label == DAMPING.label], evidence.suppositions
    )
    assert whole.log_evidence == expected.log_evidence


def test_a_solved_cause_is_judged_with_every_other_movement(monkeypatch):
    """Solved, it may need no other movement where its derivative did."""
    wrong = tuple(replace(h, slope=0.2 * h.slope) for h in LOOSE)
    case = bare(known={1.0: wrong})
    right = fit(LOOSE[0], SAME, ERROR)

    def refit_or_keep(first, residual_, *_):
        return fit(solved_at(LOOSE[0], right.x), residual_, ERROR)

    monkeypatch.setattr(search, "_refit_or_keep", refit_or_keep)
    found = {supposed(f): f for f in fit_all(case, None, 1, []).every if f.label == DAMPING.label}
    for size, residual_ in case.residuals.items():
        expected = fit(LOOSE[0], residual_, ERROR).log_evidence
        assert found[Supposition(1.0, size)].log_evidence == pytest.approx(expected, abs=0.01)


@pytest.mark.parametrize(("ends", "times"), [(0.2, 1), (0.3, 2)])
def test_movements_are_solved_once_more_where_parameters_end_far_from_them(
    monkeypatch, ends, times
):
    case, asked = bare(known={1.0: LOOSE}), []

    def refit_or_keep(first, residual_, *_):
        asked.append(first.label)
        own = fit(first.hypothesis, residual_, ERROR)
        return replace(
            own, hypothesis=solved_at(LOOSE[0], own.x - ends * DAMPING.params[0].prior_sd)
        )

    monkeypatch.setattr(search, "_refit_or_keep", refit_or_keep)
    fit_all(case, None, 1, [])
    assert asked == [DAMPING.label] * times


def test_an_effect_that_is_not_worth_solving_takes_no_place(evidence, monkeypatch):
    """Nor does one on the record, which needs no solution."""
    asked = solving(monkeypatch, 0.0)
    monkeypatch.setattr(
        search, "_near", lambda able, *_: [f for f in able if f.label != DAMPING.label]
    )
    fit_all(evidence, None, 1, [])
    assert {label for label, *_ in asked} == {MASS.label, GAIN.label}


def test_an_effect_that_cannot_be_solved_is_a_linear_estimate_and_said_so(evidence, monkeypatch):
    solving(monkeypatch, None)
    warnings = []
    found = fit_all(evidence, None, 1, warnings)
    assert warnings == [f"{DAMPING.label}: not solved again; its amplitude is a linear estimate"]
    kept = {f.label: f.log_evidence for f in found.integrated}
    screened = {f.label: f.log_evidence for f in evidence.screened}
    assert {label: kept[label] for label in screened} == pytest.approx(screened)


def test_what_predicts_nothing_is_not_solved_again(monkeypatch):
    asked = solving(monkeypatch, 9.0)
    fit_all(bare(residual(np.zeros(SIZE))), None, 1, [])
    assert asked == []


def test_without_reference_trials_errors_of_the_record_are_not_solved_again(monkeypatch):
    """The prediction follows them: they are small, so linear."""
    same = residual(LOOSE[2].slope @ np.ones(LOOSE[2].slope.shape[1]) + noise(1))
    for referenced in (True, False):
        asked = solving(monkeypatch, 9.0)
        fit_all(bare(same, records=records(referenced=referenced)), None, 1, [])
        assert (GAIN.label in [label for label, *_ in asked]) is referenced


def test_effects_that_are_paired_act_on_one_person(evidence, monkeypatch):
    """Also those of different parameters; a pair on the record is looked for once."""
    seen = []

    def both(singles, *rest):
        body = {f.hypothesis.stiffness for f in singles if f.hypothesis.effects[0].changes_body}
        seen.append((*body, *{f.moved_deg for f in singles}))
        assert rest[1].moved_deg == singles[0].moved_deg
        assert len(singles) == len(LOOSE)
        return paired(singles, *rest)

    monkeypatch.setattr(search, "paired", both)
    monkeypatch.setattr(search, "CLOSE", np.inf)
    solving(monkeypatch, 5.0)
    found = fit_all(evidence, None, 1, [])
    assert sorted(seen) == [(1.0, 0.0), (1.0, 6.0), (10.0, 0.0), (10.0, 6.0)]
    pairs = [f for f in found.every if " + " in f.label]
    for label in {f.label for f in pairs}:
        assert sorted(supposed(f) for f in pairs if f.label == label) == sorted(
            evidence.suppositions
        )


def test_pairs_are_looked_for_under_probable_suppositions_only(evidence, monkeypatch):
    solving(monkeypatch, 0.0)
    best = {
        one: max(f.log_evidence for f in of_person(evidence.fits, one)) for one in evidence.fits
    }
    kept = {one for one, log in best.items() if log > max(best.values()) - search.CLOSE}
    assert 0 < len(kept) < len(best)
    found = fit_all(evidence, None, 1, [])
    assert {supposed(f) for f in found.every if " + " in f.label} == kept


def test_what_is_no_effect_is_integrated_over_other_movements():
    """No gap supposes the same movement, another one any size of it, the rest either."""
    residuals = {**supposed_residuals(), 18.0: replace(SAME, covariance=2.0 * SAME.covariance)}
    found = others_of(residuals, COLUMNS)
    nothing = {size: no_gap_evidence(one) for size, one in residuals.items()}
    smooth = {size: unknown_input_evidence(one, COLUMNS) for size, one in residuals.items()}
    assert found[NO_GAP] == nothing[0.0]
    assert found[MOVED] == pytest.approx(logsumexp([nothing[6.0], nothing[18.0]]) - np.log(2.0))
    weights = np.log([0.5, 0.25, 0.25])
    assert found[NONE] == pytest.approx(logsumexp(np.array(list(smooth.values())) + weights))
    assert MOVED not in others_of({0.0: SAME}, COLUMNS)
    assert others_of({0.0: SAME}, COLUMNS)[NONE] == pytest.approx(smooth[0.0])


@pytest.mark.parametrize(
    ("markers", "electrodes"), [(1.0, 1.0), (0.5, 0.5), (0.25, 1.0), (1.0, 0.25)]
)
def test_sessions_change_as_much_as_is_most_probable(monkeypatch, markers, electrodes):
    """Markers and electrodes each by a share; signature errors and other movements are asked for
    beside; the cautious comparison has all of both."""
    names = (*KINEMATIC_CHANNELS, *CHANNELS)
    size = len(FUNCTIONS.T) * len(TASKS) * len(names)
    of_emg = np.tile(np.repeat([name in CHANNELS for name in names], len(FUNCTIONS.T)), len(TASKS))
    noise_ = 0.01 * np.eye(size)
    scale = np.where(of_emg, electrodes, markers)
    delta = scale * np.random.default_rng(31).normal(size=size)
    degrees = (8.0,) * len(TASKS)
    same = Residual(delta, noise_, noise_, FUNCTIONS, TASKS, names, degrees)

    def total(noise__, signatures, functions, channels, model, shares):
        assert (channels, model) == (names, None)
        return noise__ + np.diag(np.where(of_emg, shares.electrodes, shares.markers) ** 2)

    monkeypatch.setattr(empirical_bayes, "total_covariance", total)
    monkeypatch.setattr(
        empirical_bayes, "other_movement", lambda base, *_: np.ones((size, size)) / size
    )
    monkeypatch.setattr(empirical_bayes, "SIZES_DEG", (6.0,))
    columns = SimpleNamespace(columns=np.random.default_rng(6).normal(size=(size, 4)))
    start = bare(same, residuals={0.0: same}, known={1.0: ()}, unknown_inputs=columns)
    found = empirical_bayes.most_probable(start)
    assert found.session_shares == (markers, electrodes)
    np.testing.assert_allclose(np.diag(found.residual.covariance), 0.01 + scale**2)
    np.testing.assert_allclose(np.diag(found.cautious.covariance), 1.01)
    assert set(found.residuals) == {0.0, 6.0}
    moved = found.residuals[6.0].covariance - found.residual.covariance
    np.testing.assert_allclose(moved, 36.0 / size, atol=1e-9)
    assert set(found.fits) == set(found.suppositions)


@pytest.mark.parametrize("factor", [1.0, *SCATTER])
def test_a_task_scatters_as_much_as_is_most_probable(monkeypatch, factor):
    """What its repeats say is a prior of five degrees of freedom, and all of the cautious one."""
    told = 0.5 * np.eye(SIZE)
    rows = SAME.rows(["a"])
    delta = np.sqrt(0.5) * np.sign(noise(41))
    delta[rows] *= factor
    same = replace(SAME, delta=delta, covariance=told, noise=told, degrees=(5.0, 5.0))
    fold = Fold("a", same.part(["a"]), None)
    monkeypatch.setattr(empirical_bayes, "total_covariance", lambda repeats, *_: repeats)
    monkeypatch.setattr(empirical_bayes, "other_movement", lambda *_: np.zeros((SIZE, SIZE)))
    nothing = SimpleNamespace(columns=np.zeros((SIZE, 1)))
    start = bare(
        same, residuals={0.0: same}, folds=(fold,), known={1.0: ()}, unknown_inputs=nothing
    )
    found = empirical_bayes.most_probable(start)
    assert found.scatter == {("a", "kinematics"): factor, ("b", "kinematics"): 1.0}
    np.testing.assert_allclose(np.diag(found.residual.noise)[rows], 0.5 * factor**2)
    np.testing.assert_allclose(np.diag(found.cautious.noise), 0.5)
    np.testing.assert_allclose(np.diag(found.folds[0].left_out.noise), 0.5 * factor**2)


def test_how_much_a_task_scatters_is_believed_as_its_repeats_say():
    """Scaled inverse chi-squared: its density by the logarithm of the factor."""
    factors = np.geomspace(0.2, 20.0, 2001)
    density = np.exp([log_density_of_scatter(f, 5.0) for f in factors])
    drawn = np.sqrt(5.0 / np.random.default_rng(0).chisquare(5.0, 100_000))
    share = np.trapezoid(density * (factors > 1.4), np.log(factors)) / np.trapezoid(
        density, np.log(factors)
    )
    assert share == pytest.approx(np.mean(drawn > 1.4), abs=0.01)


def test_an_effect_that_stays_far_behind_is_not_solved_again(evidence, monkeypatch):
    asked = solving(monkeypatch, 9.0)
    monkeypatch.setattr(search, "BEHIND", -1e6)
    fit_all(evidence, None, 1, [])
    assert {label for label, *_ in asked} <= {GAIN.label}


def test_of_simulations_solutions_count_and_all_that_come_near_are_solved(evidence, monkeypatch):
    simulated = replace(evidence.settings, of_simulations=True)
    monkeypatch.setattr(search, "BEHIND_OF_SIMULATIONS", 1e6)
    asked = solving(monkeypatch, -9.0)
    found = fit_all(replace(evidence, settings=simulated), None, 1, [])
    near = {label for label, *_ in asked}
    assert len(near) > simulated.short_list
    before = {
        (f.label, supposed(f)): f.log_evidence for fits in evidence.fits.values() for f in fits
    }
    after = {(f.label, supposed(f)): f.log_evidence for f in found.every if f.label in LABELS}
    changes = {key: before[key] - value for key, value in after.items()}
    lost = {key: change for key, change in changes.items() if abs(change) > 1e-3}
    assert {label for label, _ in lost} == near
    assert list(lost.values()) == pytest.approx([9.0] * len(asked))


@pytest.mark.parametrize(
    ("families", "labels"), [(1, {DAMPING.label}), (2, {DAMPING.label, MASS.label})]
)
def test_the_strongest_of_different_families_are_solved_again(
    evidence, monkeypatch, families, labels
):
    """As many families as the settings say; the rest stays as derivatives have it."""
    asked = solving(monkeypatch, 0.0)
    monkeypatch.setattr(search, "BEHIND", 1e6)
    settings = replace(evidence.settings, short_list=families)
    fit_all(replace(evidence, settings=settings), None, 1, [])
    assert {label for label, *_ in asked} - {GAIN.label} == labels
    asked.clear()
    monkeypatch.setattr(search, "family", lambda label: "the same")
    fit_all(replace(evidence, settings=settings), None, 1, [])
    assert {label for label, *_ in asked} - {GAIN.label} == {DAMPING.label}


@pytest.mark.parametrize("most", [1, 2])
def test_of_simulations_the_strongest_are_solved_of_whatever_family(evidence, monkeypatch, most):
    """As many as an answer has time for."""
    simulated = replace(evidence.settings, of_simulations=True)
    monkeypatch.setattr(search, "MOST_OF_SIMULATIONS", most)
    monkeypatch.setattr(search, "BEHIND_OF_SIMULATIONS", 1e6)
    monkeypatch.setattr(search, "family", lambda label: "the same")
    asked = solving(monkeypatch, 9.0)
    fit_all(replace(evidence, settings=simulated), None, 1, [])
    body = [f for f in evidence.screened if f.label != GAIN.label]
    ranked = [f.label for f in strongest(body, evidence.prior, most)]
    assert {label for label, *_ in asked} == {*ranked, GAIN.label}
