"""Effects, recordings and drawing of blind cases."""

import csv
from collections import Counter
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from arm import parameters
from skeleton import muscle, skeleton_record
from small_arm import small_motion

from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import (
    pose_to_trial,
    quaternion_multiply,
    quaternion_to_matrix,
    relative_angle,
    trial_to_pose,
)
from simulated_persons import case_person
from simulated_persons.arm import Anatomy, Arm
from simulated_persons.body import no_extra_torques
from simulated_persons.effects import (
    LIBRARY_LIKE,
    UNKNOWN,
    co_contraction,
    strength_loss,
    tilted,
)
from simulated_persons.footprint import channel_names, difference, floor, footprints
from simulated_persons.movement import (
    CHANGE_DEG,
    SETTLE_S,
    draw_change,
    draw_variation,
    movement_made,
    no_variation,
    wished_poses,
)
from simulated_persons.muscles import Muscles
from simulated_persons.observation import (
    Recording,
    add_noise,
    electrode_matrix,
    perfect_measurement,
    record,
    turned_frames,
)
from simulated_persons.plan import (
    CHANGES,
    KEEPS,
    PERSONS,
    SHARES,
    YIELDS,
    draw_plans,
    redrawn,
)
from simulated_persons.scatter import (
    ANGLE_DEG,
    EL_DEG,
    LOG_DURATION,
    LOG_SCALE,
    PHASE_SHIFT,
    WAVES,
    curves,
    draw_scale,
)
from simulated_persons.simulation import TICK_S, Control

pytestmark = pytest.mark.unit

MOTION = Motion(np.linspace(0.0, 2.0, 60), small_motion(60))


@pytest.fixture
def anatomy(repository: Path) -> Anatomy:
    """The muscles' names and groups; paths that all cross all joints."""
    with (repository / "config" / "model" / "muscles.csv").open(encoding="utf-8") as stream:
        rows = [muscle(row["muscle"], group=row["group"]) for row in csv.DictReader(stream)]
    arms = np.ones((1, len(rows), 13))
    skeleton = replace(skeleton_record(), muscles=tuple(rows))
    return Anatomy(skeleton, {}, SimpleNamespace(gradients=lambda _: arms))


@pytest.fixture
def arm(anatomy: Anatomy) -> Arm:
    """A person with equal muscles."""
    ones = np.ones((1, len(anatomy.names)))
    muscles = Muscles(200 * ones, 0.1 * ones, 0.1 * ones, 0.04 * ones, ones, ones, ones, ones)
    glenoid = np.zeros((1, 2))
    control = Control(ones, 0 * ones, ones, np.ones(1), np.ones(1), glenoid)
    measurement = perfect_measurement(np.ones(8))
    own = unpack(pack(parameters()))
    return Arm(anatomy, own, muscles, no_extra_torques(1), control, measurement)


def flat(arm: Arm) -> np.ndarray:
    """Every number of an arm."""
    parts = [arm.muscles, arm.extra, arm.control, arm.measurement]
    values = [np.ravel(v) for part in parts for v in vars(part).values()]
    return np.concatenate([pack(arm.parameters), *values])


@pytest.mark.parametrize("draw", [*LIBRARY_LIKE, *UNKNOWN], ids=lambda draw: draw.__name__)
def test_effects_change_the_arm_and_are_drawn_again_alike(draw, arm: Arm) -> None:
    before = flat(arm)
    injection = draw(np.random.default_rng(3))
    changed = flat(injection.apply(arm))
    assert not np.array_equal(changed, before)
    np.testing.assert_array_equal(flat(arm), before)
    np.testing.assert_array_equal(changed, flat(draw(np.random.default_rng(3)).apply(arm)))
    assert injection.family == draw.__name__


def test_a_tear_leaves_the_stated_force(arm: Arm) -> None:
    injection = strength_loss(np.random.default_rng(5))
    group = injection.label.split("/")[2]
    members = arm.anatomy.groups == group
    # Lines of a group differ up to five times.
    uneven = np.linspace(100.0, 500.0, len(members))[None]
    arm = replace(arm, muscles=replace(arm.muscles, max_force=uneven))
    force = injection.apply(arm).muscles.max_force
    share = force[0, members].sum() / uneven[0, members].sum()
    assert share == pytest.approx(injection.amplitude)
    left = force / uneven
    assert np.all(left[0, ~members] == 1.0)
    assert np.sum((left > 0.04) & (left < 0.999)) <= 1


