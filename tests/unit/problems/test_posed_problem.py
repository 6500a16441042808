"""Problems posed from a model and a configuration, and what is read from their solutions."""

import json
from dataclasses import replace

import numpy as np
import pytest
from small_arm import NAMES, small_motion, small_muscles
from small_posed import GLENOID, WEIGHTS, small_model, small_posed, small_settings, small_target

from scapulohumeral.dynamics.hill import force_derivatives
from scapulohumeral.model.rotations import trial_to_pose
from scapulohumeral.ocp.emg_term import EmgTerm
from scapulohumeral.ocp.objective import SEGMENTS, Trajectory, Weights
from scapulohumeral.ocp.problem import Bounds
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solving import checkpoint
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.problems.posed_problem import (
    _checkpoint,
    effort_factors,
    header,
    make_objective,
    read_result,
    solve_posed,
    store,
)

pytestmark = pytest.mark.unit

NODES = 6
FREE = ("clavicle", "scapula")
EMG = EmgTerm(np.eye(3), np.full((NODES, 3), 0.1), np.ones(NODES))


def off_the_target(name: str) -> Trajectory:
    """A motion three degrees off the target in every angle."""
    angles = small_motion(NODES) + np.deg2rad(3.0)
    return Trajectory(
        q=angles if name == "euler" else trial_to_pose(angles),
        u=np.zeros((NODES, 10)),
        a=np.full((NODES, 3), 0.1),
        e=np.full((NODES, 3), 0.1),
        reaction=np.tile([30.0, 5.0, 2.0], (NODES, 1)),
    )


def test_objective_has_the_configured_weights(equations):
    settings = small_settings(stability=2.0, emg=3.0, parameters=4.0)
    target = small_target(NODES, tracked=("humerus",), guidance=0.3, emg=EMG)
    objective = make_objective(small_model(equations), target, settings)
    assert objective.weights == Weights(
        trajectory=WEIGHTS[f"trajectory_{equations.name}"],
        activation=1.0,
        stability=2.0,
        regularisation=1e-2,
        reaction_rate=1e-6,
        excitation_rate=1e-3,
        quaternion_norm=150.0,
        emg=3.0,
        parameters=4.0,
        tracked=("humerus",),
        guidance=0.3,
    )
    assert objective.emg is EMG
    assert objective.step == settings.time_step_s
    np.testing.assert_allclose(
        np.rad2deg(objective.glenoid),
        [GLENOID.inferior_inclination_deg, GLENOID.anterior_version_deg],
    )
    assert objective.superior_inferior_share == GLENOID.superior_inferior_factor


def test_terms_without_weight_or_data_are_left_out(equations):
    model = small_model(equations)
    weights = make_objective(model, small_target(NODES, emg=EMG), small_settings()).weights
    assert (weights.stability, weights.emg, weights.parameters) == (0.0, 0.0, 0.0)
    silent = make_objective(model, small_target(NODES), small_settings(emg=3.0))
    assert silent.weights.emg == 0.0


def test_effort_by_strength_does_not_feel_how_a_muscle_is_divided():
    """Two halves carry what the whole does; with elements alike that costs twice as much."""
    whole = small_muscles()
    halves = replace(whole, max_isometric_force=0.5 * whole.max_isometric_force)
    for exponent, ratio in ((1.0, 1.0), (0.0, 2.0)):
        cost = [np.sum(effort_factors(muscles, exponent) * 0.3**2) for muscles in (whole, halves)]
        assert 2.0 * cost[1] == pytest.approx(ratio * cost[0])


def test_effort_factors_reach_value_gradient_and_curvature(quaternion_equations):
    target = small_target(NODES)
    objective = make_objective(small_model(quaternion_equations), target, small_settings())
    weighed = replace(objective, effort=np.array([0.5, 2.0, 1.0]))
    x = off_the_target("quaternion")
    step = np.zeros((NODES, 3))
    step[2, 1] = 1e-6
    up, down = (weighed.value(replace(x, a=x.a + sign * step)) for sign in (1.0, -1.0))
    gradient = weighed.gradient(x).a
    assert gradient[2, 1] == pytest.approx((up - down) / 2e-6, rel=1e-6)
    np.testing.assert_allclose(gradient, objective.gradient(x).a * [0.5, 2.0, 1.0])
    curvature = [problem.hessian(x, exact=True).a for problem in (weighed, objective)]
    np.testing.assert_allclose(curvature[0], curvature[1] * [0.5, 2.0, 1.0])


