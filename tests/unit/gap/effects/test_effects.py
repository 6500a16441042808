"""The contract of every effect, and the direction in which each family acts."""

from dataclasses import replace
from itertools import combinations

import gap_movement
import numpy as np
import pytest
from arm import arm_from_angles, parameters
from gap_movement import NODES, small_movement, small_record
from small_arm import small_motion

from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.benchmark.scored_case import absent_value
from scapulohumeral.gap.effects import humerus_sta
from scapulohumeral.gap.effects.base import Param, Setup
from scapulohumeral.gap.effects.external_force import POINTS
from scapulohumeral.gap.effects.frames import elevation, turn_frame
from scapulohumeral.gap.effects.library import FAMILIES, NEEDING, library, untestable
from scapulohumeral.gap.effects.scapula_sta import FULL_RAD, sliding
from scapulohumeral.gap.nominal import optimal_movement
from scapulohumeral.gap.nominal.force_levers import ALONG, force_levers
from scapulohumeral.gap.recording.observables import SensorSetup, difference, predicted
from scapulohumeral.gap.signatures.linearise import Linearised
from scapulohumeral.model.rotations import quaternion_multiply, relative_angle, trial_to_pose
from scapulohumeral.ocp.layout import REACTION_UNIT_N

pytestmark = pytest.mark.unit

# One muscle of the small arm stands for serratus anterior, which has a family of its own.
GROUPS = np.array(["serr_ant", *gap_movement.NAMES[1:]])
SETUP = replace(gap_movement.SETUP, groups=tuple(GROUPS))
LIBRARY = library(SETUP)
# One effect exists only where both sides recorded the same movements.
EVERY = (*LIBRARY, *humerus_sta.members(replace(SETUP, of_one_movement=True)))
BY_LABEL = {effect.label: effect for effect in LIBRARY}
RECORDER = SensorSetup(("EMG_a", "EMG_b"), np.array([[1.0, 0, 0], [0, 0.5, 0.5]]), True)
# One effect of every kind of change: dynamics, muscles, effort, bounds, objective.
SOLVED = [
    ("body/hand_load", 0),
    ("body/strength_loss/biceps", 0),
    ("body/strength_loss/serr_ant", 1),
    ("body/fatigue/biceps", 0),
    ("body/fibre_length/biceps", 1),
    ("body/glenoid_orientation", 1),
    ("body/joint_damping/GH", 0),
    ("body/passive_gh", 0),
    ("body/passive_girdle", 1),
    ("body/segment_mass/girdle", 0),
    ("body/serratus_path", 0),
    ("body/tendon_compliance/all", 0),
    ("body/thorax_surface", 1),
    ("control/co_contraction/EL", 0),
    ("control/pain_inhibition/biceps", 0),
    ("control/rate_weight", 0),
    ("control/stability_weight", 0),
    ("input/external_force/hand", 0),
    ("input/thorax_tilt", 0),
]


def small_body():
    """The small arm with a muscle for serratus anterior."""
    return replace(gap_movement.small_body(), groups=GROUPS)


def numbers(body):
    """Everything a body is made of, as one vector."""
    m = body.muscles
    return np.concatenate(
        [
            pack(body.parameters),
            m.max_isometric_force,
            m.optimal_fibre_length,
            np.broadcast_to(m.tendon_slack_length, (NODES - 1, 3)).ravel(),
            np.broadcast_to(m.capacity, (NODES - 1, 3)).ravel(),
            body.glenoid_rad,
            body.effort,
            body.floor,
            body.cap,
            body.seen,
            body.external_Nm.ravel(),
            body.external_N.ravel(),
            [body.stability, body.rates],
        ]
    )


def typical(effect, share=1.0):
    """Values on the way to typical ones."""
    return effect.physical(np.array([share * p.internal(p.typical) for p in effect.params]))


