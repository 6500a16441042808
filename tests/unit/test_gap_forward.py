"""A movement with another body is the problem that is set up for it, and hard ones are retried."""

import numpy as np
import pytest
from gap_movement import SETUP, small_movement

from scapulohumeral.errors import SolveError
from scapulohumeral.gap import forward
from scapulohumeral.gap.forward import HASTY, PATIENT, BodyProblem
from scapulohumeral.gap.library import library
from scapulohumeral.ocp.solver import Start

pytestmark = pytest.mark.unit

EFFECTS = {e.label: e for e in library(SETUP)}
CHANGED = {
    "body/hand_load": [1.5, 0.02],
    "body/strength_loss/biceps": [0.4],
    "control/pain_inhibition/biceps": [2.0, 0.5],
    "body/glenoid_orientation": [8.0, -4.0],
}


@pytest.mark.parametrize("label", CHANGED)
@pytest.mark.parametrize("hessian", ["exact", "gauss-newton"])
def test_problem_of_a_body_is_the_one_that_is_set_up_anew(quaternion_equations, label, hessian):
    move = small_movement(quaternion_equations)
    body = EFFECTS[label].apply(move.body, np.array(CHANGED[label]))
    quick = move.problem(body, hessian)
    fresh = BodyProblem(move.forces, body, move._objective(body), hessian)
    free = move.cold_start().free + 0.01 * np.random.default_rng(1).normal(size=quick.num_free)
    multipliers = np.random.default_rng(2).normal(size=quick.num_constraints)
    for one, other in (
        (quick.obj(free), fresh.obj(free)),
        (quick.obj_grad(free), fresh.obj_grad(free)),
        (quick.con(free), fresh.con(free)),
        (quick.con_jac(free), fresh.con_jac(free)),
        (quick.hessian(free, multipliers, 1.0), fresh.hessian(free, multipliers, 1.0)),
        (quick.lower_bound, fresh.lower_bound),
        (quick.upper_bound, fresh.upper_bound),
    ):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_nominal_problem_stays_what_it_is(quaternion_equations):
    move = small_movement(quaternion_equations)
    before = move.problem(move.body)
    free = move.cold_start().free
    expected = before.con(free)
    move.problem(EFFECTS["body/hand_load"].apply(move.body, np.array([3.0, 0.0])))
    np.testing.assert_array_equal(before.con(free), expected)
    np.testing.assert_array_equal(move.problem(move.body).con(free), expected)


def test_cold_start_that_fails_is_tried_with_more_patience(quaternion_equations, monkeypatch):
    move, tried = small_movement(quaternion_equations), []

    def fails_in_haste(make, start, settings):
        tried.append((settings.gauss_newton_iterations, start.multipliers is not None))
        result = solve(make, start, settings)
        if len(tried) == 1:
            raise SolveError("too hasty")
        return result

    solve = forward.solve
    monkeypatch.setattr(forward, "solve", fails_in_haste)
    move.solved(move.body, move.cold_start(), 200)
    assert tried == [(HASTY, False), (PATIENT, False), (HASTY, True)]


def test_warm_start_that_fails_is_not_tried_again(quaternion_equations, monkeypatch):
    move = small_movement(quaternion_equations)
    point = move.solved(move.body, move.cold_start(), 200)

    def fails(*_):
        raise SolveError("no")

    monkeypatch.setattr(forward, "solve", fails)
    with pytest.raises(SolveError, match="no"):
        move.solved(move.body, Start(point.free, point.multipliers), 200)
