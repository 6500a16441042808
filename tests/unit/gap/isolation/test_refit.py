"""Large amplitudes are found by solving again, where derivatives at the nominal solution miss."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import NODES, SETTINGS, SETUP, small_movement, small_record

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.isolation.refit import WARM_ITERATIONS, refit
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
        unmeasured=nothing, followed_unmeasured=nothing,
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


def test_refit_finds_a_large_loss_of_strength(weakened, monkeypatch):
    move, of_task, change = weakened
    monkeypatch.setattr(resolve, "movement", lambda *_: move)
    residual, first = screened(of_task, change)
    settings = replace(SETTINGS, refits=3, signature_error=0.0, nodes=NODES)
    found = refit(first, residual, [of_task], None, RECORDER, settings)
    np.testing.assert_allclose(WEAK.physical(found.x), [LEFT, FIBRES_LEFT], rtol=0.05)
    assert left(found, residual) < left(first, residual)


def test_warm_solves_that_do_not_arrive_end_early(weakened, monkeypatch):
    move, of_task, change = weakened
    tried = []

    def never(self, effect, x, start):
        tried.append(self.iterations)
        raise SolveError("no")

    monkeypatch.setattr(resolve, "movement", lambda *_: move)
    monkeypatch.setattr(resolve.Resolve, "solved", never)
    residual, first = screened(of_task, change)
    with pytest.raises(SolveError, match="no"):
        refit(first, residual, [of_task], None, RECORDER, SETTINGS)
    assert tried == [WARM_ITERATIONS]
    assert SETTINGS.iterations > WARM_ITERATIONS
