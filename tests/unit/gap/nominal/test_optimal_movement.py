"""A movement with another body is the problem that is set up for it, and hard ones are retried."""

from dataclasses import replace

import numpy as np
import pytest
from gap_movement import NODES, SETTINGS, SETUP, small_movement, small_record
from small_arm import small_muscles
from small_posed import WEIGHTS, small_model

from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.nominal import optimal_movement
from scapulohumeral.gap.nominal.loaded_collocation import body_bounds
from scapulohumeral.gap.nominal.optimal_movement import (
    HASTY,
    PATIENT,
    gh_elevation,
    movement,
    with_state,
)
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.model.record import PointRecord
from scapulohumeral.model.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    rotation_vector_to_quaternion,
)
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving.solver import Start

pytestmark = pytest.mark.unit

EFFECTS = {e.label: e for e in library(SETUP)}
CHANGED = {
    "body/hand_load": [1.5, 0.02],
    "body/strength_loss/biceps": [0.4, 0.7],
    "control/pain_inhibition/biceps": [2.0, 0.5],
    "body/glenoid_orientation": [8.0, -4.0],
}


@pytest.mark.parametrize("label", CHANGED)
@pytest.mark.parametrize("hessian", ["exact", "gauss-newton"])
def test_problem_of_a_body_is_the_one_that_is_set_up_anew(quaternion_equations, label, hessian):
    move = small_movement(quaternion_equations)
    body = EFFECTS[label].apply(move.body, np.array(CHANGED[label]))
    quick = move.problem(body, hessian)
    objective, parameters = move._objective(body), pack(body.parameters)
    fresh = Problem(move.forces, body.muscles, parameters, objective, hessian)
    lower, upper = body_bounds(fresh.layout, body, (fresh.lower_bound, fresh.upper_bound))
    free = move.cold_start().free + 0.01 * np.random.default_rng(1).normal(size=quick.num_free)
    multipliers = np.random.default_rng(2).normal(size=quick.num_constraints)
    for one, other in (
        (quick.obj(free), fresh.obj(free)),
        (quick.obj_grad(free), fresh.obj_grad(free)),
        (quick.con(free), fresh.con(free)),
        (quick.con_jac(free), fresh.con_jac(free)),
        (quick.hessian(free, multipliers, 1.0), fresh.hessian(free, multipliers, 1.0)),
        (quick.lower_bound, lower),
        (quick.upper_bound, upper),
    ):
        np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-12)


def test_effort_of_a_muscle_counts_alike_for_activations_and_excitations(quaternion_equations):
    move = small_movement(quaternion_equations)
    effort = np.array([0.5, 1.0, 4.0])
    move = replace(move, objective=replace(move.objective, effort=effort))
    coupling = move._objective(move.body).emg.coupling
    np.testing.assert_allclose(coupling, np.diag(effort * move.body.effort), rtol=1e-12)


def test_movements_of_one_model_share_a_set_up(quaternion_equations):
    """A faster movement gets the problem that is set up for it alone."""
    first = small_movement(quaternion_equations)
    faster = replace(first.objective, step=0.7 * first.objective.step)
    alone = replace(first, objective=faster)
    sharing = replace(alone, mesh=first.set_up)
    free = alone.cold_start().free + 0.01 * np.random.default_rng(1).normal(
        size=first.set_up.num_free
    )
    np.testing.assert_array_equal(sharing.cold_start().free, alone.cold_start().free)
    one, other = sharing.problem(first.body), alone.problem(first.body)
    multipliers = np.random.default_rng(2).normal(size=one.num_constraints)
    np.testing.assert_array_equal(one.con(free), other.con(free))
    np.testing.assert_array_equal(one.con_jac(free), other.con_jac(free))
    np.testing.assert_array_equal(
        one.hessian(free, multipliers, 1.0), other.hessian(free, multipliers, 1.0)
    )
    assert np.abs(one.con(free) - first.problem(first.body).con(free)).max() > 1e-3


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

    solve = optimal_movement.solve
    monkeypatch.setattr(optimal_movement, "solve", fails_in_haste)
    move.solved(move.body, move.cold_start(), 200)
    assert tried == [(HASTY, False), (PATIENT, False), (HASTY, True)]


def test_cold_start_does_not_depend_on_how_often_angles_were_wrapped(quaternion_equations):
    # Muscle lengths are polynomials of quaternions of one sign: with the other, moment arms of 30 m
    # came out, and 12 % of the trials of a blind draw started so.
    move = small_movement(quaternion_equations)
    wrapped = replace(move, angles_rad=move.angles_rad + 2.0 * np.pi * np.eye(10)[6])
    np.testing.assert_allclose(wrapped.cold_start().free, move.cold_start().free, atol=1e-9)


def test_cold_start_is_solved_without_joint_stability_first(quaternion_equations, monkeypatch):
    """Cold starts whose joint force hardly compresses ended in poor optima."""
    move, weights = small_movement(quaternion_equations), []

    def watched(make, start, settings):
        weights.append(make("exact").objective_function.weights.stability)
        return solve(make, start, settings)

    solve = optimal_movement.solve
    monkeypatch.setattr(optimal_movement, "solve", watched)
    point = move.solved(move.body, move.cold_start(), 200)
    move.solved(move.body, point, 200)
    assert weights == [0.0, 1.0, 1.0]


