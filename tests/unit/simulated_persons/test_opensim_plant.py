"""The plant that OpenSim simulates, against what OpenSim says itself.

Run as ``pytest -m opensim``: opensim cannot share a process with casadi.
"""

from dataclasses import replace

import numpy as np
import opensim
import pytest
from opensim_dynamics import inverse_dynamics
from places import REPOSITORY

from scapulohumeral.model import opensim_model as om
from scapulohumeral.model.choices import ModelChoices
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.rotations import (
    ANGLE_NAMES,
    pose_to_trial,
    quaternion_to_matrix,
    relative_angle,
    trial_to_pose,
)
from scapulohumeral.model.tables import read_tables
from simulated_persons.opensim_plant.body import Body, read_body, write_body
from simulated_persons.opensim_plant.least_effort import Demand, least_effort
from simulated_persons.opensim_plant.mechanics import ACTIVATIONS, coordinates_of, pose_of
from simulated_persons.opensim_plant.process import Person, bent, excitation, simulate
from simulated_persons.opensim_plant.sharing import rim_rows, share, tendon_force
from simulated_persons.opensim_plant.skeleton import Skeleton
from simulated_persons.wish import humerus_of

pytestmark = pytest.mark.opensim

STEP_S = 0.04


@pytest.fixture(scope="module")
def participant():
    return read_participant(REPOSITORY / "config" / "participants", "par2")


@pytest.fixture(scope="module")
def study(participant, tmp_path_factory):
    """The exported model, its record, and the model itself."""
    tables, choices = read_tables(REPOSITORY / "config" / "model"), ModelChoices()
    model = om.participant_model(tables, participant, choices)
    path = tmp_path_factory.mktemp("model") / "par2.osim"
    om.write_osim(model, path)
    return path, om.model_record(model, participant, tables, choices), model


@pytest.fixture(scope="module")
def usual(study) -> Body:
    """A body as the model has it."""
    record = study[1]
    ones = np.ones(len(record.muscle_names))
    return Body(
        mass_factor=np.ones(4),
        load_kg=np.array(0.0),
        gravity=np.array(record.gravity_mps2),
        force_factor=ones,
        fibre_factor=ones,
        end_force=ones,
        tendon_strain=0.04 * ones,
        rise_s=0.015 * ones,
        fall_s=0.05 * ones,
        cost=ones,
        tonic=0.0 * ones,
        cap=ones,
        glenoid_rad=np.deg2rad([6.5, 13.0]),
        conoid_m=np.array([record.conoid.origin_m, record.conoid.insertion_m]),
        joint_damping=np.zeros(4),
        capsule_Nm=np.array(0.0),
        friction_Nm=np.array(0.0),
        arm_force_N=np.zeros(3),
        arm_force_share=np.array(1.0),
    )


@pytest.fixture(scope="module")
def person(study, usual):
    """Makes a person with other properties than the usual ones."""

    def make(**changes) -> Person:
        body = replace(usual, **{name: np.array(value) for name, value in changes.items()})
        return Person(Skeleton(study[0], study[1].muscle_names, body), body)

    return make


@pytest.fixture(scope="module")
def pose(participant) -> np.ndarray:
    """Raising the arm in the frontal plane, from rest, every `STEP_S`."""
    motion = participant.trial("frontal").motion
    time = np.arange(0.0, 0.5 * motion.time_s[-1], STEP_S)
    angles = np.unwrap(motion.angles_rad, axis=0)
    return trial_to_pose(np.column_stack([np.interp(time, motion.time_s, a) for a in angles.T]))


@pytest.fixture(scope="module")
def raised(pose) -> np.ndarray:
    """Coordinates (2, 10) of the hanging and of the raised arm."""
    return coordinates_of(pose)[[0, -1]]


def held(who: Person, coordinates: np.ndarray):
    """Mechanics without motion."""
    still = np.zeros_like(coordinates)
    return who.skeleton.mechanics(coordinates, still, still)


def fresh(who: Person, count: int) -> np.ndarray:
    return np.ones((count, len(who.skeleton.muscles)))


def test_coordinates_are_those_poses(pose) -> None:
    again = pose_of(coordinates_of(pose))
    for joint in range(3):
        part = slice(4 * joint, 4 * joint + 4)
        assert relative_angle(again[:, part], pose[:, part]).max() < 1e-7


