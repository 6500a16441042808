"""Drawing of cases: what is drawn again, given up or replaced, and what keys say of it."""

import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from recorded_tasks import with_all_tasks
from skeleton import CONSTANTS, joint, skeleton_record, surface
from small_arm import small_motion

from scapulohumeral.errors import SolveError
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.muscle_paths.thorax_clearance import level_set
from scapulohumeral.model.record import PointRecord
from scapulohumeral.model.rotations import (
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.stages.thorax import contact_points, fit_ellipsoid, prior_ellipsoid
from simulated_persons import generate
from simulated_persons.drawing import attempts, study, trials
from simulated_persons.drawing.attempts import Drawn, GivenUp, drawn_cases
from simulated_persons.drawing.keys import case_key
from simulated_persons.drawing.trials import MISSED, OTHERWISE, TOO_WEAK, Recordings
from simulated_persons.movement import WAVES, no_variation, wished_poses
from simulated_persons.observation import Recording
from simulated_persons.plan import CHANGES, KEEPS, TASKS, YIELDS, Plan, draw_plans, redrawn

pytestmark = pytest.mark.unit

MOTION = Motion(np.linspace(0.0, 2.0, 60), small_motion(60))
STUDY = SimpleNamespace(anatomies={"par1": None})
Record = Callable[[Plan], Recordings | str]


def still(emg: float = 0.0) -> Recording:
    """A trial of a small motion with constant envelopes."""
    time = np.linspace(0, 1, 50)
    return Recording(time, small_motion(50), np.full((50, 8), emg), np.zeros((50, 3)))


def everywhere(plan: Plan, sides: Mapping[str, Recording]) -> Recordings:
    """The same noise-free trial in all tasks of each side."""
    tasks = (*plan.tasks, plan.hidden)
    return {(side, task, 0): trial for side, trial in sides.items() for task in tasks}


def unchanged(plan: Plan) -> Recordings:
    """A case in which nothing differs."""
    return everywhere(plan, {"reference": still(), "test": still(), OTHERWISE: still()})


def test_only_participants_with_all_tasks_are_repeated() -> None:
    """Own participants have other trials than the published elevations."""
    every = [Path("people/ann") / f"{task}.csv" for task in (*TASKS, "drinking")]
    some = [Path("people/bob/frontal.csv"), Path("people/bob/reach_r1.csv")]
    assert with_all_tasks([*some, *every]) == [Path("people/ann")]
    assert with_all_tasks(some) == []


def simulate_by(monkeypatch: pytest.MonkeyPatch, recorded: Record) -> list[Plan]:
    """Let a function say what comes of each plan; the plans that were tried, in order."""
    tried: list[Plan] = []

    def simulated(_, plans):
        tried.extend(plans)
        return {plan.id: recorded(plan) for plan in plans}

    monkeypatch.setattr(attempts, "simulated", simulated)
    return tried


def test_a_person_with_two_ways_to_do_a_task_is_drawn_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    [plan] = draw_plans(2, 1, ("par1",), "null")
    envelopes = iter([0.3, 0.1])  # of one repeat in the first draw, and in the second

    def recorded(plan: Plan) -> Recordings:
        quiet = still(0.1)
        recordings = {("test", task, repeat): quiet for task in plan.tasks for repeat in (0, 1, 2)}
        other = quiet.emg + (next(envelopes) - 0.1) * (np.arange(8) == 5)
        recordings["test", plan.tasks[1], 2] = replace(quiet, emg=other)
        return recordings

    simulate_by(monkeypatch, recorded)
    [found] = drawn_cases(STUDY, [plan])
    assert isinstance(found, Drawn)
    assert found.recordings["test", plan.tasks[1], 2].emg.max() < 0.2
    assert found.plan.seed == redrawn(plan, 1).seed
    assert found.attempt.failures == (attempts.TWO_WAYS,)


@pytest.mark.parametrize(("angle_deg", "draws"), [(20.0, 1), (0.0, attempts.SHOWN_ATTEMPTS)])
def test_an_effect_that_hardly_shows_is_drawn_again(
    monkeypatch: pytest.MonkeyPatch, angle_deg: float, draws: int
) -> None:
    [plan] = draw_plans(2, 1, ("par1",), "single")
    plan = replace(plan, faint=False, person=YIELDS)
    bent = small_motion(50) + np.deg2rad(angle_deg) * (np.arange(10) == 9)
    sides = {"reference": still(), "test": replace(still(), angles_rad=bent)}
    tried = simulate_by(monkeypatch, lambda plan: everywhere(plan, sides))
    [found] = drawn_cases(STUDY, [plan])
    assert len(tried) == draws
    assert found.plan.id == plan.id
    assert case_key(found.plan, found.recordings)["shown"] is (angle_deg > 0)


def test_a_change_that_comes_with_an_effect_is_not_counted_as_its_footprint() -> None:
    """The test moves otherwise; the effect itself changes the channel of serratus alone."""
    plans = draw_plans(5, 60, ("par1",), "single")
    plan = next(p for p in plans if p.person == CHANGES and p.emg and not p.contact)
    time, angles = np.linspace(0, 1, 50), small_motion(50)
    moved = angles + np.deg2rad(20.0) * (np.arange(10) == 9)
    quiet = np.full((50, 8), 0.1)
    sides = {
        "reference": (angles, quiet),
        OTHERWISE: (moved, quiet),
        "test": (moved, quiet + 0.5 * (np.arange(8) == 7)),
    }
    recordings = {
        (side, task, 0): Recording(time, *values, np.zeros((50, 3)))
        for side, values in sides.items()
        for task in (*plan.tasks, plan.hidden)
    }
    key = case_key(plan, recordings)
    assert key["person"] == CHANGES
    assert [name for name, size in key["footprint"].items() if size > 0] == ["EMG_serr"]
    assert key["otherwise"]["deg"]["EL_rx"] == pytest.approx(20.0)
    assert key["otherwise"]["shown"] is True


def test_who_never_manages_to_keep_a_movement_gives_way(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    [plan] = draw_plans(2, 1, ("par1",), "null")
    plan = replace(plan, person=KEEPS)
    tried = simulate_by(
        monkeypatch, lambda plan: TOO_WEAK if plan.person == KEEPS else unchanged(plan)
    )
    [found] = drawn_cases(STUDY, [plan])
    assert [plan.person for plan in tried] == [KEEPS] * attempts.KEEPING_ATTEMPTS + [YIELDS]
    assert found.plan.person == YIELDS
    assert found.attempt.asked == KEEPS
    assert found.attempt.failures == (TOO_WEAK,) * attempts.KEEPING_ATTEMPTS


@pytest.mark.parametrize("kind", ["null", "single", "pair", "strategy"])
def test_another_case_of_its_kind_takes_the_place_of_one_that_never_works(
    monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    hopeless, easy = draw_plans(2, 2, ("par1",), kind)
    easy = replace(easy, faint=True)
    simulate_by(monkeypatch, lambda plan: MISSED if plan.id == hopeless.id else shows(plan))
    found = list(drawn_cases(STUDY, [hopeless, easy]))
    [given_up] = [case for case in found if isinstance(case, GivenUp)]
    drawn = [case.plan for case in found if isinstance(case, Drawn)]
    assert given_up.attempt.plan.id == hopeless.id
    assert given_up.attempt.failures == (MISSED,) * attempts.LARGEST_ATTEMPTS
    assert {plan.id for plan in drawn} == {easy.id, given_up.by}
    assert {plan.kind for plan in drawn} == {kind}


def shows(plan: Plan) -> Recordings:
    """A case whose test differs in all channels."""
    bent = small_motion(50) + np.deg2rad(20.0)
    moved = replace(still(0.5), angles_rad=bent, force_N=np.full((50, 3), 400.0))
    return everywhere(plan, {"reference": still(), "test": moved, OTHERWISE: still()})


def test_repeats_of_salted_motion_scatter_in_clavicle_and_scapula_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    [plan] = draw_plans(2, 1, ("par1",), "salted")
    trials = {("test", task, repeat): still() for task in plan.tasks for repeat in (0, 1)}
    monkeypatch.setattr(attempts, "salted", lambda *_: trials)
    [found] = drawn_cases(STUDY, [plan])
    for task in plan.tasks:
        exact, repeat = (found.recordings["test", task, number] for number in (0, 1))
        np.testing.assert_array_equal(exact.angles_rad, still().angles_rad)
        off = np.rad2deg(np.sqrt(np.mean((repeat.angles_rad - exact.angles_rad) ** 2, axis=0)))
        assert np.all(off[:6] > 0.1)


def test_names_of_blind_cases_are_not_drawn_with_their_causes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(generate, "load_study", lambda *_: STUDY)
    monkeypatch.setattr(generate, "write_case", lambda *_: None)
    simulate_by(monkeypatch, shows)

    def drawn(keys: Path, *more: str) -> tuple[int, set[str], set[str]]:
        """Seed, names of the cases, and names by that seed."""
        places = [f"--{name}={tmp_path}" for name in ("results", "participants", "out")]
        fixed = ["--cases=3", "--kind=null", "--names", "par1", *places, f"--keys={keys}"]
        generate.main([*fixed, *more])
        seed = json.loads((keys / generate.DRAW).read_text())["seed"]
        names = {path.stem for path in keys.glob("*.json")} - {"draw"}
        return seed, names, {plan.id for plan in draw_plans(seed, 3, ("par1",), "null")}

    seed, names, by_seed = drawn(tmp_path / "blind")
    assert seed >= 2**64
    assert len(names) == 3
    assert not names & by_seed
    seed, names, by_seed = drawn(tmp_path / "open", "--seed=5")
    assert (seed, names) == (5, by_seed)


def test_the_name_of_a_replaced_case_is_not_drawn_with_its_cause() -> None:
    [plan] = draw_plans(2, 1, ("par1",), "null")
    other = attempts._instead(attempts.Attempt(plan, plan.person), ("par1",))
    seed = int(np.random.default_rng([plan.seed, 3]).integers(2**31))
    [by_seed] = draw_plans(seed, 1, ("par1",), "null", plan.plant)
    assert other.plan.seed == by_seed.seed
    assert other.plan.id not in (by_seed.id, plan.id)
    assert len(other.plan.id) == len(plan.id)


def write_by(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, recorded: Record) -> dict:
    """Cases written with what a function says of each plan: what is noted of the draw."""
    simulate_by(monkeypatch, recorded)
    monkeypatch.setattr(generate, "write_case", lambda *_: None)
    plans = draw_plans(3, 2, ("par1",), "null")
    return generate.write_cases(STUDY, plans, tmp_path, tmp_path)


def test_one_failing_case_never_ends_a_draw_and_is_noted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    first, second = draw_plans(3, 2, ("par1",), "null")
    noted = write_by(
        monkeypatch, tmp_path, lambda plan: unchanged(plan) if plan.id == second.id else MISSED
    )
    assert [path.stem for path in tmp_path.glob("*.json")] == [second.id]
    assert noted["written"] == 1
    lost = 1 + attempts.LARGEST_REPLACEMENTS
    assert noted["dropped_draws"] == {MISSED: lost * attempts.LARGEST_ATTEMPTS}
    assert [one["case"] for one in noted["given_up"]][0] == first.id
    follows = [one["replaced_by"] for one in noted["given_up"]]
    assert follows == [*[one["case"] for one in noted["given_up"][1:]], None]
    key = json.loads((tmp_path / f"{second.id}.json").read_text())
    assert key["dropped_draws"] == []
    assert key["asked_person"] == second.person


def test_a_draw_without_any_case_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    with pytest.raises(SolveError, match="none of 2 cases"):
        write_by(monkeypatch, tmp_path, lambda plan: MISSED)


def test_torques_that_lack_are_counted_as_rotations_of_a_shoulder() -> None:
    missing = np.zeros((200, 10))
    missing[:, 4] = 0.6
    assert trials.deflection(missing) == pytest.approx(0.01)


@pytest.mark.parametrize(
    ("keeps", "missed_deg", "missing_Nm", "expected"),
    [
        (True, 0.0, 0.1, ""),
        (True, 0.0, 1.0, TOO_WEAK),
        (False, 10.0, 9.0, ""),
        (False, 30.0, 0.1, MISSED),
        (True, np.nan, np.nan, MISSED),
    ],
)
def test_why_a_trial_is_none_of_its_task(keeps, missed_deg, missing_Nm, expected) -> None:  # noqa: N803 - unit
    pose = wished_poses(MOTION, no_variation())
    humerus = trials.humerus_of(pose)
    bent = pose.copy()
    turn = rotation_vector_to_quaternion(np.deg2rad([[0.0, missed_deg, 0.0]]))
    bent[:, 8:12] = quaternion_multiply(pose[:, 8:12], turn)
    missing = np.full((len(pose), 10), missing_Nm)
    trace = SimpleNamespace(q=bent, missing_Nm=missing)
    run = SimpleNamespace(name=("test", "frontal", 0), keeps=keeps)
    assert trials._failure(run, trace, humerus) == expected


def test_who_cannot_do_a_task_at_all_has_no_movement_to_keep(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plans = [replace(p, person=KEEPS) for p in draw_plans(2, 2, ("par1",), "null")]
    persons = {
        plan.id: SimpleNamespace(usual=None, change={t: np.zeros((10, WAVES)) for t in TASKS})
        for plan in plans
    }
    study = SimpleNamespace(motions={("par1", task): MOTION for task in TASKS})

    def followed(_, runs):
        for case, own in runs.items():
            for run in own:
                missed = case == plans[0].id and run.name[1] == plans[0].hidden
                yield run, run.pose, None, trials.MISSED if missed else ""

    monkeypatch.setattr(trials, "_followed", followed)
    ways = trials._ways(study, plans, persons)
    assert list(ways) == [plans[1].id]
    kept = ways[plans[1].id][False, plans[1].hidden].motion
    np.testing.assert_allclose(kept.angles_rad[-1], MOTION.angles_rad[-1], atol=0.01)


def test_the_thorax_of_persons_lies_under_their_recorded_scapula() -> None:
    """Within it, contact would push with more than muscles can hold."""
    contact = replace(CONSTANTS.scapulothoracic_contact, points=("upper", "lower"))
    bones = skeleton_record()
    points_of_scapula = {
        "upper": PointRecord("scapula_r", (-0.12, -0.04, 0.0)),
        "lower": PointRecord("scapula_r", (-0.11, -0.13, 0.01)),
    }
    record = replace(
        bones,
        joints={
            "sc1": joint([0.02, 0.0, -0.02]),
            "ac1": joint([0.16, 0.0, 0.0]),
            "gh1": joint([0.0, 0.0, 0.0]),
        },
        markers=points_of_scapula,
        constants=replace(CONSTANTS, scapulothoracic_contact=contact),
        wrap_objects=(
            surface("serr_ant", "ellipsoid", "thorax", [0, -0.2, 0.08], 0.16, 0.23, 0.1),
        ),
    )
    angles = np.deg2rad(
        np.linspace([-40, 5, 0, 45, 5, 0, 20, 10, 0, 20], [-20, 15, 20, 55, 10, 5] + [50] * 4, 60)
    )
    angles[:, 3:6] += 0.05 * np.sin(np.linspace(0.0, 20.0, 60))[:, None]
    motion = Motion(np.linspace(0.0, 2.0, 60), angles)
    points = contact_points(record, trial_to_pose(angles)).reshape(-1, 3)

    def level(centre, radii):
        return level_set(points, np.array(centre), np.array(radii))

    through = level(*fit_ellipsoid(points, *prior_ellipsoid(record), 1.0))
    found = study.thorax_under(record, [motion])
    under = level(found["centre_m"], found["radii_m"])
    assert under.mean() > through.mean() + 0.01
    assert under.min() > through.min()