def test_warm_start_that_fails_is_not_tried_again(quaternion_equations, monkeypatch):
    move = small_movement(quaternion_equations)
    point = move.solved(move.body, move.cold_start(), 200)

    def fails(*_):
        raise SolveError("no")

    monkeypatch.setattr(optimal_movement, "solve", fails)
    with pytest.raises(SolveError, match="no"):
        move.solved(move.body, Start(point.free, point.multipliers), 200)


def test_gh_elevation_grows_about_its_axis():
    rng = np.random.default_rng(1)
    pose = np.zeros((20, 13))
    for part in (slice(0, 4), slice(4, 8), slice(8, 12)):
        pose[:, part] = rng.normal(size=(20, 4))
        pose[:, part] /= np.linalg.norm(pose[:, part], axis=1, keepdims=True)
    elevation, lift = gh_elevation(pose)
    moved = pose.copy()
    moved[:, 8:12] = quaternion_multiply(pose[:, 8:12], rotation_vector_to_quaternion(1e-6 * lift))
    np.testing.assert_allclose((gh_elevation(moved)[0] - elevation) / 1e-6, 1.0, atol=1e-4)


def test_external_torque_acts_like_a_spring_of_the_model(quaternion_equations):
    """A capsule and a spring against elevation push the humerus the same way."""
    move = small_movement(quaternion_equations)
    point = Start(move.cold_start().free, np.zeros(1))
    move = with_state(move, point)
    rest = np.eye(3).ravel()
    slack, taut = (
        replace(
            move.body,
            parameters={**move.body.parameters, "rest_GH": rest, "joint_stiffness": stiffness},
        )
        for stiffness in (np.zeros(4), np.array([0.0, 0.0, 4.0, 0.0]))
    )
    problem = move.problem(slack)
    bare, sprung = problem.con(point.free), move.problem(taut).con(point.free)
    first = problem.layout.coordinates
    rows = (sprung - bare)[: problem.collocation.number_of_equations * (NODES - 1)]
    torque = rows.reshape(-1, NODES - 1)[first : first + 10].T
    along = np.sum(torque[:, 6:9] * move.body.gh_lift, axis=1)
    assert np.all(along < 0.0)
    external = move.problem(replace(slack, external_Nm=torque)).con(point.free)
    np.testing.assert_allclose(external, sprung, atol=1e-9)
    stiff = EFFECTS["body/passive_gh"].apply(slack, np.array([10.0, 5.0]))
    assert np.all(np.sum(stiff.external_Nm[:, 6:9] * move.body.gh_lift, axis=1) < 0.0)


@pytest.fixture
def participant(quaternion_equations) -> ParticipantModel:
    """The small arm as a participant whose thorax is far from the scapula."""
    model = small_model(quaternion_equations)
    contact = model.record.constants.scapulothoracic_contact
    markers = {name: PointRecord("scapula_r", (-0.1, 0.0, 0.0)) for name in contact.points}
    thorax = {"centre_m": [0.0, 0.0, -1.0], "radii_m": [0.1, 0.1, 0.1]}
    record = replace(model.record, markers=markers)
    return ParticipantModel(record, thorax, model.forces, small_muscles(), "small")


def cost(move, q: np.ndarray, activation: np.ndarray) -> float:
    """Objective at rest in poses (N, 13), with as much excitation as activation (M,)."""
    nodes = len(q)
    each = np.tile(activation, (nodes, 1))
    still = np.zeros((nodes, 10))
    press = np.tile([-50.0, 0.0, 0.0], (nodes, 1))
    point = move.set_up.layout.join(Trajectory(q, still, each, each, press))
    return move.set_up.objective(point)


def test_predictions_leave_the_girdle_free_and_tracking_does_not(participant) -> None:
    """The scapula turns by 0.1 rad under the same humerus."""
    record = small_record()
    settings = replace(SETTINGS, weights={**WEIGHTS, "stability": 0.0})
    turned, turn = record.pose.copy(), rotation_vector_to_quaternion([0.0, 0.1, 0.0])
    turned[:, 4:8] = quaternion_multiply(record.pose[:, 4:8], turn)
    turned[:, 8:12] = quaternion_multiply(quaternion_conjugate(turn), record.pose[:, 8:12])
    idle = np.zeros(3)
    predicted = movement(participant, record, replace(settings, view="prediction"))
    assert cost(predicted, turned, idle) == pytest.approx(cost(predicted, record.pose, idle))
    tracked = movement(participant, record, settings)
    assert cost(tracked, turned, idle) > cost(tracked, record.pose, idle) + 0.1


@pytest.mark.parametrize("exponent", [0.0, 1.0, 2.0])
def test_effort_counts_the_strength_of_a_muscle_to_the_power_of_the_study(
    participant, exponent: float
) -> None:
    """By hand: excitations, equal to activations here, count for a hundredth of the whole."""
    record = small_record()
    weights = {**WEIGHTS, "stability": 0.0, "activation": 3.0, "strength_exponent": exponent}
    move = movement(participant, record, replace(SETTINGS, weights=weights))
    activation = np.array([0.2, 0.5, 0.3])
    effort = cost(move, record.pose, activation) - cost(move, record.pose, np.zeros(3))
    strength = (small_muscles().max_isometric_force / 150.0) ** exponent
    assert effort == pytest.approx(3.0 * strength @ activation**2 * record.duration_s)