def test_co_contraction_is_a_floor(arm: Arm) -> None:
    injection = co_contraction(np.random.default_rng(5))
    assert np.all(injection.apply(arm).control.tonic == injection.amplitude)


def test_a_thorax_that_leans_forward_sees_gravity_pull_forward() -> None:
    """x right, y up, z back: what is down for the world lies in front of the leaning chest."""
    down = tilted(np.array([0.0, -9.81, 0.0]), 10.0)
    assert down[2] == pytest.approx(-9.81 * np.sin(np.deg2rad(10.0)))
    assert down[1] < 0


def test_electrodes_hear_their_group_only(anatomy: Anatomy) -> None:
    matrix = electrode_matrix(anatomy.names, anatomy.groups)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
    heard = {str(g) for g in anatomy.groups[matrix.any(axis=0)]}
    assert heard == {"trap_clav", "delt_clav", "delt_scap", "infra", "trap_scap", "serr_ant"}


def trace(anatomy: Anatomy) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A pose sequence, one burst of all muscles, and of the reaction."""
    pose = wished_poses(MOTION, no_variation())
    time = TICK_S * np.arange(len(pose))
    burst = np.exp(-(((time - time.mean()) / 0.4) ** 2))
    return (
        pose,
        np.tile(burst[:, None], (1, len(anatomy.names))),
        500.0 * np.outer(burst, np.eye(3)[0]),
    )


def test_recording_without_errors_is_the_motion(anatomy: Anatomy) -> None:
    pose, excitation, reaction = trace(anatomy)
    matrix = electrode_matrix(anatomy.names, anatomy.groups)
    recording = record(pose, excitation, reaction, perfect_measurement(np.ones(8)), matrix)
    cut = round(SETTLE_S / TICK_S)
    expected = np.unwrap(pose_to_trial(pose[cut:]), axis=0)
    np.testing.assert_allclose(recording.angles_rad, expected, atol=1e-9)
    assert recording.time_s[0] == 0.0
    assert 0.8 < recording.emg.max() < 1.0  # the envelope filter rounds the burst
    # What the glenoid does to the humerus, the humerus does to the glenoid.
    assert -500.0 < recording.force_N[:, 0].min() < -450.0
    np.testing.assert_allclose(recording.force_N[:, 1:], 0.0)


def test_errors_of_the_measurement(anatomy: Anatomy) -> None:
    *motion, matrix = *trace(anatomy), electrode_matrix(anatomy.names, anatomy.groups)
    perfect = perfect_measurement(np.ones(8))
    plain = record(*motion, perfect, matrix)
    mixing = np.zeros((8, 8))
    mixing[2, 3] = 0.5
    mixed = record(*motion, replace(perfect, crosstalk=mixing), matrix)
    np.testing.assert_allclose(mixed.emg[:, 2], 1.5 * plain.emg[:, 2])
    np.testing.assert_allclose(mixed.emg[:, 3], plain.emg[:, 3])
    late = record(*motion, replace(perfect, delay_s=0.1), matrix)
    assert plain.emg[:, 0].argmax() - late.emg[:, 0].argmax() == 10


def test_turned_frames_turn_by_their_angle_only_where_they_should() -> None:
    pose = trial_to_pose(small_motion(20))
    turn = np.array([0.0, 0.1, 0.0])
    turned = turned_frames(pose, replace(perfect_measurement(np.ones(8)), scapula_rad=turn))
    np.testing.assert_allclose(relative_angle(turned[:, 4:8], pose[:, 4:8]), 0.1, atol=1e-9)
    np.testing.assert_allclose(turned[:, :4], pose[:, :4], atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(turned[:, 8:12], axis=1), 1.0)
    same = turned_frames(pose, perfect_measurement(np.ones(8)))
    np.testing.assert_allclose(same, pose, atol=1e-12)


def test_footprint_counts_standard_errors() -> None:
    time, angles = np.linspace(0, 1, 50), small_motion(50)
    force = np.tile([300.0, 400.0, 0.0], (50, 1))
    reference = Recording(time, angles, np.zeros((50, 8)), force)
    bent = angles + np.deg2rad(5.2) * (np.arange(10) == 9)
    shifted = Recording(time, bent, np.zeros((50, 8)), force + [0.0, 0.0, 70.0])
    error = floor(reference, 2, emg=False, contact=True, referenced=True)
    size = footprints(difference(shifted, reference, emg=False, contact=True) / error)
    assert size[9] == pytest.approx(5.2 / EL_DEG, abs=1e-6)
    np.testing.assert_allclose(size, [*[0.0] * 9, size[9], 0.0, 0.0, 70.0 / 35.0], atol=1e-6)
    assert len(channel_names(emg=False, contact=True)) == 13
    alone = floor(reference, 2, emg=True, contact=True, referenced=False)
    expected = np.hypot(ANGLE_DEG / np.sqrt(2.0), 4.0)
    np.testing.assert_allclose(alone[:, :10], np.tile(expected, (len(alone), 1)))
    np.testing.assert_allclose(alone[:, 10:18], np.hypot(0.015 / np.sqrt(2.0), 0.08))
    np.testing.assert_allclose(alone[:, 18:], np.hypot(35.0 / np.sqrt(2.0), 150.0))


def test_noise_is_smooth_and_differs_between_repeats() -> None:
    rng = np.random.default_rng(1)
    time, force = np.linspace(0, 2, 201), np.full((201, 3), 400.0)
    clean = Recording(time, small_motion(201), np.full((201, 8), 0.2), force)
    noisy = [add_noise(clean, rng, 1.5) for _ in range(200)]
    spread = np.rad2deg(np.std([trial.angles_rad for trial in noisy], axis=0))
    size = np.sqrt(np.mean(spread**2, axis=0))
    np.testing.assert_allclose(size[:6], 1.5 * ANGLE_DEG[:6], rtol=0.15)
    np.testing.assert_allclose(size[6:], 0.5, rtol=0.2)
    steps = np.abs(np.diff(noisy[0].emg, axis=0)).max()
    assert steps < 0.005
    errors = np.std([trial.force_N for trial in noisy], axis=0).mean(axis=0)
    assert np.all((errors > 5.0) & (errors < 15.0))


def test_repeats_start_at_rest_and_vary() -> None:
    rng = np.random.default_rng(1)
    still = wished_poses(MOTION, no_variation())
    assert not np.diff(still[: round(SETTLE_S / TICK_S)], axis=0).any()
    np.testing.assert_allclose(still[-1], trial_to_pose(MOTION.angles_rad)[-1], atol=1e-6)
    varied = wished_poses(MOTION, draw_variation(rng, 1.0))
    apart = np.rad2deg(relative_angle(varied[0, 8:12], still[0, 8:12]))
    assert 0.0 < apart < 20.0
    # Without timing, clavicle and scapula are where the arm asks for.
    path = replace(draw_variation(rng, 1.0), pace=1.0, shift=np.zeros(4))
    np.testing.assert_allclose(wished_poses(MOTION, path)[:, :8], still[:, :8], atol=1e-12)


def test_repeats_scatter_as_recorded_ones_do() -> None:
    """Their path by the table of recorded repeats, and their timing likewise."""
    rng = np.random.default_rng(2)
    drawn = [draw_variation(rng, 1.0) for _ in range(400)]
    phase = np.linspace(0.0, 1.0, 101)
    paths = np.rad2deg([curves(phase, one.path_rad) for one in drawn])
    size = np.sqrt(np.mean(paths**2, axis=(0, 1)))
    np.testing.assert_allclose(size[6:], ANGLE_DEG[6:], rtol=0.1)
    shifts = np.std([one.shift for one in drawn], axis=0)
    np.testing.assert_allclose(shifts, PHASE_SHIFT, rtol=0.15)
    assert np.std([np.log(one.pace) for one in drawn]) == pytest.approx(LOG_DURATION, rel=0.15)


def test_scales_of_tasks_leave_the_table_right_on_the_whole() -> None:
    rng = np.random.default_rng(5)
    scales = np.array([draw_scale(rng) for _ in range(4000)])
    assert np.mean(scales**2) == pytest.approx(1.0, abs=0.1)
    assert np.std(np.log(scales)) == pytest.approx(LOG_SCALE, rel=0.05)


def test_timing_shifts_a_movement_without_a_kink_and_stays_inside_it() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        varied = replace(draw_variation(rng, 1.0), path_rad=np.zeros((10, WAVES)))
        elbow = wished_poses(MOTION, varied)[:, 12]
        low, high = np.sort(MOTION.angles_rad[[0, -1], 9])
        assert np.all((elbow > low - 1e-3) & (elbow < high + 1e-3))
        assert np.abs(np.diff(elbow, 2)).max() < 1e-3


def test_a_task_done_otherwise_is_so_in_all_tasks_partly_alike() -> None:
    rng = np.random.default_rng(4)
    changes = [draw_change(rng, ("frontal", "sagittal")) for _ in range(300)]
    one, other = (np.array([c[task].ravel() for c in changes]) for task in changes[0])
    moving = one.std(axis=0) > 0
    correlation = np.mean(one[:, moving] * other[:, moving]) / np.mean(one[:, moving] ** 2)
    assert correlation == pytest.approx(0.7, abs=0.07)
    paths = np.rad2deg([curves(np.linspace(0, 1, 101), c["frontal"]) for c in changes])
    size = np.sqrt(np.mean(paths**2, axis=(0, 1)))
    np.testing.assert_allclose(size, CHANGE_DEG, rtol=0.15)


def test_skin_markers_miss_axial_rotation_alone() -> None:
    """The clavicle rolls about x and takes the scapula's place with it, in the record only."""
    pose = trial_to_pose(small_motion(40))
    axial = np.zeros((2, 3))
    axial[0, 0], axial[1, 1] = 0.2, 0.1
    turned = turned_frames(pose, replace(perfect_measurement(np.ones(8)), axial_rad=axial))
    np.testing.assert_allclose(relative_angle(turned[:, :4], pose[:, :4]), 0.2, atol=1e-9)
    x_axis = [quaternion_to_matrix(p[:, :4])[:, :, 0] for p in (turned, pose)]
    np.testing.assert_allclose(*x_axis, atol=1e-9)

    def scapula(p):
        return quaternion_multiply(p[:, :4], p[:, 4:8])

    np.testing.assert_allclose(relative_angle(scapula(turned), scapula(pose)), 0.0, atol=1e-7)
    twist = relative_angle(turned[:, 8:12], pose[:, 8:12])
    expected = 0.1 * np.sqrt(2.0) * np.abs(np.cos(np.pi * np.linspace(0.0, 1.0, 40)))
    np.testing.assert_allclose(twist, expected, atol=1e-7)


