"""Large amplitudes are found by solving again, where derivatives at the nominal solution miss."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import NODES, SETTINGS, SETUP, small_movement, small_record

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.isolation import refit as refitting
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.refit import refit
from scapulohumeral.gap.nominal.optimal_movement import NEARBY, PREDICTED
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    SensorSetup,
    difference,
    phase_functions,
    predicted,
)
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.signatures import resolve
from scapulohumeral.gap.signatures.linearise import Linearised
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures
from scapulohumeral.gap.signatures.resolve import WARM_ITERATIONS, Near, Resolve, Resolving, Solved
from scapulohumeral.ocp.optimality.sensitivity import Sensitivity

pytestmark = pytest.mark.unit

CHANNELS = ("EMG_a", "EMG_b")
RECORDER = SensorSetup(CHANNELS, np.array([[1.0, 0, 0], [0, 0.5, 0.5]]), False)
WEAK = next(e for e in library(SETUP) if e.label == "body/strength_loss/coracobrachialis")
LEFT, FIBRES_LEFT = 0.45, 0.6


@pytest.fixture(scope="module")
def weakened(quaternion_equations):
    """Nominal response, and the change (N, K) by a muscle of half of its strength."""
    move = small_movement(quaternion_equations)
    point = move.solved(move.body, move.cold_start(), 500)
    mean_record: Observation = small_record()
    local = Linearised(move, move.body, point, mean_record.duration_s, RECORDER)
    slope = local.by_effect(WEAK, np.zeros(2))
    nothing = np.zeros(0)
    of_task = TaskSignatures(
        task="t", mean_record=mean_record, nominal=local.observed, point=point, effects=((slope,),),
        intended=nothing, posture=nothing, session=nothing, followed=(), followed_session=nothing,
        tempo=nothing, tempo_errors=nothing, unmeasured=nothing, followed_unmeasured=nothing,
        slack=nothing, levers=nothing, needed=nothing, drive=move.drive,
    )  # fmt: skip
    weak = WEAK.apply(move.body, np.array([LEFT, FIBRES_LEFT]))
    x = move.trajectory(move.solved(weak, point, 300))
    electrodes = weak.seen * RECORDER.electrodes
    record = predicted(x, mean_record.duration_s, CHANNELS, electrodes, False)
    return move, of_task, difference(record, local.observed)


def screened(of_task, change):
    """A comparison (one task) with a change (N, K) to explain, and weakness fitted to it."""
    functions = phase_functions(NODES, 6)
    scale = np.array([0.2] * 10 + [0.002] * 2)
    covariance = np.diag(np.repeat(scale**2, 6))
    residual = Residual(
        (functions.T @ change).T.ravel(), covariance, covariance, functions, ("t",),
        (*KINEMATIC_CHANNELS, *CHANNELS), (8.0,),
    )  # fmt: skip
    slope = residual.compress([of_task.effects[0][0]])
    hypothesis = Hypothesis((WEAK,), np.zeros(2), np.zeros((72, 1)), slope, 1.0)
    return residual, fit(hypothesis, residual, 0.0)


def left(found, residual):
    """Sum of squares of the whitened difference that a fit leaves."""
    return np.sum(residual.whiten(residual.delta - found.predicted) ** 2)


def resolving(of_task, **settings):
    return Resolving(None, [of_task], RECORDER, replace(SETTINGS, nodes=NODES, **settings))


def test_refit_finds_a_large_loss_of_strength(weakened, monkeypatch):
    move, of_task, change = weakened
    monkeypatch.setattr(resolve, "movement", lambda *_: move)
    residual, first = screened(of_task, change)
    found = refit(first, residual, resolving(of_task, refits=3, signature_error=0.0))
    np.testing.assert_allclose(WEAK.physical(found.x), [LEFT, FIBRES_LEFT], rtol=0.05)
    assert left(found, residual) < left(first, residual)


def resolve_of(weakened):
    move, of_task, _ = weakened
    return Resolve(move, of_task, RECORDER, WARM_ITERATIONS, predicts=True)


def internal(physical):
    return np.array([p.internal(v) for p, v in zip(WEAK.params, physical, strict=True)])


def test_a_solution_is_predicted_to_second_order(weakened):
    person = resolve_of(weakened)
    errors = []
    for share in (0.4, 0.2):
        x = share * internal([LEFT, FIBRES_LEFT])
        start = person._without(WEAK)
        solved = person.solved(WEAK, x)
        errors.append(np.linalg.norm(start.predicted(x).free - solved.near.point.free))
        assert errors[-1] < 0.5 * np.linalg.norm(start.point.free - solved.near.point.free)
    assert errors[0] > 3.0 * errors[1]


def test_a_solution_is_the_same_wherever_it_was_predicted_from(weakened, monkeypatch):
    person, x = resolve_of(weakened), internal([LEFT, FIBRES_LEFT])
    direct = person.solved(WEAK, x)
    from_halfway = person.solved(WEAK, x, person.solved(WEAK, 0.5 * x).near)
    monkeypatch.setattr(
        type(person.move), "_solved", only(type(person.move)._solved, lambda s: s is not PREDICTED)
    )
    for other in (from_halfway, person.solved(WEAK, x)):
        np.testing.assert_allclose(other.change, direct.change, atol=2e-3)
        np.testing.assert_allclose(other.slope, direct.slope, atol=5e-3)


def only(solve, allowed):
    """Solves with allowed settings; others fail."""

    def tried(self, body, start, settings):
        if not allowed(settings):
            raise SolveError("no")
        return solve(self, body, start, settings)

    return tried


def test_what_a_prediction_does_not_reach_is_solved_from_the_other_solution(weakened, monkeypatch):
    move, of_task, _ = weakened
    tried = []

    def never(self, body, start, settings):
        tried.append((settings.max_iterations, settings.far))
        raise SolveError("no")

    monkeypatch.setattr(type(move), "_solved", never)
    for predicts, starts in ((True, [(NEARBY, False), (50, True)]), (False, [(50, True)])):
        tried.clear()
        with pytest.raises(SolveError, match="no"):
            Resolve(move, of_task, RECORDER, 50, predicts).solved(WEAK, np.array([-0.5, 0.0]))
        assert tried == starts


def test_tracked_movements_that_do_not_arrive_end_early(weakened, monkeypatch):
    move, of_task, _ = weakened
    monkeypatch.setattr(resolve, "movement", lambda *_: move)
    assert SETTINGS.iterations > WARM_ITERATIONS
    for view, most in (("tracking", WARM_ITERATIONS), ("prediction", SETTINGS.iterations)):
        settings = replace(SETTINGS, view=view)
        person = Resolve.kept(None, of_task, 1.0, RECORDER, settings)
        assert (person.iterations, person.predicts) == (most, view == "prediction")


def test_movements_are_set_up_once_for_each_stiffness(weakened, monkeypatch):
    move, of_task, _ = weakened
    made = []
    monkeypatch.setattr(resolve, "movement", lambda *_: made.append(1) or move)
    every = resolving(of_task)
    assert every.kept(10.0) is every.kept(10.0)
    assert every.kept(1.0) is not every.kept(10.0)
    assert len(made) == 2


class Curve:
    """Stands in for a movement: its record changes by a function of the first parameter."""

    def __init__(self, of_task, function):
        self.of_task, self.function, self.asked = of_task, function, []

    def solved(self, effect, x, near=None):
        value, slope = self.function(x[0])
        self.asked.append(float(x[0]))
        shape = self.of_task.effects[0][0][0]
        slopes = np.stack([slope * shape, 0.0 * shape])
        response = Sensitivity(np.zeros((1, 2)), np.zeros((1, 2)))
        return Solved(value * shape, slopes, Near(x, self.of_task.point, response))


def on_a_curve(monkeypatch, weakened, function, truth, refits):
    """Where a refit has solved, and where it ends, if the record changes by a function."""
    _, of_task, _ = weakened
    curve = Curve(of_task, function)
    monkeypatch.setattr(resolve.Resolve, "kept", lambda *_: curve)
    change = function(truth)[0] * of_task.effects[0][0][0]
    residual, first = screened(of_task, change)
    found = refit(first, residual, resolving(of_task, refits=refits, signature_error=0.0))
    return curve.asked, found.x[0]


def test_a_linear_effect_is_solved_once(weakened, monkeypatch):
    asked, x = on_a_curve(monkeypatch, weakened, lambda x: (x, 1.0), -0.5, 5)
    assert len(asked) == 1
    assert x == pytest.approx(asked[0], abs=1e-6)


def flat(x):
    """Derivatives are 0.4 of what leads to the truth: every full step goes too far."""
    return 1.5 * x, 0.6


def test_steps_that_turn_back_and_forth_arrive(weakened, monkeypatch):
    near = refitting.ARRIVED * WEAK.params[0].prior_sd
    asked, x = on_a_curve(monkeypatch, weakened, flat, -0.8, 6)
    assert abs(x - asked[-1]) < near
    monkeypatch.setattr(refitting, "_share", lambda *_: 1.0)
    asked, x = on_a_curve(monkeypatch, weakened, flat, -0.8, 6)
    assert abs(x - asked[-1]) > near
