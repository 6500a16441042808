"""Predicted shoulders: limited muscles, what is refused, and the way from a neighbour."""

import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from muscle_record import ELEMENTS, muscle_record
from places import REPOSITORY
from skeleton import CONSTANTS
from small_arm import NAMES, small_muscles
from small_posed import WEIGHTS, small_model, small_settings, small_tracked
from synthetic_study import solution

from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.errors import ConfigError, SolveError
from scapulohumeral.model.published_arm import PUBLISHED_PLANES
from scapulohumeral.model.rotations import relative_angle, segment_orientations, trial_to_pose
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.problem import Bounds
from scapulohumeral.ocp.solution import read_solution, write_solution
from scapulohumeral.problems.chosen_problem import chosen_bounds
from scapulohumeral.problems.composite import compose
from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.problems.posed_problem import STRENGTH_UNIT_N
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.stages import prediction
from scapulohumeral.stages.prediction import (
    TRACKED,
    Condition,
    PredictionFiles,
    PredictionSettings,
    _Scene,
    _ways,
    girdle_held,
    limit_capacity,
    posing,
    solve_prediction,
)
from scapulohumeral.stages.tracking import held_load

pytestmark = pytest.mark.unit

HEALTHY = Condition("healthy", "calibrated", 2.0)
WEAK = Condition("weak", "calibrated", 4.0, ("biceps",), 0.0, start="healthy")
SETTINGS = PredictionSettings(
    small_settings(), pause_s=1.0, guidance=(1.0, 0.1), capacity_steps=(0.5, 0.2)
)


def test_limited_muscles_keep_their_share_of_active_force():
    record = muscle_record()
    generic = muscle_parameters(record)
    half = replace(generic, capacity=np.full(len(ELEMENTS), 0.5))
    limited = limit_capacity(half, record, ("supra", "infra"), 0.4)
    expected = [0.2 if muscle in ("supra", "infra") else 0.5 for muscle in ELEMENTS.values()]
    np.testing.assert_allclose(limited.capacity, expected)
    assert min(expected) < max(expected)
    np.testing.assert_array_equal(limited.max_isometric_force, generic.max_isometric_force)
    healthy = limit_capacity(half, record, (), 0.0)
    np.testing.assert_array_equal(healthy.capacity, half.capacity)


def test_unknown_muscle_is_refused():
    record = muscle_record()
    with pytest.raises(ConfigError, match="no muscle suprra; the model has .*supra"):
        limit_capacity(muscle_parameters(record), record, ("infra", "suprra"), 0.0)


@pytest.mark.parametrize(
    ("changes", "named"),
    [
        ({"parameters": "measured"}, "parameters 'measured'"),
        ({"capacity": 1.1}, "capacity 1.1"),
        ({"capacity": -0.1}, "capacity -0.1"),
        ({"w_gh": -1.0}, "w_gh -1.0"),
        ({"capacity": float("nan")}, "capacity nan"),
        ({"w_gh": float("nan")}, "w_gh nan"),
        ({"girdle_stiffness_Nm_per_rad": -1.0}, "girdle_stiffness_Nm_per_rad -1.0"),
    ],
)
def test_impossible_conditions_are_refused(changes, named):
    with pytest.raises(ConfigError, match=f"prediction condition weak: .*{named}"):
        replace(WEAK, **changes)


@pytest.fixture
def way(quaternion_equations, tmp_path):
    """Function that gives the ways to a condition, from a neighbour that was solved or not."""
    model = small_model(quaternion_equations)
    composite = compose([solution("par2", "frontal", "quaternion")], 0.04, 1.0)

    def way(condition, neighbour=None, status="optimal", variant="study"):
        path = None
        if neighbour is not None:
            path = tmp_path / "neighbour.npz"
            solved = solution("par2", "frontal", "quaternion")
            header = {**solved.header, "condition": asdict(neighbour), "status": status}
            header["variant"] = variant
            write_solution(replace(solved, header=header), path)
        unread = Path("unread")
        files = PredictionFiles(ModelFiles(*[unread] * 5), unread, None, (), path)
        scene = _Scene(model, composite, small_muscles(), condition, SETTINGS)
        return list(_ways(scene, files))

    return way


@pytest.fixture
def posed(quaternion_equations):
    """Function that poses the healthy problem of the small arm with some choices."""
    model = small_model(quaternion_equations)
    record = replace(model.record, choices=replace(model.record.choices, glenohumeral="capsule"))
    model = replace(model, record=record)
    composite = compose([solution("par2", "frontal", "quaternion")], 0.04, 1.0)

    def posed(**choices):
        settings = replace(SETTINGS, choices=ProblemChoices(**choices))
        return _Scene(model, composite, small_muscles(), WEAK, settings).posed(0.5)

    return posed