def test_electrodes_slide_with_the_arm_and_hearts_beat(anatomy: Anatomy) -> None:
    *motion, matrix = *trace(anatomy), electrode_matrix(anatomy.names, anatomy.groups)
    perfect = perfect_measurement(np.ones(8))
    plain = record(*motion, perfect, matrix)
    slid = record(*motion, replace(perfect, slope=2.0 * np.ones(8)), matrix).emg / plain.emg
    assert np.all(np.diff(slid[:, 0]) * np.diff(slid[:, 0])[len(slid) // 2] >= -1e-9)
    assert 1.0 < slid.min() < slid.max() < 2.0
    beating = record(*motion, replace(perfect, heart=0.2 * (np.arange(8) == 7)), matrix)
    added = beating.emg - plain.emg
    assert not added[:, :7].any()
    assert added[:, 7].max() == pytest.approx(0.2)
    assert added[:, 7].min() == pytest.approx(0.0, abs=1e-3)


def test_the_movement_made_is_what_the_arm_did_without_rest() -> None:
    pose = wished_poses(MOTION, no_variation())
    found = movement_made(pose)
    assert found.time_s[-1] == pytest.approx(MOTION.time_s[-1] + 0.15, abs=0.03)
    np.testing.assert_allclose(found.angles_rad[-1], MOTION.angles_rad[-1], atol=0.01)


def test_plans_follow_their_seed_and_hold_every_family() -> None:
    plans = draw_plans(4, 80, ("par1", "par2"))
    again = draw_plans(4, 80, ("par1", "par2"))
    assert [plan.id for plan in plans] == [plan.id for plan in again]
    assert [plan.id for plan in plans] != [plan.id for plan in draw_plans(5, 80, ("par1", "par2"))]
    kinds = Counter(plan.kind for plan in plans)
    assert sum(kinds.values()) == 80
    assert set(kinds) == set(SHARES)
    families = {p.injections[0].family for p in plans if p.kind == "single"}
    assert families == {draw.__name__ for draw in LIBRARY_LIKE}
    assert {(plan.emg, plan.reference) for plan in plans} == {
        (emg, reference) for emg in (True, False) for reference in (True, False)
    }
    assert {plan.person for plan in plans} == set(PERSONS)
    for plan in plans:
        # What a null or a changed strategy differs by is nothing else.
        assert plan.person != CHANGES or plan.kind not in ("null", "strategy", "salted")
        assert plan.otherwise == (plan.person == CHANGES or plan.kind == "strategy")
    # Recorded motions have no simulated joint force.
    assert {plan.plant for plan in plans if plan.contact} == {"P1"}
    for plan in plans:
        assert plan.hidden not in plan.tasks


@pytest.mark.parametrize("kind", ["single", "pair", "unknown"])
def test_what_is_wrong_with_emg_alone_comes_with_emg(kind: str, arm: Arm) -> None:
    """Told by what the effect changes in a recording of the arm."""
    for plan in draw_plans(4, 60, ("par1",), kind):
        for injection in plan.injections:
            before, after = arm.measurement, injection.apply(arm).measurement
            heard = ("emg_gain", "crosstalk", "delay_s", "speed_gain", "slope", "heart")
            if any(not np.array_equal(getattr(before, k), getattr(after, k)) for k in heard):
                assert plan.emg, injection.label


def test_effects_come_where_test_and_reference_can_differ_by_them() -> None:
    """No body has another thorax in its reference, and without one no movement is another."""
    singles = [*draw_plans(4, 90, ("par1",), "single"), *draw_plans(4, 60, ("par1",), "pair")]
    of_model = [p for p in singles if any("thorax_surface" in i.label for i in p.injections)]
    strategies = draw_plans(4, 40, ("par1",), "strategy")
    assert {plan.reference for plan in of_model} == {False}
    assert {plan.reference for plan in strategies} == {True}


def test_electrodes_put_on_again_differ_as_published(arm: Arm) -> None:
    """Andersen et al. 2014: 0.22 to 0.34 between days, of which repeats make up 0.15."""
    rng = np.random.default_rng(6)
    again = [case_person._another_session(arm.measurement, False, rng) for _ in range(200)]
    spread = np.std(np.log([one.emg_gain / arm.measurement.emg_gain for one in again]))
    least, most = (np.sqrt(between**2 - 0.15**2) for between in (0.22, 0.34))
    assert least < spread < most


def test_a_case_drawn_again_keeps_its_families() -> None:
    plan = next(p for p in draw_plans(4, 40, ("par1",)) if p.kind == "pair")
    other = redrawn(plan, 1)
    assert [i.family for i in other.injections] == [i.family for i in plan.injections]
    assert other.id == plan.id
    assert other.seed != plan.seed


@pytest.mark.parametrize("count", range(1, 8))
def test_few_cases_can_be_drawn(count: int) -> None:
    kinds = [plan.kind for plan in draw_plans(3, count, ("par1", "par2"))]
    assert len(kinds) == count
    assert len(set(kinds)) == min(count, len(SHARES))


def test_open_cases_of_one_kind() -> None:
    assert {plan.kind for plan in draw_plans(1, 12, ("par1",), "null")} == {"null"}


def test_motion_of_a_person_who_keeps_it_shows_no_effect_on_the_body() -> None:
    plans = draw_plans(6, 120, ("par1",), "single")
    for plan in plans:
        blind = replace(plan, person=KEEPS, emg=False, contact=False)
        record_only = plan.injections[0].label.startswith(("input/frame", "measurement"))
        assert blind.may_show == record_only
        assert replace(blind, emg=True).may_show
        assert replace(blind, person=YIELDS).may_show
