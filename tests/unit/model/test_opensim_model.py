"""The model in OpenSim against the original file, the published numbers and mechanics.

Run as ``pytest -m opensim``: opensim cannot share a process with casadi.
"""

import sys
from dataclasses import replace

import numpy as np
import opensim
import pandas as pd
import pytest
from opensim_dynamics import inverse_dynamics
from places import REPOSITORY

from scapulohumeral.dynamics.participant_parameters import forearm
from scapulohumeral.errors import ModelError
from scapulohumeral.model import opensim_model as om
from scapulohumeral.model.choices import ModelChoices
from scapulohumeral.model.girdle_range import resting
from scapulohumeral.model.muscle_paths import opensim_sampling as sampling
from scapulohumeral.model.muscle_paths.pose_region import (
    Region,
    draw_poses,
    recorded_angles,
    recorded_poses,
)
from scapulohumeral.model.muscle_paths.thorax_clearance import (
    arm_hanging,
    attachment_levels,
    is_clear,
    segment_frames,
)
from scapulohumeral.model.participant import Participant, read_participant
from scapulohumeral.model.participant_file import list_participants
from scapulohumeral.model.record import ModelRecord, read_record, write_record
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    pose_to_trial,
    quaternion_multiply,
    rotation_vector_to_quaternion,
    trial_to_pose,
)
from scapulohumeral.model.tables import read_tables

pytestmark = pytest.mark.opensim

DATA = REPOSITORY / "tests" / "data"
PARTICIPANTS = REPOSITORY / "config" / "participants"
TABLES = read_tables(REPOSITORY / "config" / "model")
PUBLISHED = pd.read_csv(DATA / "published_segments.csv")


def without_daily_tasks(person: Participant) -> Participant:
    """A participant who was recorded in elevations only."""
    return replace(person, trials={n: t for n, t in person.trials.items() if not t.daily_task})


def flattened(person: Participant) -> ModelRecord:
    """The model with the surface under serratus anterior that the study takes."""
    choices = ModelChoices(serratus_path="flattened_rescaled")
    model = om.participant_model(TABLES, person, choices)
    return om.model_record(model, person, TABLES, choices)


@pytest.fixture(scope="module")
def base():
    return om.build_model(TABLES)


@pytest.fixture(scope="module")
def participant():
    return read_participant(PARTICIPANTS, "par2")


@pytest.fixture(scope="module")
def model(participant):
    return om.participant_model(TABLES, participant, ModelChoices())


@pytest.fixture(scope="module")
def record(model, participant):
    return om.model_record(model, participant, TABLES, ModelChoices())


@pytest.fixture(scope="module")
def samples(model, record, participant):
    rng = np.random.default_rng(5)
    poses = draw_poses(
        recorded_poses(participant), Region(15.0), 40, rng, lambda p: is_clear(record, p)
    )
    return sampling.sample_geometry(model, poses, TABLES.active_muscles)


def test_solver_library_is_absent():
    assert "casadi" not in sys.modules