def test_the_girdle_moves_freely_with_the_capsule_of_the_model(posed):
    values = unpack(posed().parameters)
    assert values["joint_stiffness"][2] == 0.0
    assert values["spring_torque"][2] == CONSTANTS.passive_joint.capsule_Nm
    assert posed().objective.weights.tracked == TRACKED


def test_every_choice_of_a_problem_reaches_it(posed):
    plain = posed()
    assert plain.objective.weights.anchor == 0.0
    assert posed(clavicle_anchor=30.0).objective.weights.anchor == 30.0
    assert plain.objective.weights.reaction_rate == WEIGHTS["reaction_rate"]
    assert posed(reaction_rate=5e-6).objective.weights.reaction_rate == 5e-6
    np.testing.assert_array_equal(plain.objective.effort, 1.0)
    strength = small_muscles().max_isometric_force / STRENGTH_UNIT_N
    np.testing.assert_allclose(posed(strength_exponent=1.0).objective.effort, strength)
    assert plain.objective.elbow_activity is None
    assert (posed(elbow_in_pauses=True).objective.elbow_activity == 1.0).all()
    assert not plain.bounds.ends_at_rest
    assert posed(ends_at_rest=True).bounds.ends_at_rest
    assert posed(largest_compression_N=700.0).bounds.compression == (0.0, 700.0)
    assert plain.bounds.coordinates is None
    low, high = posed(coordinate_margin=0.1).bounds.coordinates
    reference = trial_to_pose(plain.target.reference_rad)
    np.testing.assert_allclose(low, reference.min(axis=0) - 0.1, atol=1e-6)
    np.testing.assert_allclose(high[1:4], reference[:, 1:4].max(axis=0) + 0.1, atol=1e-6)
    assert high[0] <= 1.0


@pytest.mark.parametrize(
    "choice",
    [
        {"springs": "exponential"},
        {"forearm": "unturned"},
        {"humerus_centre_m": 0.2},
        {"capsule_Nm": 3.0},
        {"conoid": "soft"},
        {"contact": "none"},
        {"stops": False},
    ],
    ids=lambda choice: next(iter(choice)),
)
def test_choices_of_what_is_passive_reach_the_problem(posed, choice):
    assert not np.array_equal(posed().parameters, posed(**choice).parameters)


def test_settings_say_what_was_solved(motions, tmp_path):
    written = tmp_path / "healthy.npz", tmp_path / "healthy.json"
    settings = replace(SETTINGS, choices=ProblemChoices(strength_exponent=0.5, reaction_rate=5e-6))
    files = motions(frontal="failed")
    solve_prediction(WEAK, files, settings, written, tmp_path / "solver.log")
    weights = json.loads(written[1].read_text(encoding="utf-8"))["settings"]["weights"]
    assert weights["stability"] == WEAK.w_gh
    assert (weights["strength_exponent"], weights["reaction_rate"]) == (0.5, 5e-6)


def test_a_held_girdle_is_held_to_the_recording(motions):
    files = motions(frontal="optimal", sagittal="optimal")
    free, held = girdle_held(HEALTHY, files, SETTINGS)
    target = trial_to_pose(held(1.0).target.reference_rad)
    tracked = trial_to_pose(free.target.reference_rad)
    humerus = [segment_orientations(pose)["humerus"] for pose in (target, tracked)]
    np.testing.assert_allclose(relative_angle(*humerus), 0.0, atol=1e-6)
    first = 0
    for path in files.tracked:
        recorded = read_solution(path).reference_pose
        own, followed = (pose[first : first + len(recorded)] for pose in (target, tracked))
        for joint in (slice(0, 4), slice(4, 8)):
            np.testing.assert_allclose(
                relative_angle(own[:, joint], recorded[:, joint]), 0.0, atol=1e-6
            )
        assert relative_angle(followed[:, 0:4], recorded[:, 0:4]).min() > np.deg2rad(1.0)
        first += len(recorded) + round(SETTINGS.pause_s / SETTINGS.solve.time_step_s) - 1