def test_all_families_are_there_once():
    assert len(FAMILIES) == len({(e.side, e.family) for e in EVERY}) == 26
    assert len(BY_LABEL) == len(LIBRARY)


@pytest.mark.parametrize("effect", EVERY, ids=lambda e: e.label)
def test_off_is_the_nominal_model(effect):
    body, record = small_body(), small_record()
    np.testing.assert_allclose(numbers(effect.apply(body, effect.off)), numbers(body), atol=1e-9)
    np.testing.assert_allclose(difference(effect.observe(record, effect.off), record), 0, atol=1e-9)


@pytest.mark.parametrize("effect", EVERY, ids=lambda e: e.label)
def test_typical_values_change_the_body_or_the_record(effect):
    body, record = small_body(), small_record()
    changed = not np.allclose(numbers(effect.apply(body, typical(effect))), numbers(body))
    seen = np.abs(difference(effect.observe(record, typical(effect)), record)).max() > 1e-3
    assert changed == effect.changes_body
    assert seen != effect.changes_body


def test_effects_on_the_body_commute():
    body = small_body()
    for one, two in combinations([e for e in LIBRARY if e.changes_body], 2):
        there = one.apply(two.apply(body, typical(two)), typical(one))
        back = two.apply(one.apply(body, typical(one)), typical(two))
        np.testing.assert_allclose(numbers(there), numbers(back), rtol=1e-9, atol=1e-12)


def test_small_effects_on_the_record_commute():
    """Large rotations do not; what is left is of second order in the amplitudes."""
    record = small_record()
    for one, two in combinations([e for e in LIBRARY if not e.changes_body], 2):
        small = typical(one, 1e-3), typical(two, 1e-3)
        there = one.observe(two.observe(record, small[1]), small[0])
        back = two.observe(one.observe(record, small[0]), small[1])
        alone = np.abs(difference(one.observe(record, small[0]), record)).max()
        assert np.abs(difference(there, back)).max() < 1e-2 * alone


def test_missing_observables_make_effects_untestable():
    motion_only = Setup(SETUP.groups, (), (), False)
    effects = library(motion_only)
    assert not any(e.family.startswith(("em", "electrode")) for e in effects)
    assert untestable(effects) == tuple(e for e in NEEDING if e.startswith("measurement/e"))
    assert untestable(LIBRARY) == ()


def test_simulations_have_no_errors_of_measurement_but_another_model():
    effects = library(replace(SETUP, simulated=True))
    assert all(effect.changes_body for effect in effects)
    assert {"passive_girdle", "strength_loss"} <= {effect.family for effect in effects}


def test_two_records_of_one_movement_differ_by_nothing_but_the_record():
    effects = library(replace(SETUP, of_one_movement=True))
    assert not any(effect.changes_body for effect in effects)
    kept = {e.label for e in LIBRARY if not e.changes_body}
    assert {e.label for e in effects} - kept == {"measurement/humerus_sta"}


def test_effects_on_a_scapula_that_nobody_measured_are_untestable():
    effects = library(replace(SETUP, unmeasured=frozenset({"scapula"})))
    lost = {e.label for e in LIBRARY} - {e.label for e in effects}
    assert lost == {"input/frame_misalignment/scapula", "measurement/scapula_sta"}
    assert set(untestable(effects)) == lost


def test_parameters_without_source_or_beyond_their_bounds_are_refused():
    with pytest.raises(ConfigError, match="a source"):
        Param("x", "1", 0.0, 0.0, 1.0, 0.5, 0.5, "")
    with pytest.raises(ConfigError, match="off 2.0"):
        Param("x", "1", 2.0, 0.0, 1.0, 0.5, 0.5, "table")


def test_effects_are_mistaken_for_families_that_there_are():
    families = {effect.family for effect in LIBRARY}
    for effect in EVERY:
        assert set(effect.mimics) <= families - {effect.family}