def test_lengths_are_those_of_the_original_file(base):
    oracle = pd.read_csv(DATA / "das3_base_lengths.csv")
    coordinates = [column for column in oracle.columns if column.endswith("_rad")]
    muscles = [column for column in oracle.columns if column not in coordinates]
    lengths = sampling.muscle_lengths(
        base,
        oracle[coordinates].to_numpy(),
        [name.removesuffix("_m") for name in muscles],
        [name.removesuffix("_rad") for name in coordinates],
    )
    assert lengths.shape == (30, 137)
    np.testing.assert_allclose(lengths, oracle[muscles].to_numpy(), rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("name", list_participants(PARTICIPANTS))
def test_scaled_segments_are_the_published_ones(name):
    model = om.build_model(TABLES)
    om.scale_model(model, read_participant(PARTICIPANTS, name))
    published = PUBLISHED[PUBLISHED.participant == name].set_index("segment")
    assert len(published) == 7
    for segment, row in published.iterrows():
        body = model.getBodySet().get(segment)
        center, inertia = body.getMassCenter(), body.getInertia()
        values = [body.getMass(), *(center.get(i) for i in range(3))]
        values += [vector.get(i) for vector in (inertia.getMoments(), inertia.getProducts())
                   for i in range(3)]  # fmt: skip
        np.testing.assert_allclose(values, row.iloc[1:].to_numpy(float), rtol=1e-12, atol=1e-16)


def test_scaled_fibre_and_tendon_are_the_published_ones():
    # Motions/par1/scaled_1LU_GH.osim of zoufaond/Quaternion-Predictive-SHR, muscle trap_scap_1.
    model = om.build_model(TABLES)
    om.scale_model(model, read_participant(PARTICIPANTS, "par1"))
    muscle = model.getMuscles().get("trap_scap_1")
    assert muscle.getOptimalFiberLength() == pytest.approx(0.2031327915346364, rel=1e-12)
    assert muscle.getTendonSlackLength() == pytest.approx(0.014047910894511507, rel=1e-12)


def test_anthropometric_arm_is_a_fraction_of_body_mass(participant):
    model = om.participant_model(TABLES, participant, ModelChoices(masses="anthropometric"))
    masses = {body.getName(): body.getMass() for body in model.getBodySet()}
    # De Leva 1996: upper arm 2.71 % of a man, 2.55 % of a woman; 83 kg on average.
    assert masses["humerus_r"] == pytest.approx(83.0 * (0.0271 + 0.0255) / 2)
    assert masses["ulna_r"] + masses["radius_r"] == pytest.approx(83.0 * (0.0162 + 0.0138) / 2)
    published = PUBLISHED[PUBLISHED.participant == "par2"].set_index("segment").mass_kg
    ratio = masses["scapula_r"] / masses["humerus_r"]
    assert ratio == pytest.approx(published["scapula_r"] / published["humerus_r"])


def test_anthropometric_arm_has_its_mass_where_de_leva_has_it(participant):
    choices = ModelChoices(masses="anthropometric")
    model = om.participant_model(TABLES, participant, choices)
    record = om.model_record(model, participant, TABLES, choices)
    humerus, elbow = record.segments["humerus_r"], np.array(record.joints["hu"].location_m)
    length = np.linalg.norm(elbow)
    np.testing.assert_allclose(humerus.com_m, (0.5772 + 0.5754) / 2 * elbow)
    xx, yy, zz, xy, xz, yz = humerus.inertia_kgm2
    inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = np.linalg.eigvalsh(inertia) / (humerus.mass_kg * length**2)
    # Radii of gyration of women and men: sagittal, transverse and longitudinal.
    across = np.mean(np.square([(0.285 + 0.278) / 2, (0.269 + 0.260) / 2]))
    np.testing.assert_allclose(moments, [((0.158 + 0.148) / 2) ** 2, across, across])
    np.testing.assert_allclose(inertia @ elbow, moments[0] * humerus.mass_kg * length**2 * elbow)


def test_das3_forearm_and_hand_pull_at_the_elbow_as_de_leva_has_it(participant):
    choices = ModelChoices(masses="anthropometric")
    model = om.participant_model(TABLES, participant, choices)
    record = om.model_record(model, participant, TABLES, choices)
    mass, centre, _, _ = forearm(record)
    wrist = -record.joints["rc"].location_m[1] - record.joints["ur"].location_m[1]
    # The hand's length ends at the third metacarpal: 86.2 mm of men, 78 mm of women.
    hand = wrist + (0.79 * 0.0862 + 0.7474 * 0.0780) / 2
    expected = 83.0 * (
        (0.0162 + 0.0138) / 2 * (0.4574 + 0.4559) / 2 * wrist + (0.0061 + 0.0056) / 2 * hand
    )
    assert mass * np.linalg.norm(centre) == pytest.approx(expected, rel=0.01)


def test_record_is_plain_and_complete(record, tmp_path):
    write_record(record, tmp_path / "model.json")
    assert read_record(tmp_path / "model.json") == record
    assert record.muscle_names == TABLES.active_muscles
    assert set(record.joints) == set(TABLES.joints)
    assert record.segments["scapula_r"].mass_kg == pytest.approx(1.0504640207736304)
    assert record.pronation_rad == pytest.approx(2.0 * np.pi / 3.0)
    # Conoid rule of the participants' repository, at the AC joint published for par2.
    np.testing.assert_allclose(record.conoid.origin_m, [0.1185259636, -0.0114, -0.01])


def test_written_model_has_the_same_lengths(model, participant, tmp_path):
    om.write_osim(model, tmp_path / "par2.osim")
    angles = participant.trial("drinking").motion.angles_rad[::25]
    written = opensim.Model(str(tmp_path / "par2.osim"))
    np.testing.assert_allclose(
        sampling.muscle_lengths(written, angles), sampling.muscle_lengths(model, angles), atol=1e-12
    )


def test_recorded_motions_do_not_overstretch_adjusted_fibres(model, participant):
    rule = TABLES.constants.fibre_adjustment
    names = list(TABLES.muscles)
    angles = participant.trial("sagittal").motion.angles_rad
    for name, lengths in zip(names, sampling.muscle_lengths(model, angles, names).T, strict=True):
        muscle = model.getMuscles().get(name)
        stretch = (lengths - muscle.getTendonSlackLength()) / muscle.getOptimalFiberLength()
        assert stretch.max() <= rule.max_normalised_length + 1e-9, name


def test_conoid_ligament_is_as_long_as_in_recorded_elevations(record, participant):
    planes = ("frontal", "scapular", "sagittal")
    poses = [trial_to_pose(participant.trial(plane).motion.angles_rad) for plane in planes]
    distances = om.conoid_distances(record, np.concatenate(poses))
    assert record.conoid.length_m == pytest.approx(np.median(distances))
    assert 0.01 < distances.min() < distances.max() < 0.05


def test_flattened_thorax_almost_keeps_its_sides(record):
    share = TABLES.constants.wrap_clearance.width_share
    surface = next(w for w in record.wrap_objects if w.name == "serr_ant")
    flat, scaled = surface.dimensions_m, surface.scaled_dimensions_m
    np.testing.assert_allclose(flat[:2], [share * scaled[0], scaled[1]], rtol=1e-12)
    assert 0.5 * scaled[2] < flat[2] < scaled[2]


def test_radii_shrink_only_as_far_as_needed():
    def clearance(point):
        return lambda radii: float(np.sum((np.array(point) / radii) ** 2) - 1.0)

    radii = np.array([0.2, 0.3, 0.1])
    cases = [
        ((0.3, 0.0, 0.0), radii),  # outside
        ((0.195, 0.0, 0.0), [0.18, 0.3, 0.1]),  # outside once the width has shrunk
        ((0.0, 0.0, 0.05), [0.18, 0.3, 0.05]),  # less depth
        ((0.0, 0.15, 0.0), [0.09, 0.15, 0.05]),  # no depth is enough
    ]
    for point, expected in cases:
        found = om._clear_radii(radii, clearance(point), 0.9)
        np.testing.assert_allclose(found, expected, atol=1e-6)
        assert clearance(point)(found) >= 0.0
    assert om._clear_radii(radii, clearance((0.0, 0.0, 0.0)), 0.9) is None


def test_recorded_attachments_are_outside_the_thorax(record, participant):
    levels = attachment_levels(record, recorded_poses(participant))
    assert set(levels) == {"serr_ant", "lat_dorsi_sup", "lat_dorsi_mid", "lat_dorsi_inf"}
    for name, level in levels.items():
        assert level.min() >= TABLES.constants.wrap_clearance.min_level - 1e-9, name


@pytest.mark.parametrize("name", ["par1", "par2", "par3"])
def test_attachments_are_outside_the_thorax_where_the_arm_hangs(name):
    """Also where it was never recorded hanging (par3): in pauses of a prediction it does."""
    person = without_daily_tasks(read_participant(PARTICIPANTS, name))
    record = flattened(person)
    lowest = recorded_poses(person)[resting(recorded_angles(person))]
    for surface, level in attachment_levels(record, arm_hanging(lowest)).items():
        assert level.min() >= TABLES.constants.wrap_clearance.min_level - 1e-9, surface


def test_daily_tasks_shape_neither_surfaces_nor_muscles():
    """Three of par1 put the medial border of the scapula into the thorax."""
    person = read_participant(PARTICIPANTS, "par1")
    whole, elevations = flattened(person), flattened(without_daily_tasks(person))
    assert whole.wrap_objects == elevations.wrap_objects
    assert whole.muscles == elevations.muscles
    assert attachment_levels(whole, recorded_poses(person))["serr_ant"].min() < 0.0


def test_lengths_do_not_jump_along_a_recorded_motion(model, participant):
    angles = participant.trial("frontal").motion.angles_rad
    fine = np.linspace(0, len(angles) - 1, 400)
    path = np.column_stack([np.interp(fine, range(len(angles)), a) for a in angles.T])
    steps = np.abs(np.diff(sampling.muscle_lengths(model, path, TABLES.active_muscles), axis=0))
    assert steps.max() < 2e-3


def test_straight_path_agrees_with_geometry(samples, record):
    """Distance between two points, turned and shifted without OpenSim."""
    index = TABLES.active_muscles.index("coracobr_2")
    muscle = record.muscles[index]
    assert [point.body for point in muscle.points] == ["scapula_r", "humerus_r"]

    def length(poses):
        frames = segment_frames(record, poses)
        ends = [frames[p.body][0] + frames[p.body][1] @ p.location_m for p in muscle.points]
        return np.linalg.norm(ends[1] - ends[0], axis=1)

    poses = samples["q"]
    np.testing.assert_allclose(samples["length_m"][:, index], length(poses), atol=1e-12)
    for axis in range(3):
        turn = rotation_vector_to_quaternion(1e-5 * np.eye(3)[axis])
        above, below = poses.copy(), poses.copy()
        above[:, 8:12] = quaternion_multiply(poses[:, 8:12], turn)
        below[:, 8:12] = quaternion_multiply(poses[:, 8:12], turn * [1, -1, -1, -1])
        expected = (length(above) - length(below)) / 2e-5
        actual = samples["rotation_gradient_m"][:, index, 6 + axis]
        np.testing.assert_allclose(actual, expected, atol=1e-6)
    # It crosses neither SC, AC nor elbow.
    assert not samples["rotation_gradient_m"][:, index, [0, 1, 2, 3, 4, 5, 9]].any()


def test_gradient_predicts_lengths_at_a_small_distance(model, samples):
    rng = np.random.default_rng(11)
    turn = 3e-4 * rng.normal(size=(len(samples["q"]), 10))
    moved = samples["q"].copy()
    for start, column in ((0, 0), (4, 3), (8, 6)):
        small = rotation_vector_to_quaternion(turn[:, column : column + 3])
        moved[:, start : start + 4] = quaternion_multiply(moved[:, start : start + 4], small)
    moved[:, 12] += turn[:, 9]
    lengths = sampling.muscle_lengths(model, pose_to_trial(moved), TABLES.active_muscles)
    predicted = np.einsum("pmk,pk->pm", samples["rotation_gradient_m"], turn)
    error = np.abs(lengths - samples["length_m"] - predicted)[samples["smooth"]]
    assert np.quantile(error, 0.999) < 5e-6
    assert samples["smooth"].mean() > 0.99


def test_path_pulls_at_the_humeral_head_with_unit_force(samples):
    """A geodesic under unit tension transmits unit force: an oracle for wrapped paths too."""
    force = np.linalg.norm(samples["gh_translation"], axis=2)
    crossing = [
        i
        for i, name in enumerate(TABLES.active_muscles)
        if name.startswith(("infra", "supra", "subscap", "delt", "ter_m", "coracobr", "pect_maj"))
    ]
    smooth = samples["smooth"][:, crossing]
    np.testing.assert_allclose(force[:, crossing][smooth], 1.0, atol=0.02)
    assert np.quantile(np.abs(force[:, crossing][smooth] - 1.0), 0.9) < 1e-4
    trapezius = [i for i, name in enumerate(TABLES.active_muscles) if name.startswith("trap")]
    assert not force[:, trapezius].any()


def test_static_torque_is_the_gradient_of_potential_energy(model, participant):
    angles = participant.trial("scapular").motion.angles_rad[[40]]
    still = np.zeros_like(angles)
    torque = inverse_dynamics(model, angles, still, still)[0]

    def energy(pose):
        state = model.initSystem()
        for name, angle in zip(ANGLE_NAMES, pose, strict=True):
            model.updCoordinateSet().get(name).setValue(state, float(angle), False)
        model.realizePosition(state)
        return model.getTotalMass(state) * 9.80665 * model.calcMassCenterPosition(state).get(1)

    step = 1e-4 * np.eye(10)
    slope = [(energy(angles[0] + d) - energy(angles[0] - d)) / 2e-4 for d in step]
    np.testing.assert_allclose(torque, slope, atol=1e-6)
    assert np.abs(torque).max() > 5.0  # about the weight of the arm times a lever


def test_power_of_inverse_dynamics_is_the_rate_of_energy(model, participant):
    """At constant gravity and no other force, torque times speed equals d(T + V)/dt."""
    motion = participant.trial("lifting").motion
    rng = np.random.default_rng(2)
    angles, speeds, accelerations = motion.angles_rad[[30]], *rng.normal(size=(2, 1, 10))

    def energy(t):
        state = model.initSystem()
        pose = angles[0] + speeds[0] * t + accelerations[0] * t**2 / 2
        for name, q, u in zip(ANGLE_NAMES, pose, speeds[0] + accelerations[0] * t, strict=True):
            model.updCoordinateSet().get(name).setValue(state, float(q), False)
            model.updCoordinateSet().get(name).setSpeedValue(state, float(u))
        model.realizeVelocity(state)
        height = model.calcMassCenterPosition(state).get(1)
        kinetic = model.getMatterSubsystem().calcKineticEnergy(state)
        return kinetic + model.getTotalMass(state) * 9.80665 * height

    power = inverse_dynamics(model, angles, speeds, accelerations)[0] @ speeds[0]
    assert power == pytest.approx((energy(1e-4) - energy(-1e-4)) / 2e-4, rel=1e-5)


def test_pose_and_angles_give_the_same_lengths(model, participant, samples):
    angles = participant.trial("frontal").motion.angles_rad[:5]
    geometry = sampling.sample_geometry(model, trial_to_pose(angles), ["infra_1", "bic_l"])
    lengths = sampling.muscle_lengths(model, angles, ["infra_1", "bic_l"])
    np.testing.assert_allclose(geometry["length_m"], lengths, atol=1e-12)


def test_joint_without_coordinates_is_refused():
    joint = TABLES.joints["hu"]
    with pytest.raises(ModelError, match="joint hu: type 'rotation' with 0 coordinates"):
        om._joint(om.build_model(TABLES), joint, [])


def test_published_masses_divided_are_those_of_the_authors_program(participant):
    # Printed by par-opt 8d1f8a6 of the published simulations, par2: clavicle to hand [kg].
    printed = [0.16594, 0.75033, 2.18260, 0.58120, 0.58120, 0.55844]
    model = om.participant_model(TABLES, participant, ModelChoices(masses="divided"))
    masses = {body.getName(): body.getMass() for body in model.getBodySet()}
    names = ("clavicle_r", "scapula_r", "humerus_r", "ulna_r", "radius_r", "hand_r")
    np.testing.assert_allclose([masses[name] for name in names], printed, atol=6e-6)


def test_rescaled_serratus_keeps_its_normalised_length_in_the_default_pose(participant):
    """And the path is shorter: without rescaling, fibres there would be shorter by as much."""
    names = [name for name in TABLES.active_muscles if name.startswith("serr_ant")]
    scaled = om.build_model(TABLES)
    om.scale_model(scaled, participant)
    om.lock_pronation(scaled, np.deg2rad(120.0))
    flat = scaled.clone()
    flat.finalizeConnections()
    om.flatten_thorax_surfaces(flat, participant, TABLES, True)
    lengths = [om._default_lengths(model, names) for model in (scaled, flat)]
    assert (lengths[1] < lengths[0] - 1e-3).sum() >= 3
    fibres = []
    for model, length in zip((scaled, flat), lengths, strict=True):
        muscles = [model.getMuscles().get(name) for name in names]
        slack = np.array([muscle.getTendonSlackLength() for muscle in muscles])
        fibres.append((length - slack) / [muscle.getOptimalFiberLength() for muscle in muscles])
    np.testing.assert_allclose(fibres[0], fibres[1], rtol=1e-12)


def test_suspended_girdle_hangs_on_muscles_that_elevations_stretch_alike(participant):
    rule = TABLES.constants.fibre_adjustment
    model = om.participant_model(TABLES, participant, ModelChoices(fibres="suspended"))
    names = list(TABLES.muscles)
    planes = [participant.trial(plane) for plane in ("frontal", "scapular", "sagittal")]
    angles = np.concatenate([trial.motion.angles_rad for trial in planes])
    longest = sampling.muscle_lengths(model, angles, names).max(axis=0)
    for name, length in zip(names, longest, strict=True):
        muscle = model.getMuscles().get(name)
        fibre = (length - muscle.getTendonSlackLength()) / muscle.getOptimalFiberLength()
        if TABLES.muscles[name].group in rule.suspending_muscles:
            assert fibre == pytest.approx(rule.suspending_length, abs=1e-9), name
        else:
            assert fibre <= rule.max_normalised_length + 1e-9, name


def test_suspended_fibres_of_the_upper_trapezius_are_those_calibrated_in_the_paper(participant):
    """Fibre scaler 0.74, from EMG that had no part in the rule; mean of two elements."""
    scaled = om.build_model(TABLES)
    om.scale_model(scaled, participant)
    model = om.participant_model(TABLES, participant, ModelChoices(fibres="suspended"))
    ratios = [
        model.getMuscles().get(name).getOptimalFiberLength()
        / scaled.getMuscles().get(name).getOptimalFiberLength()
        for name in ("trap_clav_1", "trap_clav_2")
    ]
    assert np.mean(ratios) == pytest.approx(0.74, abs=0.03)


def test_published_fibres_are_the_printed_ones_of_par2(participant):
    # Printed by the validation notebook 5fac288 of the published simulations [m], [N].
    printed = {
        "serr_ant_1": 0.0974,
        "serr_ant_2": 0.1175,
        "rhomboid_5": 0.1390,
        "ter_min_2": 0.0584,
        "bic_l": 0.1231,
        "bic_b_1": 0.1209,
        "lev_scap_1": 0.1397,
        "trap_scap_6": 0.0791,
    }
    model = om.participant_model(TABLES, participant, ModelChoices(fibres="published"))
    for name, length in printed.items():
        muscle = model.getMuscles().get(name)
        assert muscle.getOptimalFiberLength() == pytest.approx(length, abs=1.1e-4), name
    assert model.getMuscles().get("bic_l").getMaxIsometricForce() == 47.0


def test_published_paths_are_those_of_the_scaled_model_of_par2(participant):
    # From scaled_par2.xml of the published simulations [m].
    choices = ModelChoices(paths="published", serratus_path="as_scaled")
    model = om.participant_model(TABLES, participant, choices)
    record = om.model_record(model, participant, TABLES, choices)
    muscles = {muscle.name: muscle for muscle in record.muscles}
    origin = muscles["delt_clav_1"].points[0].location_m
    np.testing.assert_allclose(origin, [0.133, 0.0, -0.02], atol=1e-8)
    end = muscles["trap_clav_2"].points[1].location_m
    np.testing.assert_allclose(end, [0.12082344, 0.0, 0.0], atol=1e-8)
    insertion = muscles["infra_5"].points[1].location_m
    np.testing.assert_allclose(insertion, [0.01536032, 0.01474006, 0.01], atol=1e-8)
    assert muscles["infra_1"].wraps == ("ter_min_cyl",)
    surface = next(w for w in record.wrap_objects if w.name == "ter_min_cyl")
    np.testing.assert_allclose(surface.dimensions_m, [0.01590422, 0.18602814], atol=1e-8)
    untouched = om.participant_model(TABLES, participant, ModelChoices(serratus_path="as_scaled"))
    names = ["supra_1", "serr_ant_3"]
    pose = np.zeros((1, 10))
    np.testing.assert_array_equal(
        sampling.muscle_lengths(model, pose, names), sampling.muscle_lengths(untouched, pose, names)
    )


def test_serratus_path_as_scaled_keeps_the_surface(participant):
    model = om.participant_model(TABLES, participant, ModelChoices(serratus_path="as_scaled"))
    record = om.model_record(model, participant, TABLES, ModelChoices(serratus_path="as_scaled"))
    surface = next(w for w in record.wrap_objects if w.name == "serr_ant")
    np.testing.assert_allclose(surface.dimensions_m, surface.scaled_dimensions_m)
