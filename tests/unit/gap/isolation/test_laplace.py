"""Evidence and amplitudes on made-up signatures, where the answer is known."""

from dataclasses import replace

import numpy as np
import pytest
from made_up_hypotheses import (
    DAMPING,
    EFFECTS,
    GAIN,
    LOAD,
    MASS,
    SIZE,
    TASKS,
    hypothesis,
    noise,
    residual,
)
from places import REPOSITORY
from scipy.optimize import lsq_linear
from scipy.stats import chi2, kstest, multivariate_normal

from scapulohumeral.gap.isolation.hypothesis import Hypothesis, pair
from scapulohumeral.gap.isolation.laplace import _least, fit, no_gap_evidence, task_agreement
from scapulohumeral.gap.isolation.model_error import (
    COMMON_FACTOR,
    SPREAD_SHARE,
    TASK_FACTOR,
    SignatureError,
    change_error,
)
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS
from scapulohumeral.gap.residual.axes import SHAPE_ERROR, SHAPE_SHARED
from scapulohumeral.gap.residual.unknown_input import unknown_input_evidence
from scapulohumeral.gap.result import Candidate, Entered
from scapulohumeral.gap.verdict.baselines import baseline_labels
from scapulohumeral.gap.verdict.candidates import amplitudes, hint
from scapulohumeral.gap.verdict.isolability import distance, next_trial, separability
from scapulohumeral.gap.verdict.posterior import Posterior, Score
from scapulohumeral.gap.weighing import read_weighing

pytestmark = pytest.mark.unit

CALIBRATION = REPOSITORY / "config/gap/calibration.json"
SHARES = {"a": 0.4, "b": 0.6, "c": 0.7}