def test_names_of_parameters_tell_where_an_effect_is_absent():
    # Keys of blind cases name the first parameter, and hold no value at which it is off.
    for first in (effect.params[0] for effect in LIBRARY):
        assert absent_value(first.name) == first.off, first.name


def test_internal_scale_is_inverted():
    for effect in EVERY:
        for p in effect.params:
            assert p.internal(p.off) == 0.0
            assert p.physical(p.internal(p.typical)) == pytest.approx(p.typical)


@pytest.fixture(scope="module")
def solved(quaternion_equations):
    """The small movement, its solution, and the solution differentiated."""
    move = small_movement(quaternion_equations)
    move = move.with_nominal_body(replace(move.body, groups=GROUPS))
    point = move.solved(move.body, move.cold_start(), 500)
    return move, point, Linearised(move, move.body, point, 0.44, RECORDER)


def test_solutions_do_not_depend_on_where_they_started(solved):
    """A barrier that followed the start would make every difference of two solutions wrong."""
    move, cold, _ = solved
    warm = move.solved(move.body, cold, 200)
    np.testing.assert_allclose(warm.free, cold.free, atol=1e-5)


@pytest.mark.parametrize(("label", "column"), SOLVED)
def test_derivatives_agree_with_solving_again(solved, label, column, monkeypatch):
    # Two solutions this close differ by less than the usual tolerance.
    close = replace(optimal_movement.NOMINAL, tolerance=1e-9)
    monkeypatch.setattr(optimal_movement, "NOMINAL", close)
    move, point, local = solved
    effect = BY_LABEL[label]
    param = effect.params[column]
    # Larger steps meet the curvature of the solution, above all where bounds move.
    size = 0.002 * param.internal(param.typical)
    change = np.zeros(len(effect.params))
    records = []
    for sign in (1.0, -1.0):
        change[column] = sign * size
        body = effect.apply(move.body, effect.physical(change))
        x = move.trajectory(move.solved(body, point, 200))
        electrodes = body.seen * RECORDER.electrodes
        records.append(predicted(x, 0.44, RECORDER.channels, electrodes, True))
    expected = difference(*records) / (2.0 * size)
    slope = local.by_effect(effect, np.zeros(len(effect.params)))[column]
    scale = np.linalg.norm(expected, axis=0).max()
    assert scale > 0
    for k in range(expected.shape[1]):
        weight = np.linalg.norm(expected[:, k])
        if weight > 0.05 * scale:
            assert np.linalg.norm(slope[:, k] - expected[:, k]) < 0.05 * weight


def test_a_torn_cuff_weakens_supraspinatus_and_infraspinatus_alike():
    whole = replace(SETUP, groups=("supra", "infra", "biceps"))
    [torn] = [e for e in library(whole) if e.label == "body/strength_loss/cuff"]
    body = replace(small_body(), groups=np.array(whole.groups))
    left = torn.apply(body, np.array([0.4, 1.0])).muscles.max_isometric_force
    assert left / body.muscles.max_isometric_force == pytest.approx([0.4, 0.4, 1.0])
    assert "body/strength_loss/cuff" not in BY_LABEL


@pytest.mark.parametrize("left", [0.2, 0.7])
def test_fibres_that_are_gone_neither_pull_nor_cost_nor_show(left):
    """As if a share of equal fibres had gone and the others were active by 0.8."""
    body = BY_LABEL["body/strength_loss/brachialis"].apply(small_body(), np.array([left, left]))
    changed = body.groups == "brachialis"
    was = small_body().muscles
    active = body.muscles.max_isometric_force * body.muscles.capacity
    pull = active / (was.max_isometric_force * was.capacity)
    activation = 0.8 * body.cap
    np.testing.assert_allclose((pull * activation)[changed], left * 0.8)
    np.testing.assert_allclose(activation[changed] ** 2, left * 0.8**2)
    np.testing.assert_allclose((body.seen * activation)[changed], left * 0.8)
    np.testing.assert_array_equal(body.seen[~changed], 1.0)