def test_limited_muscles_lose_active_force_or_all(posed):
    whole, muscles = posed(lost_force="whole").muscles, small_muscles()
    limited = NAMES.index("biceps")
    lost = np.where(np.arange(len(NAMES)) == limited, 0.5, 1.0)
    np.testing.assert_allclose(whole.max_isometric_force, lost * muscles.max_isometric_force)
    active = posed().muscles
    np.testing.assert_array_equal(active.max_isometric_force, muscles.max_isometric_force)
    np.testing.assert_allclose(active.capacity, lost * muscles.capacity)


def test_hand_holds_what_it_held_in_all_trials_of_one_motion():
    folder = REPOSITORY / "config" / "participants" / "par1"
    files = ModelFiles(folder / "participant.yaml", *[Path("unread")] * 4)
    assert held_load(files, ("frontal", "sagittal")) == 0.0
    assert held_load(files, ["lifting"]) == 2.0
    with pytest.raises(ConfigError, match=r"drinking 0, lifting 2; expected one load"):
        held_load(files, ("drinking", "lifting"))


def test_start_on_the_published_arm_carries_what_the_hand_holds(
    quaternion_equations, tmp_path, monkeypatch
):
    person = tmp_path / "par2"
    shutil.copytree(REPOSITORY / "config" / "participants" / "par2", person)
    file = person / "participant.yaml"
    file.write_text(file.read_text().replace("hand_load_kg: 0.0", "hand_load_kg: 1.5"))
    tracked = [tmp_path / f"{plane}.npz" for plane in PUBLISHED_PLANES]
    for path in tracked:
        write_solution(solution("par2", path.stem, "quaternion", "failed"), path)
    started = []
    monkeypatch.setattr(prediction, "load_model", lambda _: small_model(quaternion_equations))
    monkeypatch.setattr(
        prediction.initial_guess, "from_motion", lambda *given: started.append(given[2])
    )
    unread = Path("unread")
    arm = person / "published" / "composite_healthy.csv"
    files = PredictionFiles(ModelFiles(file, *[unread] * 4), unread, None, tracked, arm=arm)
    posed_for = posing(HEALTHY, files, replace(SETTINGS, choices=ProblemChoices(arm="published")))
    (at_start,) = started
    for parameters in (at_start, posed_for(small_muscles()).parameters):
        assert unpack(parameters)["mass_load"] == 1.5


@pytest.fixture
def motions(quaternion_equations, tmp_path, monkeypatch):
    """Function that writes tracked motions of the small arm, and returns what follows them."""
    monkeypatch.setattr(prediction, "load_model", lambda _: small_model(quaternion_equations))
    monkeypatch.setattr(prediction, "hashes", lambda *_: {})

    def motions(**statuses) -> PredictionFiles:
        tracked = [tmp_path / f"{plane}.npz" for plane in statuses]
        for path, status in zip(tracked, statuses.values(), strict=True):
            write_solution(small_tracked(path.stem, status), path)
        participant = REPOSITORY / "config" / "participants" / "par2" / "participant.yaml"
        unread = Path("unread")
        return PredictionFiles(ModelFiles(participant, *[unread] * 4), unread, None, tracked)

    return motions


def test_prediction_on_an_arm_without_a_solution_is_written_as_failed(motions, tmp_path):
    files = motions(frontal="optimal", sagittal="failed")
    written = tmp_path / "healthy.npz", tmp_path / "healthy.json"
    solve_prediction(HEALTHY, files, SETTINGS, written, tmp_path / "solver.log")
    with pytest.raises(SolveError, match="tracking of sagittal failed"):
        read_solution(written[0])
    about = json.loads(written[1].read_text(encoding="utf-8"))
    assert (about["status"], about["certificate"], about["iterations"]) == ("failed", None, 0)
    assert list(about["planes"]) == ["frontal", "sagittal"]
    with pytest.raises(SolveError, match="this solve failed"):
        posing(HEALTHY, files, SETTINGS)


def test_prediction_without_its_scalers_is_written_as_failed(motions, tmp_path):
    scalers = tmp_path / "scalers.json"
    scalers.write_text('{"status": "failed", "message": "no way", "groups": {}}', encoding="utf-8")
    files = replace(motions(frontal="optimal"), calibration=scalers)
    written = tmp_path / "healthy.npz", tmp_path / "healthy.json"
    solve_prediction(HEALTHY, files, SETTINGS, written, tmp_path / "solver.log")
    with pytest.raises(SolveError, match="calibration failed: no way"):
        read_solution(written[0])
    assert json.loads(written[1].read_text(encoding="utf-8"))["iterations"] == 0
    assert "calibration failed: no way" in (tmp_path / "solver.log").read_text(encoding="utf-8")