def test_weight_turns_joints_as_in_the_study_s_model(study, person, pose) -> None:
    """The humerus has other coordinates here; girdle and elbow have the same."""
    angles = pose_to_trial(pose[[0, -1]])
    still = np.zeros_like(angles)
    oracle = inverse_dynamics(study[2], angles, still, still)
    torque = held(person(), coordinates_of(pose)[[0, -1]]).torque
    same = [k for k, name in enumerate(ANGLE_NAMES) if not name.startswith("GH")]
    np.testing.assert_allclose(torque[:, same], oracle[:, same], rtol=1e-6, atol=1e-6)


def test_muscles_supports_and_reserves_make_opensim_s_inverse_dynamics(person, pose) -> None:
    """What OpenSim leaves when it applies the same muscle forces is what the others give."""
    who = person(load_kg=1.0)
    q = coordinates_of(pose)
    u = np.gradient(q, STEP_S, axis=0)
    a = np.gradient(u, STEP_S, axis=0)
    frame = slice(10, 11)
    mechanics = who.skeleton.mechanics(q[frame], u[frame], a[frame])
    shared = share(mechanics, who.body, fresh(who, 1))
    force = tendon_force(mechanics.force, shared.activation)[0]
    model, state = who.skeleton.model, who.skeleton.state
    copy = model.clone()
    for k in range(copy.getMuscles().getSize()):
        copy.updMuscles().get(k).set_appliesForce(True)
    pulled = copy.initSystem()
    pulled.setY(state.getY())
    for name, newton in zip((m.getName() for m in who.skeleton.muscles), force, strict=True):
        muscle = copy.updMuscles().get(name)
        muscle.overrideActuation(pulled, True)
        muscle.setOverrideActuation(pulled, float(newton))
    every = opensim.Vector(pulled.getNU(), 0.0)
    for column, value in zip(who.skeleton.columns, a[10], strict=True):
        every.set(column, float(value))
    left = opensim.InverseDynamicsSolver(copy).solve(pulled, every).to_numpy()
    given = shared.support[0] @ mechanics.support[0] + shared.reserve[0]
    np.testing.assert_allclose(left[who.skeleton.columns], given, atol=1e-6)
    assert np.abs(shared.reserve).max() < 0.3


def test_tendons_are_stretched_and_in_equilibrium_with_fibres(person, raised) -> None:
    who = person()
    mechanics = held(who, raised)
    muscle, state = who.skeleton.muscles[0], who.skeleton.state
    assert ACTIVATIONS[-1] == muscle.getActivation(state) == 1.0
    assert muscle.getTendonForce(state) == pytest.approx(mechanics.force[-1, -1, 0])
    assert muscle.getFiberForceAlongTendon(state) == pytest.approx(mechanics.force[-1, -1, 0])
    strain = muscle.getTendonStrain(state)
    assert 0.0 < strain < 0.045


def test_the_weight_of_the_arm_is_borne(study, person, raised) -> None:
    mass = sum(study[1].segments[n].mass_kg for n in ("humerus_r", "ulna_r", "radius_r", "hand_r"))
    burden = held(person(load_kg=2.0), raised).burden
    gravity = np.linalg.norm(study[1].gravity_mps2)
    np.testing.assert_allclose(np.linalg.norm(burden, axis=1), (mass + 2.0) * gravity, rtol=1e-9)


def test_a_force_that_carries_the_load_undoes_it(person, raised) -> None:
    """A ball's centre lies a little beyond the hand's, where the force acts."""
    empty = held(person(), raised).torque
    lift = -2.0 * np.array(person().body.gravity)
    carried = held(person(load_kg=2.0, arm_force_N=lift), raised).torque
    loaded = held(person(load_kg=2.0), raised).torque
    assert np.abs(loaded - empty).max() > 5.0
    assert np.abs(carried - empty).max() < 0.1


@pytest.mark.parametrize("change", [{"joint_damping": [0, 0, 2.0, 0]}, {"friction_Nm": 2.0}])
def test_a_rough_joint_asks_for_power(person, pose, change) -> None:
    q = coordinates_of(pose)
    u = np.gradient(q, STEP_S, axis=0)
    frame, still = slice(10, 11), np.zeros((1, 10))
    smooth, rough = (
        who.skeleton.mechanics(q[frame], u[frame], still).torque[0]
        for who in (person(), person(**change))
    )
    assert (rough - smooth)[6:9] @ u[10, 6:9] > 0.0
    np.testing.assert_allclose((rough - smooth)[[*range(6), 9]], 0.0, atol=1e-9)