def test_leaning_forward_pulls_the_arm_forward():
    body = small_body()
    gravity = np.array([0.0, -9.81, 0.0])
    upright = type(body)(**{**vars(body), "parameters": {**body.parameters, "gravity": gravity}})
    leaning = BY_LABEL["input/thorax_tilt"].apply(upright, np.array([10.0, 0.0]))
    assert leaning.parameters["gravity"][2] == pytest.approx(-9.81 * np.sin(np.deg2rad(10.0)))
    aside = BY_LABEL["input/thorax_tilt"].apply(upright, np.array([0.0, 10.0]))
    assert aside.parameters["gravity"][0] == pytest.approx(9.81 * np.sin(np.deg2rad(10.0)))


def test_skin_leaves_the_scapula_only_above_sixty_degrees():
    record = small_record()
    moved = BY_LABEL["measurement/scapula_sta"].observe(record, np.array([10.0, 0.0, 0.0]))
    angle = relative_angle(moved.pose[:, 4:8], record.pose[:, 4:8])
    lifted = elevation(record.pose) > np.deg2rad(60.0)
    assert lifted.any()
    assert not lifted.all()
    assert np.all((angle > 1e-9) == lifted)


def test_skin_error_has_no_kink_and_its_full_size_at_120_degrees():
    angle = np.deg2rad(np.linspace(40.0, 140.0, 1001))
    slope = np.gradient(sliding(angle), angle)
    assert np.abs(np.diff(slope)).max() < 0.02
    assert sliding(np.deg2rad(120.0)) / sliding(FULL_RAD) == pytest.approx(1.0)
    assert np.all(np.diff(sliding(angle)[angle > np.deg2rad(60.0)]) > 0.0)


def test_skin_of_the_upper_arm_loses_a_share_of_its_axial_rotation_and_nothing_else():
    [effect] = humerus_sta.members(replace(SETUP, of_one_movement=True))
    record = small_record()
    # An arm that rolls by 90 deg about its long axis beside all that it does.
    rolled = np.zeros((NODES, 3))
    rolled[:, 1] = np.linspace(0.0, np.pi / 2.0, NODES)
    arm = replace(record, pose=turn_frame(record.pose[:1].repeat(NODES, 0), "humerus", rolled))
    np.testing.assert_allclose(humerus_sta.axial_rotation(arm.pose), rolled[:, 1], atol=1e-9)
    seen = effect.observe(arm, np.array([0.4]))
    np.testing.assert_allclose(humerus_sta.axial_rotation(seen.pose), 0.6 * rolled[:, 1], atol=1e-9)
    np.testing.assert_allclose(elevation(seen.pose), elevation(arm.pose), atol=1e-9)
    np.testing.assert_allclose(seen.pose[:, :8], arm.pose[:, :8])
    # What one record loses, the other has more of.
    back = effect.observe(seen, np.array([-0.4 / 0.6]))
    np.testing.assert_allclose(difference(back, arm), 0.0, atol=1e-6)


@pytest.mark.parametrize("segment", ["thorax", "scapula", "humerus"])
def test_a_turned_frame_leaves_the_other_segments(segment):
    record = small_record()
    effect = BY_LABEL[f"input/frame_misalignment/{segment}"]
    moved = effect.observe(record, np.array([4.0, -3.0, 2.0]))

    def scapula(pose):
        return quaternion_multiply(pose[:, 0:4], pose[:, 4:8])

    def humerus(pose):
        return quaternion_multiply(scapula(pose), pose[:, 8:12])

    angle = np.sqrt(4.0**2 + 3.0**2 + 2.0**2)
    expected = {"thorax": (angle, angle), "scapula": (angle, 0.0), "humerus": (0.0, angle)}
    for turned, size in zip((scapula, humerus), expected[segment], strict=True):
        found = np.rad2deg(relative_angle(turned(moved.pose), turned(record.pose)))
        np.testing.assert_allclose(found, size, atol=1e-6)