def capacities(problems) -> list[float]:
    """Share of the biceps in each problem; all other muscles keep theirs."""
    healthy = small_muscles().capacity
    shares = np.array([problem.muscles.capacity / healthy for problem in problems])
    biceps = NAMES.index("biceps")
    assert (np.delete(shares, biceps, axis=1) == 1.0).all()
    return shares[:, biceps].round(12).tolist()


def test_tracking_leads_to_prediction_by_falling_guidance(way):
    (guided,) = way(HEALTHY)
    problems = guided.steps
    assert [problem.objective.weights.guidance for problem in problems] == [1.0, 0.1, 0.0]
    assert capacities(problems) == [1.0, 1.0, 1.0]
    direct, fallback = way(replace(HEALTHY, start="direct"))
    assert [problem.objective.weights.guidance for problem in direct.steps] == [0.0]
    assert (guided.name, direct.name, fallback.name) == ("tracking", "direct", "tracking")
    for problem in (*problems, *direct.steps):
        weights = problem.objective.weights
        assert weights.tracked == TRACKED
        assert weights.stability == HEALTHY.w_gh
        assert weights.trajectory == WEIGHTS["trajectory_quaternion"]


def test_girdle_stiffness_changes_two_joints(way):
    (healthy,) = way(replace(HEALTHY, start="direct"))[0].steps
    (stiff,) = way(replace(HEALTHY, start="direct", girdle_stiffness_Nm_per_rad=5.0))[0].steps
    before, after = unpack(healthy.parameters), unpack(stiff.parameters)
    np.testing.assert_array_equal(after["joint_stiffness"][:2], [5.0, 5.0])
    assert (before["joint_stiffness"][:2] != 5.0).all()
    np.testing.assert_array_equal(after["joint_stiffness"][2:], before["joint_stiffness"][2:])
    for name in before.keys() - {"joint_stiffness"}:
        np.testing.assert_array_equal(after[name], before[name])


def test_capacity_falls_in_steps_from_a_healthy_neighbour(way):
    def first(condition):
        return way(condition, HEALTHY)[0].steps

    problems = first(WEAK)
    assert capacities(problems) == [0.5, 0.2, 0.0]
    assert {problem.objective.weights.guidance for problem in problems} == {0.0}
    assert {problem.objective.weights.stability for problem in problems} == {WEAK.w_gh}
    assert capacities(first(replace(WEAK, capacity=0.3))) == [0.5, 0.3]
    assert capacities(first(replace(WEAK, capacity=0.5))) == [0.5]


def test_capacity_goes_on_from_a_neighbour_that_is_limited_alike(way):
    partly = replace(WEAK, name="partly", capacity=0.4)
    assert capacities(way(WEAK, partly)[0].steps) == [0.2, 0.0]
    assert capacities(way(replace(WEAK, w_gh=10.0), WEAK)[0].steps) == [0.0]
    other = replace(WEAK, name="other", muscles=("brachialis",))
    assert capacities(way(WEAK, other)[0].steps) == [0.5, 0.2, 0.0]


def test_a_neighbour_of_another_variant_is_named_with_it(way):
    assert way(HEALTHY, HEALTHY, variant="upto_box")[0].name == "upto_box/healthy"


def test_without_a_solved_neighbour_the_condition_is_reached_from_tracking(way):
    first, motion, last = way(WEAK, HEALTHY)
    assert (first.name, motion.name, last.name) == ("healthy", "motion of healthy", "tracking")
    assert first.start.multipliers is not None
    assert motion.start.multipliers is None
    np.testing.assert_array_equal(motion.start.free, first.start.free)
    (only,) = way(WEAK, HEALTHY, status="failed")
    assert only.name == "tracking"
    assert [problem.objective.weights.guidance for problem in only.steps] == [1.0, 0.1, 0.0]
    assert capacities(only.steps) == [0.0, 0.0, 0.0]


def test_a_joint_that_may_only_be_pressed_starts_pressed() -> None:
    still = Trajectory(*(np.ones((3, width)) for width in (13, 10, 4, 4, 3)))
    start = prediction._relaxed(still)
    choices = ProblemChoices(largest_compression_N=1600.0)
    low, high = chosen_bounds(choices, still.q, Bounds()).compression
    assert np.all((low < start.reaction[:, 0]) & (start.reaction[:, 0] < high))
    assert np.all(start.reaction[:, 1:] == 0.0)
    np.testing.assert_array_equal(start.a, start.e)