def test_guidance_leads_from_free_segments_to_tracking(equations):
    model, x = small_model(equations), off_the_target(equations.name)

    def terms(**target):
        return make_objective(model, small_target(NODES, **target), small_settings()).terms(x)

    full = terms()
    assert min(full[segment] for segment in SEGMENTS) > 1e-3
    followed = ("humerus", "elbow")
    assert terms(tracked=followed, guidance=1.0) == full
    for share in (0.0, 0.1):
        partly = terms(tracked=followed, guidance=share)
        for segment in SEGMENTS:
            expected = full[segment] * (share if segment in FREE else 1.0)
            assert partly[segment] == pytest.approx(expected, rel=1e-12)


def test_nothing_is_followed_in_a_pause(equations):
    model, x = small_model(equations), off_the_target(equations.name)
    target = small_target(NODES, activity=np.zeros(NODES))
    terms = make_objective(model, target, small_settings()).terms(x)
    assert all(terms[segment] == 0.0 for segment in SEGMENTS)
    assert terms["activation"] > 0.0


def test_solution_is_stored_in_physical_terms(quaternion_equations, tmp_path):
    settings, target = small_settings(stability=0.5), small_target(NODES)
    posed = small_posed(quaternion_equations, target, settings)
    result = solve_posed(posed, posed.cold_start(), settings, None)
    assert result.optimal, result.message
    about = header(posed, result, settings, participant="nobody", trial="slow")
    paths = tmp_path / "slow.npz", tmp_path / "slow.summary.json"
    store(read_result(posed, result, about), result, paths, {"more": 1})

    stored = read_solution(paths[0])
    x = posed.layout().split(result.point.free)
    np.testing.assert_array_equal(stored.q, x.q)
    np.testing.assert_array_equal(stored.excitation, x.e)
    np.testing.assert_allclose(stored.reaction_N, x.reaction)
    length, velocity = posed.model.forces.lengths(x.q, x.u)
    curves = force_derivatives(length, velocity, small_muscles())
    np.testing.assert_allclose(stored.muscle_force_N, curves.active * x.a + curves.passive)
    assert stored.muscles.tolist() == list(NAMES)

    summary = json.loads(paths[1].read_text(encoding="utf-8"))
    assert (summary["status"], summary["trial"], summary["more"]) == ("optimal", "slow", 1)
    assert sum(summary["terms"].values()) == pytest.approx(result.objective, rel=1e-6)
    assert summary["rmse_thoracohumeral_deg"] < 8.0


def test_solve_with_scalers_starts_from_generic_muscles(quaternion_equations):
    scalers = Scalers(("all",), np.ones((1, 3), dtype=bool))
    settings = replace(small_settings(parameters=1e6), hessian="exact", max_iterations=0)
    posed = small_posed(quaternion_equations, small_target(NODES), settings, scalers=scalers)
    result = solve_posed(posed, posed.cold_start(), settings, None)
    np.testing.assert_allclose(posed.layout().split(result.point.free).scalers, 1.0, atol=1e-6)


def test_checkpoints_of_other_bounds_are_others(quaternion_equations, tmp_path):
    """Iterates under other bounds belong to another problem."""
    settings, target = small_settings(), small_target(NODES)
    log = tmp_path / "logs/solve/one.log"
    start = Start(np.zeros(3))

    def place(bounds, log=log):
        posed = small_posed(quaternion_equations, target, settings, bounds=bounds)
        return _checkpoint(posed, start, settings.solver, log).folder

    assert place(None) == place(None)
    assert place(Bounds()) != place(Bounds(compression=(0.0, 1600.0)))
    # Two tasks that solve the same problem side by side do not touch each other's iterates.
    assert place(None) != place(None, log.with_name("two.log"))
    assert place(None) != place(None, log.parents[1] / "other" / log.name)


def test_solves_of_a_study_keep_their_iterates_beside_its_logs(
    quaternion_equations, tmp_path, monkeypatch
):
    kept = []
    monkeypatch.setattr(checkpoint, "INTERVAL_S", 0.0)
    monkeypatch.setattr(checkpoint.Checkpoint, "remove", lambda self: kept.append(self.folder))
    settings = small_settings()
    posed = small_posed(quaternion_equations, small_target(5), settings)
    logs = tmp_path / "logs" / "rule"
    logs.mkdir(parents=True)
    start = posed.cold_start()
    solve_posed(posed, start, settings, logs / "solver.log")
    solve_posed(posed, start, settings, None)
    heavier = replace(posed, parameters=1.01 * posed.parameters)
    solve_posed(heavier, start, settings, logs / "solver.log")
    assert [folder.parent for folder in kept] == [tmp_path / "checkpoints"] * 2
    assert kept[0] != kept[1]
    assert all((folder / checkpoint.ITERATE).exists() for folder in kept)