def test_emg_effects_act_on_their_channels():
    record = small_record()
    gain = BY_LABEL["measurement/emg_gain/EMG_a"].observe(record, np.array([2.0])).emg
    np.testing.assert_allclose(gain, record.emg * [2.0, 1.0])
    mixed = BY_LABEL["measurement/emg_crosstalk/EMG_a>EMG_b"].observe(record, np.array([0.3])).emg
    np.testing.assert_allclose(mixed[:, 1] - record.emg[:, 1], 0.3 * record.emg[:, 0])
    np.testing.assert_allclose(mixed[:, 0], record.emg[:, 0])
    early = BY_LABEL["measurement/emd"].observe(record, np.array([40.0])).emg
    # The first channel rises by 0.3 over 0.44 s.
    np.testing.assert_allclose(early[:, 0] - record.emg[:, 0], 0.3 * 0.04 / 0.44, rtol=1e-6)


def test_an_electrode_slides_with_elevation():
    record = small_record()
    shift = BY_LABEL["measurement/electrode_shift/EMG_b"]
    ratio = shift.observe(record, np.array([1.5, 0.8])).emg / record.emg
    np.testing.assert_allclose(ratio[:, 0], 1.0)
    share = elevation(record.pose) / np.deg2rad(120.0)
    np.testing.assert_allclose(np.log(ratio[:, 1]), np.log(0.8) + share * np.log(1.5))


def test_fatigue_grows_and_takes_active_force_alone():
    body = small_body()
    tired = BY_LABEL["body/fatigue/biceps"].apply(body, np.array([0.6])).muscles
    left = tired.capacity / body.muscles.capacity
    np.testing.assert_allclose(left[:, GROUPS != "biceps"], 1.0)
    lost = 1.0 - left[:, GROUPS == "biceps"].ravel()
    np.testing.assert_allclose(np.diff(lost), np.diff(lost).mean())
    assert lost.mean() == pytest.approx(0.2)  # half of what is lost at the end
    np.testing.assert_array_equal(tired.max_isometric_force, body.muscles.max_isometric_force)


@pytest.mark.parametrize(
    ("member", "segments"),
    [
        ("arm", {"humerus", "forearm"}),
        ("girdle", {"clavicle", "scapula"}),
        ("forearm", {"forearm"}),
    ],
)
def test_masses_of_segments(member, segments):
    was = small_body().parameters
    now = BY_LABEL[f"body/segment_mass/{member}"].apply(small_body(), np.array([1.3])).parameters
    for segment in ("clavicle", "scapula", "humerus", "forearm"):
        for block in ("mass", "inertia"):
            ratio = 1.3 if segment in segments else 1.0
            name = f"{block}_{segment}"
            np.testing.assert_allclose(now[name], ratio * np.asarray(was[name]))


def test_a_thorax_further_back_and_wider():
    was = small_body().parameters
    now = BY_LABEL["body/thorax_surface"].apply(small_body(), np.array([1.1, 5.0])).parameters
    np.testing.assert_allclose(now["thorax_radii"], 1.1 * np.asarray(was["thorax_radii"]))
    np.testing.assert_allclose(now["thorax_centre"] - was["thorax_centre"], [0.0, 0.0, 0.005])


def test_springs_of_the_girdle_leave_the_arm_alone():
    was = small_body().parameters
    now = BY_LABEL["body/passive_girdle"].apply(small_body(), np.array([3.0, 2.0])).parameters
    np.testing.assert_allclose(now["joint_stiffness"] / was["joint_stiffness"], [3, 3, 1, 1])
    np.testing.assert_allclose(now["spring_torque"] - was["spring_torque"], [2, 2, 0, 0])