def drawn(predicted, relative, seed):
    """A difference whose channels follow a prediction as well as the signature error says."""
    rng = np.random.default_rng(seed)
    person = np.tile(COMMON_FACTOR * relative * rng.normal(size=SIZE // 8), 2)
    factors = 1.0 + person + TASK_FACTOR * relative * rng.normal(size=SIZE // 4)
    shape = SHAPE_ERROR["kinematics"] * relative * np.sqrt(np.mean(predicted**2))
    alike = np.tile(rng.normal(size=SIZE // 2), 2)
    curves = np.sqrt(SHAPE_SHARED) * alike + np.sqrt(1.0 - SHAPE_SHARED) * rng.normal(size=SIZE)
    return np.repeat(factors, 4) * predicted + shape * curves + noise(seed)


def amplitude_misses(relative_error):
    """Errors of fitted amplitudes in units of their own standard deviations."""
    h, misses = hypothesis(DAMPING, 1), []
    for seed in range(40):
        found = fit(h, residual(drawn(h.slope @ [1.2], relative_error, seed)), relative_error)
        misses.append((found.x[0] - 1.2) / np.sqrt(found.covariance[0, 0]))
    return np.array(misses)


@pytest.fixture(name="loud")
def _loud():
    """A difference whose covariance is neither diagonal nor of volume one."""
    root = np.random.default_rng(8).normal(size=(SIZE, SIZE))
    covariance = 0.05 * root @ root.T + 0.3 * np.eye(SIZE)
    delta = np.linalg.cholesky(covariance) @ noise(9)
    return replace(residual(delta), covariance=covariance, noise=0.5 * covariance)


def test_evidence_of_no_gap_is_the_density_of_the_difference(loud):
    expected = multivariate_normal(np.zeros(SIZE), loud.covariance).logpdf(loud.delta)
    assert no_gap_evidence(loud) == pytest.approx(expected)
    assert loud.log_volume == pytest.approx(0.5 * np.linalg.slogdet(loud.covariance)[1])


def exact_evidence(h, there, draws=400_000):
    """Log density of a difference integrated over the prior of what a hypothesis allows.

    The density for all values, times the share of the posterior that is allowed over the prior's.
    """
    slope = h.slope * h.prior_sd
    everywhere = multivariate_normal(np.zeros(SIZE), there.covariance + slope @ slope.T)
    weighted = np.linalg.solve(there.covariance, slope)
    spread = np.linalg.inv(slope.T @ weighted + np.eye(slope.shape[1]))
    mean, rng = spread @ weighted.T @ there.delta, np.random.default_rng(0)
    normal = rng.normal(size=(draws, len(mean)))
    low, high = (bound / h.prior_sd for bound in h.bounds)
    share = []
    for z in (mean + normal @ np.linalg.cholesky(spread).T, normal):
        inside = np.all((low <= z) & (z <= high), axis=1)
        share.append(np.mean(inside & np.all([z[:, i] <= z[:, j] for i, j in h.order], axis=0)))
    return everywhere.logpdf(there.delta) + np.log(share[0] / share[1])


@pytest.mark.parametrize(
    ("effect", "true"),
    [
        (DAMPING, [1.2]),
        (DAMPING, [0.0]),
        (DAMPING, [-0.5]),
        (DAMPING, [3.0]),
        (DAMPING, [4.0]),
        (GAIN, [-1.0, -0.4]),
        (GAIN, [-0.5, -0.5]),
        (GAIN, [-0.5, 0.1]),
        (GAIN, [0.0, 0.0]),
    ],
)
def test_evidence_of_an_effect_is_the_density_integrated_over_its_prior(loud, effect, true):
    """Of damping, from 0 to 3, and of two factors that are one at most, in one order."""
    h = hypothesis(effect, 1, size=0.5 if effect is DAMPING else 1.5)
    there = replace(loud, delta=loud.delta + h.slope @ true)
    assert fit(h, there, 0.0).log_evidence == pytest.approx(exact_evidence(h, there), abs=0.15)


def test_an_effect_that_nothing_tells_of_has_the_evidence_of_no_gap(loud):
    for effect in (DAMPING, GAIN):
        h = hypothesis(effect, 1, size=1e-6)
        assert fit(h, loud, 0.0).log_evidence == pytest.approx(no_gap_evidence(loud), abs=0.02)


def without_far_bounds(effect):
    """The same with no bound but those where it is absent."""
    [param] = effect.params
    low = param.low if param.low == param.off else 1e-9 * param.low
    return replace(effect, params=(replace(param, low=low, high=1e9 * param.high),))


@pytest.mark.parametrize("weight", [1.0, 0.2])
def test_evidence_of_some_weight_is_that_of_noise_as_much_larger(loud, weight):
    """Between causes of one and of two parameters, whose evidence has to tell them apart."""
    # The exact densities know no bounds but that at zero, which both share.
    first, second = (
        hypothesis(without_far_bounds(effect), seed, size=3.0)
        for effect, seed in ((DAMPING, 1), (MASS, 2))
    )
    delta = loud.delta + first.slope @ [1.2] + second.slope @ [0.2]
    there = replace(loud, delta=delta)
    weighing = replace(read_weighing(CALIBRATION), evidence=weight, held_out=0.0)
    found, exact = [], []
    for h in (first, pair(*(fit(one, there, 0.0) for one in (first, second)))):
        one = fit(h, there, 0.0)
        score = Score(0.0, one.log_evidence, None, directions=one.directions)
        found.append(score.log_weight(weighing))
        slope = h.slope * h.prior_sd
        covariance = there.covariance / weight + slope @ slope.T
        exact.append(multivariate_normal(np.zeros(SIZE), covariance).logpdf(delta))
    assert found[1] - found[0] == pytest.approx(exact[1] - exact[0])


def test_evidence_knows_the_error_of_a_prediction(loud):
    """With the error that the fitted amplitude has, as part of the covariance."""
    h = hypothesis(DAMPING, 1, size=0.5)
    there = replace(loud, delta=loud.delta + h.slope @ [1.2])
    found = fit(h, there, 0.3)
    root = np.linalg.cholesky(there.covariance)
    error = np.linalg.inv(h.error(found.x, there, 0.3).solve(np.eye(SIZE)))
    slope = h.slope * h.prior_sd
    whole = root @ error @ root.T + slope @ slope.T
    expected = multivariate_normal(np.zeros(SIZE), 0.5 * (whole + whole.T)).logpdf(there.delta)
    assert found.log_evidence == pytest.approx(expected + np.log(2.0), abs=0.02)


def test_evidence_of_smooth_forces_is_a_mean_of_densities(loud):
    box = np.random.default_rng(4).normal(size=(SIZE, 5))
    sizes = (0.3, 3.0)
    logs = [
        multivariate_normal(np.zeros(SIZE), loud.covariance + s**2 * box @ box.T).logpdf(loud.delta)
        for s in sizes
    ]
    expected = np.logaddexp(*logs) - np.log(2.0)
    assert unknown_input_evidence(loud, box, sizes) == pytest.approx(expected)


def test_amplitudes_are_those_of_the_data_alone():
    h = hypothesis(DAMPING, 1, size=0.4)
    case = residual(h.slope @ [1.2] + noise(100))
    found = fit(h, case, 0.0)
    square = float(h.slope[:, 0] @ h.slope[:, 0])
    alone, half = float(h.slope[:, 0] @ case.delta) / square, 1.96 / np.sqrt(square)
    [plain], [tempered] = amplitudes(found, 1.0), amplitudes(found, 2.0)
    assert found.x[0] < 0.95 * alone
    assert plain.value == pytest.approx(alone) == tempered.value
    np.testing.assert_allclose(plain.ci95, (alone - half, alone + half))
    np.testing.assert_allclose(np.ptp(tempered.ci95), np.sqrt(2.0) * np.ptp(plain.ci95))


def test_amplitudes_that_the_data_hardly_know_keep_their_prior():
    h = hypothesis(DAMPING, 1, size=0.05)
    found = fit(h, residual(h.slope @ [1.2] + noise(100)), 0.0)
    [plain] = amplitudes(found, 1.0)
    assert plain.value == pytest.approx(found.x[0])


def left(found, case):
    """Whitened difference that a fit leaves, (D,)."""
    return case.axes.whiten(case.delta - found.predicted)


def misfit(found, case, relative_error):
    """Mean square of what a fit leaves, in units of noise and of the errors of its prediction."""
    error = found.hypothesis.error(found.x, case, relative_error)
    return error.squares(left(found, case)) / SIZE


@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_misfit_is_the_mean_square_over_what_is_assumed(scale):
    h = hypothesis(DAMPING, 1)
    cases = [residual(h.slope @ [1.2] + scale * noise(seed)) for seed in range(100, 140)]
    found = [misfit(fit(h, case, 0.0), case, 0.0) for case in cases]
    assert np.mean(found) == pytest.approx(scale**2, rel=0.1)
    other = residual(drawn(h.slope @ [1.2], 0.3, 1))
    assert misfit(fit(h, other, 0.3), other, 0.3) < 1.5


@pytest.mark.parametrize("relative_error", [0.0, 0.1, 0.3, 0.4, 0.8])
def test_amplitude_is_found_within_its_interval(relative_error):
    assert np.mean(np.abs(amplitude_misses(relative_error)) < 1.96) > 0.85


@pytest.mark.parametrize("relative_error", [0.0, 0.1, 0.3, 0.4])
def test_amplitude_is_found_without_bias(relative_error):
    """At 0.8, factors of persons spread by 1.4, and amplitudes are too small by one deviation."""
    assert abs(np.mean(amplitude_misses(relative_error))) < 0.6


def test_amplitude_stays_inside_its_bounds():
    h = hypothesis(DAMPING, 1)
    assert fit(h, residual(h.slope @ [-2.0]), 0.0).x[0] == 0.0
    assert fit(h, residual(h.slope @ [30.0]), 0.0).x[0] == pytest.approx(3.0)


def test_weaker_fibres_of_which_more_are_left_are_found():
    h = hypothesis(GAIN, 1)
    x = fit(h, residual(h.slope @ [-1.0, -0.4]), 0.0).x
    np.testing.assert_allclose(x, [-1.0, -0.4], atol=0.02)


def test_what_is_left_of_the_fibres_is_no_stronger_than_it_was():
    """Fewer, but stronger fibres would be a gain of EMG: the best of equal shares is found."""
    h, true = hypothesis(GAIN, 1), np.array([-0.4, -1.0])
    case = residual(h.slope @ true)
    found = fit(h, case, 0.0)
    assert found.x[0] == found.x[1]
    for share in np.linspace(-1.5, 0.0, 50):
        assert np.sum((h.slope @ (true - share)) ** 2) > 0.999 * np.sum(left(found, case) ** 2)


def test_the_right_effect_has_most_evidence():
    right, wrong = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    there = residual(right.slope @ [1.5] + noise(3))
    box = np.random.default_rng(4).normal(size=(SIZE, 20))
    found = fit(right, there, 0.2)
    assert np.sum(left(found, there) ** 2) < 1.5 * SIZE
    assert found.log_evidence > fit(wrong, there, 0.2).log_evidence + 10
    assert found.log_evidence > no_gap_evidence(there) + 10
    assert found.log_evidence > unknown_input_evidence(there, box) + 10


def test_pure_noise_speaks_for_no_gap():
    for seed in range(10):
        nothing = residual(noise(seed))
        found = fit(hypothesis(GAIN, 1), nothing, 0.2)
        assert no_gap_evidence(nothing) > found.log_evidence - 1.0


def test_a_smooth_unknown_cause_speaks_for_the_black_box():
    box = 2.0 * np.random.default_rng(4).normal(size=(SIZE, 20))
    there = residual(box @ np.random.default_rng(5).normal(size=20) + noise(6))
    assert unknown_input_evidence(there, box) > fit(hypothesis(DAMPING, 1), there, 0.2).log_evidence


def test_two_causes_are_found_as_a_pair():
    one, two = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    there = residual(one.slope @ [1.5] + two.slope @ [0.2] + noise(3))
    both = fit(pair(fit(one, there, 0.2), fit(two, there, 0.2)), there, 0.2)
    assert both.label == "body/joint_damping/GH + body/segment_mass/forearm"
    np.testing.assert_allclose(both.x, [1.5, 0.2], atol=0.15)
    assert both.log_evidence > fit(one, there, 0.2).log_evidence


def test_tasks_that_ask_for_different_amplitudes_disagree():
    h = hypothesis(DAMPING, 1)
    same = residual(h.slope @ [1.5] + noise(3))
    p, rows = task_agreement(h, same, 0.0, 1.0)
    assert p > 0.05
    assert [row.task for row in rows] == list(TASKS)
    factor = np.repeat([0.5, 1.5], SIZE // 2)
    p, _ = task_agreement(h, residual(factor * (h.slope @ [1.5])), 0.0, 1.0)
    assert p < 1e-3
    # What is left is larger than noise was taken to be: so are the errors of what tasks ask for.
    doubted, _ = task_agreement(h, residual(factor * (h.slope @ [1.5])), 0.0, 4.0)
    assert chi2.isf(doubted, 1) == pytest.approx(chi2.isf(p, 1) / 4.0)
    assert task_agreement(h.part(same.rows(["a"])), same.part(["a"]), 0.0, 1.0)[0] is None


def test_tasks_that_agree_about_the_first_parameter_alone_disagree():
    """The first asks for the same in both tasks, the second for the contrary."""
    one, two = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    both = pair(fit(one, residual(noise(3)), 0.2), fit(two, residual(noise(3)), 0.2))
    turned = np.repeat([1.0, -1.0], SIZE // 2)
    change = one.slope @ [1.5] + turned * (two.slope @ [1.0])
    p, rows = task_agreement(both, residual(change + noise(3)), 0.0, 1.0)
    assert rows[0].x == pytest.approx(rows[1].x, abs=4 * rows[0].sd)
    assert p < 1e-3
    agreeing = one.slope @ [1.5] + two.slope @ [1.0]
    assert task_agreement(both, residual(agreeing + noise(3)), 0.0, 1.0)[0] > 0.01


def test_tasks_that_ask_for_different_amplitudes_beyond_a_bound_disagree():
    """At the bound, which both fits end on, they would agree."""
    h = hypothesis(DAMPING, 1)
    _, high = h.bounds
    factor = np.repeat([1.2, 6.0], SIZE // 2)
    p, rows = task_agreement(h, residual(factor * (h.slope @ high) + noise(3)), 0.0, 1.0)
    assert p < 1e-3
    assert rows[1].x > 3.0 * rows[0].x > 3.0 * high[0]


def with_quiet_task(share):
    """A cause that shows in task b by a share of what it does elsewhere."""
    h = hypothesis(DAMPING, 1)
    quiet = np.repeat([1.0, share], SIZE // 2)[:, None]
    return replace(h, slope=quiet * h.slope)


def test_a_task_that_tells_nothing_is_asked_for_no_amplitude():
    """Its estimate is the prior's, zero, which no other task has to agree with."""
    h = with_quiet_task(1e-3)
    p, rows = task_agreement(h, residual(h.slope @ [2.5] + noise(3)), 0.0, 1.0)
    assert p is None
    assert [row.task for row in rows] == ["a"]


def test_tasks_agree_by_chance_where_one_tells_little():
    """The same amplitude in both: P values are uniform, whatever the prior of the amplitude."""
    h = with_quiet_task(0.1)
    found = [
        task_agreement(h, residual(h.slope @ [2.5] + noise(seed)), 0.0, 1.0)[0]
        for seed in range(200)
    ]
    assert kstest(found, "uniform").pvalue > 0.01


def test_equal_signatures_cannot_be_told_apart():
    one, other = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    there = residual(one.slope @ [1.5])
    found = fit(one, there, 0.1)
    twin = Hypothesis(
        (LOAD,), np.zeros(2), np.zeros((SIZE, 1)), np.hstack([one.slope, other.slope]), 1.0
    )
    assert distance(found, twin, there, 0.1) < 0.5
    assert distance(found, other, there, 0.1) > 3.0


def error_covariance(error):
    """I + E, from what the class solves with."""
    return np.linalg.inv(error.solve(np.eye(SIZE)))


def covariance(there, predicted, controlled):
    """Covariance (D, D) of the error of a prediction, whitened in the order of coefficients."""
    error = change_error(there, predicted, 0.3, controlled=controlled)
    along = np.diag(error.variance) + error.rows.T @ error.rows
    turn = there.axes.whiten(np.linalg.cholesky(there.covariance))
    return turn.T @ along @ turn


def test_signature_error_of_an_effect_on_the_record_scales_with_the_prediction():
    there = residual(noise(0), 2.0)
    predicted = np.random.default_rng(1).normal(size=SIZE)
    error = SignatureError([change_error(there, predicted, 0.3, controlled=False)])
    white = predicted / 2.0
    dense = error_covariance(error)
    assert error.logdet == pytest.approx(np.linalg.slogdet(dense)[1])
    np.testing.assert_allclose(
        np.trace(dense), SIZE + 0.09 * (white @ white) * (1.0 + SPREAD_SHARE**2), rtol=1e-9
    )


def test_what_muscles_change_may_show_elsewhere_in_channels_of_the_same_kind():
    """Angles change in one task alone: others may change as much, EMG may not."""
    channels = (*KINEMATIC_CHANNELS[:9], "EMG_a")
    there = replace(residual(noise(0), 2.0), channels=channels)
    predicted = np.zeros(SIZE)
    predicted[:4] = 3.0
    controlled, exact = (covariance(there, predicted, c) for c in (True, False))
    angles, emg = there.channel_rows(channels[:9]), there.channel_rows(channels[9:])
    white = predicted / 2.0
    spread = (SPREAD_SHARE * 0.3) ** 2 * np.mean(white**2)
    shape = (SHAPE_ERROR["kinematics"] * 0.3) ** 2 * np.mean(white[angles] ** 2)
    # The channel that changes may change more or less; exactly known effects know that better.
    factor = 0.3**2 * (COMMON_FACTOR**2 + TASK_FACTOR**2 - 1.0) * np.outer(white, white)
    added = controlled - exact + spread * np.eye(SIZE) - factor
    expected = np.zeros(SIZE)
    expected[angles] = shape
    # A part of it is alike in both tasks.
    alike = np.kron([[1.0, SHAPE_SHARED], [SHAPE_SHARED, 1.0]], np.eye(SIZE // 2))
    np.testing.assert_allclose(added, expected * alike, atol=1e-10)
    np.testing.assert_allclose(added[np.ix_(emg, emg)], 0.0, atol=1e-10)


def test_a_channel_is_off_alike_in_all_tasks():
    there = residual(noise(0))
    predicted = np.random.default_rng(1).normal(size=SIZE)
    error = covariance(there, predicted, controlled=True)
    across = error[:4, SIZE // 2 : SIZE // 2 + 4]
    shape = SHAPE_SHARED * (SHAPE_ERROR["kinematics"] * 0.3) ** 2 * np.mean(predicted**2)
    of_person = (COMMON_FACTOR * 0.3) ** 2 * np.outer(predicted[:4], predicted[SIZE // 2 :][:4])
    np.testing.assert_allclose(across, of_person + shape * np.eye(4), atol=1e-12)


def test_each_effect_of_a_pair_errs_by_itself():
    """A small effect on muscles may not excuse a large one on the record."""
    on_record = next(e for e in EFFECTS.values() if not e.changes_body)
    there = residual(noise(0))
    fits = [
        fit(hypothesis(effect, seed), there, 0.3) for seed, effect in enumerate((LOAD, on_record))
    ]
    x = np.array([0.1, -0.2, *np.full(len(on_record.params), 2.0)])
    alone = [
        error_covariance(f.hypothesis.error(part, there, 0.3)) - np.eye(SIZE)
        for f, part in zip(fits, (x[:2], x[2:]), strict=True)
    ]
    together = error_covariance(pair(*fits).error(x, there, 0.3)) - np.eye(SIZE)
    np.testing.assert_allclose(together, alone[0] + alone[1], atol=1e-9)


def test_effects_on_the_record_are_known_better():
    on_record = next(e for e in EFFECTS.values() if not e.changes_body)
    there = residual(noise(0))
    x = np.full(len(on_record.params), 1.0)
    body, record = hypothesis(LOAD, 1), hypothesis(on_record, 1)
    assert record.error(x, there, 0.3).logdet < body.error(np.ones(2), there, 0.3).logdet


def test_baselines_name_the_cause_where_signatures_differ():
    one, other = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    there = residual(one.slope @ [1.5] + 0.1 * noise(3))
    screened = [fit(h, there, 0.1) for h in (other, one)]
    prior = {f.label: 0.5 for f in screened}
    assert baseline_labels(there, screened, prior) == [
        (method, one.label) for method in ("cosine", "per_sample_bic", "screening")
    ]


def test_baselines_take_an_effect_of_either_sign_and_charge_for_parameters():
    one, other = hypothesis(DAMPING, 1), hypothesis(MASS, 2)
    opposite = residual(one.slope @ [-1.5] + 0.1 * noise(3))
    prior = {f.label: 0.5 for f in (fit(h, opposite, 0.1) for h in (one, other))}
    screened = [fit(h, opposite, 0.1) for h in (other, one)]
    assert [row.label for row in baseline_labels(opposite, screened, prior)][:2] == [
        one.effects[0].label
    ] * 2
    # A rival that holds the same signature, and a second one that hardly helps.
    there = residual(one.slope @ [1.5] + 0.1 * noise(3))
    slope = np.column_stack([one.slope, hypothesis(MASS, 5).slope])
    rival = Hypothesis((LOAD,), np.zeros(2), np.zeros((SIZE, 1)), slope, 1.0)
    screened = [fit(h, there, 0.1) for h in (rival, one)]
    of_samples = baseline_labels(there, screened, {f.label: 0.5 for f in screened})[1]
    assert (of_samples.method, of_samples.label) == ("per_sample_bic", one.effects[0].label)


def test_next_trial_is_the_task_in_which_the_signatures_differ():
    one = hypothesis(DAMPING, 1)
    there = residual(one.slope @ [0.5])
    slope = one.slope.copy()
    slope[there.rows(["b"])] += np.random.default_rng(5).normal(size=slope[::2].shape)
    other = Hypothesis((MASS,), np.zeros(1), np.zeros((SIZE, 1)), slope, 1.0)
    fits = [fit(h, there, 0.1) for h in (one, other)]
    labels = [f.label for f in fits]
    found = next_trial(fits, labels, there, 0.1, 1.0)
    assert (found.task, found.splits) == ("b", tuple(labels))
    assert found.p_correct > separability(fits, there, 0.1, 1.0)[0, 1]
    assert next_trial(fits, labels[:1], there, 0.1, 1.0) is None


def test_no_further_trial_is_asked_for_that_would_hardly_tell():
    """Not between causes that look alike, nor between a cause and a pair that holds it."""
    one = hypothesis(DAMPING, 1)
    there = residual(one.slope @ [0.5])
    alike = Hypothesis((MASS,), np.zeros(1), np.zeros((SIZE, 1)), one.slope, 1.0)
    slope = np.column_stack([one.slope, hypothesis(MASS, 2).slope])
    pair = Hypothesis((DAMPING, MASS), np.zeros(2), np.zeros((SIZE, 2)), slope, 1.0)
    for other in (alike, pair):
        fits = [fit(h, there, 0.1) for h in (one, other)]
        assert next_trial(fits, [f.label for f in fits], there, 0.1, 1.0) is None


def test_effects_are_told_apart_as_far_as_evidence_counts():
    """At a temperature of four, like with noise of twice the size."""
    hypotheses = hypothesis(DAMPING, 1, size=0.3), hypothesis(MASS, 2, size=0.3)
    clear = residual(hypotheses[0].slope @ [1.0])
    fits = [fit(h, clear, 0.0) for h in hypotheses]
    tempered = separability(fits, clear, 0.0, 4.0)[0, 1]
    noisy = separability(fits, residual(clear.delta, 2.0), 0.0, 1.0)[0, 1]
    assert tempered < separability(fits, clear, 0.0, 1.0)[0, 1]
    assert tempered == pytest.approx(noisy, abs=0.03)


def test_hint_names_what_is_closest_and_where_it_enters():
    near = [Candidate(name, "member", 0.1, None, share, None, ()) for name, share in SHARES.items()]
    entered = [
        Entered("dof", name, (0.0, 50.0), 1.0, "N m", 0.01, share, True)
        for name, share in (("GH_rx", 0.2), ("EL_rx", 0.5), ("SC_rz", 0.3))
    ]
    unknown = Posterior(dict.fromkeys(SHARES, 0.1), 0.6, 0.1)
    assert hint(near, unknown, entered) == (
        "the closest known effects are a (leaves 40 % unexplained) and "
        "b (leaves 60 % unexplained); it enters most at EL_rx, SC_rz"
    )
    assert hint(near, unknown, ()).endswith("b (leaves 60 % unexplained)")
    without = [replace(row, unexplained_share=1.0) for row in near]
    assert hint(without, unknown, ()) == "the closest known effects are a and b"
    assert hint(near, Posterior({"a": 0.7, "b": 0.1, "c": 0.1}, 0.1, 0.0), entered) is None


@pytest.mark.parametrize("count", [1, 2, 3])
def test_least_squares_inside_bounds_are_those_of_scipy(count):
    """One and two parameters have ways of their own."""
    rng = np.random.default_rng(count)
    at_bounds = 0
    for _ in range(50):
        root = rng.normal(size=(count + 3, count))
        target = rng.normal(size=count + 3)
        low, high = np.sort(rng.normal(size=(2, count)), axis=0)
        expected = lsq_linear(root, target, (low, high), method="bvls", tol=1e-14).x
        found = _least(root.T @ root, root.T @ target, low, high)
        np.testing.assert_allclose(found, expected, atol=1e-9)
        at_bounds += bool(np.any((found == low) | (found == high)))
    assert 10 < at_bounds < 50