def test_a_capsule_holds_the_raised_humerus_back_only(person, raised) -> None:
    held_back = held(person(capsule_Nm=3.0), raised).torque - held(person(), raised).torque
    assert np.abs(held_back[0]).max() < 1e-9
    assert held_back[1, 6:9] @ (raised[1] - raised[0])[6:9] > 0.0


def test_a_weight_in_the_hand_raises_the_excitation_of_the_deltoid(study, person, pose) -> None:
    tired = np.zeros(len(pose))
    deltoid = np.char.startswith(study[1].muscle_groups, "delt_")
    without, loaded = (
        simulate(person(load_kg=kg), pose, tired, STEP_S)["excitation"][:, deltoid].mean()
        for kg in (0.0, 1.5)
    )
    assert loaded > 1.1 * without


def test_who_gives_way_to_a_weight_lowers_the_arm(person, pose) -> None:
    tired, usual, loaded = np.zeros(len(pose)), person(), person(load_kg=1.5)
    same = bent(usual, usual, pose, tired, STEP_S)
    lower = bent(loaded, usual, pose, tired, STEP_S)
    assert relative_angle(same[:, 8:12], pose[:, 8:12]).max() < np.deg2rad(0.2)
    wished, reached = (elevation_deg(p[-1]) for p in (pose, lower))
    assert 1.0 < wished - reached < 15.0


def elevation_deg(pose: np.ndarray) -> float:
    """Angle between the long axes of humerus and thorax, of a pose (13,)."""
    upright = quaternion_to_matrix(humerus_of(pose))[1, 1]
    return float(np.rad2deg(np.arccos(upright)))


def test_the_reaction_stays_in_the_glenoid_and_turns_with_it(person, raised) -> None:
    for version in (13.0, 25.0):
        who = person(glenoid_rad=np.deg2rad([6.5, version]))
        shared = share(held(who, raised), who.body, fresh(who, 2))
        assert (shared.reaction @ rim_rows(who.body).T).min() > -1.0
        assert shared.support.min() >= 0.0


def test_co_contraction_and_fatigue(person, raised) -> None:
    who = person(tonic=np.full(126, 0.05))
    mechanics = held(who, raised)
    shared = share(mechanics, who.body, fresh(who, 2))
    tired = share(mechanics, who.body, 0.6 * fresh(who, 2))
    assert shared.activation.min() >= 0.05
    assert tired.activation.mean() > shared.activation.mean()


def test_excitations_make_the_activations_by_opensim_s_dynamics(usual) -> None:
    """OpenSim's derivative at each activation and excitation is the slope of the curve."""
    time = np.arange(0.0, 1.0, 0.01)
    curve = 0.3 + 0.2 * np.sin(2.0 * np.pi * time)
    activation = np.tile(curve[:, None], (1, len(usual.cost)))
    found = excitation(activation, usual, 0.01)[:, 0]
    dynamics = opensim.MuscleFirstOrderActivationDynamicModel()
    dynamics.set_activation_time_constant(usual.rise_s[0])
    dynamics.set_deactivation_time_constant(usual.fall_s[0])
    slope = [dynamics.calcDerivative(*map(float, pair)) for pair in zip(curve, found, strict=True)]
    np.testing.assert_allclose(slope, np.gradient(curve, 0.01), atol=1e-6)


def test_least_effort_spends_most_on_the_muscle_with_most_leverage() -> None:
    demand = Demand(
        matrix=np.array([[10.0, 5.0, 0.0]]),
        target=np.array([4.0]),
        weight=np.array([1e6]),
        cost=np.ones(2),
        low=np.zeros(3),
        high=np.ones(3),
    )
    (strong, weak, unused), multipliers = least_effort(demand, np.zeros(1))
    assert 10.0 * strong + 5.0 * weak == pytest.approx(4.0, abs=1e-4)
    for activation, lever in ((strong, 10.0), (weak, 5.0)):
        assert activation**2 + 0.05 * activation == pytest.approx(lever * multipliers[0], rel=1e-3)
    assert unused == 0.0


def test_bodies_are_read_as_they_were_written(usual, tmp_path) -> None:
    write_body(usual, tmp_path / "body.npz")
    for name, value in vars(read_body(tmp_path / "body.npz")).items():
        np.testing.assert_array_equal(value, getattr(usual, name))