def test_longer_arms_of_serratus_add_a_share_of_its_pull():
    body = small_body()
    loaded = BY_LABEL["body/serratus_path"].apply(body, np.array([1.5]))
    pull = body.pull[:, :, GROUPS == "serr_ant"][..., 0]
    np.testing.assert_allclose(np.hstack([loaded.external_Nm, loaded.external_N]), 0.5 * pull)


@pytest.mark.parametrize(
    ("label", "scaled"),
    [
        ("control/stability_weight", {"stability"}),
        ("control/rate_weight", {"regularisation", "excitation_rate"}),
    ],
)
def test_weights_of_the_cost(quaternion_equations, label, scaled):
    move = small_movement(quaternion_equations)
    body = BY_LABEL[label].apply(move.body, np.array([4.0]))
    was, now = (vars(move.parts(b).objective.weights) for b in (move.body, body))
    for name, value in was.items():
        assert now[name] == (4.0 * value if name in scaled else value)


def test_forces_act_where_levers_are_known():
    assert set(POINTS) == set(ALONG)


@pytest.mark.parametrize("point", POINTS)
def test_levers_are_how_the_point_moves_with_each_speed(quaternion_equations, point):
    """Velocities of the point by unit speeds, from mechanics of its own."""
    angles, p = small_motion(4), parameters()
    levers = force_levers(quaternion_equations, unpack(pack(p)), trial_to_pose(angles))[point]
    p["place"] = ALONG[point] * np.asarray(p["com_load"])
    for node in range(4):
        for dof, speed in enumerate(np.eye(10)):
            _, velocity = arm_from_angles(p, angles[node], speed).at("forearm", "place")
            np.testing.assert_allclose(levers[node, dof], velocity, atol=1e-9)


def test_the_hand_moves_along_its_levers(quaternion_equations):
    """Finite differences of the place of the hand, elbow and clavicle, to sign and size."""
    angles, p, step = small_motion(3), parameters(), 1e-6
    levers = force_levers(quaternion_equations, unpack(pack(p)), trial_to_pose(angles))["hand"]

    def place(values):
        return arm_from_angles(p, values, np.zeros(10)).at("forearm", "com_load")[0]

    for node in range(3):
        # Elbow flexion is a speed as it stands; the last clavicle angle turns about its own x.
        for angle, dof in ((9, 9), (2, 0)):
            change = step * np.eye(10)[angle]
            slope = (place(angles[node] + change) - place(angles[node] - change)) / (2.0 * step)
            np.testing.assert_allclose(levers[node, dof], slope, atol=1e-7)


def test_a_force_at_the_hand_loads_the_equations_as_a_weight_does(quaternion_equations):
    """All thirteen equations, the force on the humeral head included."""
    pose, p = trial_to_pose(small_motion(5)), parameters()
    still = np.hstack([pose, np.zeros((5, 23))])
    loads = [
        quaternion_equations.residual(still, pack({**p, "mass_load": mass})) for mass in (0.0, 2.0)
    ]
    lever = force_levers(quaternion_equations, unpack(pack(p)), pose)["hand"]
    expected = lever @ (2.0 * np.asarray(p["gravity"]))
    np.testing.assert_allclose(loads[1] - loads[0], expected, atol=1e-9)


def test_external_forces_enter_the_equations_in_their_units(quaternion_equations):
    move = small_movement(quaternion_equations)
    start = move.cold_start().free
    effect = BY_LABEL["input/external_force/forearm"]
    loaded = effect.apply(move.body, np.array([3.0, -1.0, 2.0]))
    rows = [
        move.parts(body).collocation.constraints(start).reshape(-1, NODES - 1)
        for body in (move.body, loaded)
    ]
    change = (rows[1] - rows[0])[13:26].T
    expected = move.body.levers["forearm"] @ np.array([-1.0, 3.0, 2.0])
    expected[:, 10:] /= REACTION_UNIT_N
    np.testing.assert_allclose(change, expected, atol=1e-9)
