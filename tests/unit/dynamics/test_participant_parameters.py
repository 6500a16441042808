"""Numbers of a model record in the equations: combined forearm, rest pose, muscles."""

from dataclasses import replace

import numpy as np
import pytest
import sympy as sm
from scipy.spatial.transform import Rotation
from skeleton import CONSTANTS, joint, muscle, skeleton_record

from scapulohumeral.dynamics import participant_parameters as pp
from scapulohumeral.dynamics.joint_springs import spring_torques
from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.errors import ModelError
from scapulohumeral.model.constants import Hill, PassiveJoint, ScapulothoracicContact
from scapulohumeral.model.record import ConoidRecord, PointRecord, SegmentRecord
from scapulohumeral.model.rotations import ANGLE_NAMES

pytestmark = pytest.mark.unit

STRAIGHT = (0.0, 0.0, 0.0)


def make_record(pronation=0.0, hu=STRAIGHT):
    """A forearm of three parts along y, and round numbers for the rest."""
    rod = (4e-3, 1e-3, 4e-3, 0.0, 0.0, 0.0)
    bodies = ("clavicle_r", "scapula_r", "humerus_r")
    contact = ScapulothoracicContact(2e4, 0.01, 1.0, ("upper", "lower"))
    passive = PassiveJoint(1.5, 400.0, 0.01, 0.7, 0.3)
    return replace(
        skeleton_record(),
        gravity_mps2=(0.0, -9.8, 0.0),
        segments={
            **{name: SegmentRecord(k + 1.0, (0.1, 0.2, 0.3), rod) for k, name in enumerate(bodies)},
            "ulna_r": SegmentRecord(1.0, (0.0, -0.1, 0.0), rod),
            "radius_r": SegmentRecord(1.0, (0.02, -0.1, 0.0), rod),
            "hand_r": SegmentRecord(0.5, (0.0, -0.05, 0.03), (1e-3, 2e-3, 3e-3, 1e-4, 2e-4, 3e-4)),
        },
        joints={
            "sc1": joint([0.02, 0.0, 0.0]),
            "ac1": joint([0.15, 0.0, 0.0]),
            "gh1": joint([0.0, -0.05, 0.0]),
            "hu": joint([0.0, -0.3, 0.0], hu),
            "ur": joint([0.0, -0.02, 0.0]),
            "rc": joint([0.0, -0.2, 0.0]),
        },
        axes={"EL_x": (2.0, 0.0, 0.0), "PS_y": (0.0, 1.0, 0.0)},
        pronation_rad=pronation,
        girdle_range_rad={name: (k, k + 0.5) for k, name in enumerate(ANGLE_NAMES[:6])},
        markers={
            "upper": PointRecord("scapula_r", (-0.1, 0.0, 0.0)),
            "lower": PointRecord("scapula_r", (-0.1, -0.1, 0.0)),
        },
        constants=replace(CONSTANTS, scapulothoracic_contact=contact, passive_joint=passive),
        muscles=(muscle("only"),),
    )


THORAX = {"centre_m": [0.0, -0.1, 0.05], "radii_m": [0.1, 0.2, 0.1]}


def test_forearm_mass_and_centre_by_hand():
    mass, com, _, hand = pp.forearm(make_record())
    assert mass == 2.5
    # Radius at y = -0.02, hand at -0.22 below the elbow.
    np.testing.assert_allclose(hand, [0.0, -0.27, 0.03])
    expected = (np.array([0, -0.1, 0]) + [0.02, -0.12, 0] + 0.5 * np.array([0, -0.27, 0.03])) / 2.5
    np.testing.assert_allclose(com, expected)


def test_forearm_turns_with_pronation():
    """Half a turn about y puts radius and hand on the other side."""
    _, _, _, hand = pp.forearm(make_record(pronation=np.pi))
    np.testing.assert_allclose(hand, [0.0, -0.27, -0.03], atol=1e-15)


def test_forearm_inertia_gives_the_energy_of_its_parts():
    """Spinning about an axis through the elbow, against part by part in the parts' own frames."""
    record = make_record(pronation=0.9, hu=[0.2, -0.1, 0.3])
    mass, com, inertia, _ = pp.forearm(record)
    xx, yy, zz, xy, xz, yz = inertia
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    fixed = Rotation.from_euler("XYZ", [0.2, -0.1, 0.3])
    turned = fixed * Rotation.from_euler("Y", 0.9)
    radius = fixed.apply([0, -0.02, 0])
    places = {
        "ulna_r": (np.zeros(3), fixed),
        "radius_r": (radius, turned),
        "hand_r": (radius + turned.apply([0, -0.2, 0]), turned),
    }
    for omega in np.random.default_rng(1).normal(size=(5, 3)):
        expected = 0.0
        for name, (origin, rotation) in places.items():
            part = record.segments[name]
            velocity = np.cross(omega, origin + rotation.apply(part.com_m))
            own = rotation.apply(omega, inverse=True)
            xx, yy, zz, xy, xz, yz = part.inertia_kgm2
            matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            expected += 0.5 * part.mass_kg * velocity @ velocity + 0.5 * own @ matrix @ own
        velocity = np.cross(omega, com)
        actual = 0.5 * mass * velocity @ velocity + 0.5 * omega @ tensor @ omega
        assert actual == pytest.approx(expected, rel=1e-12)


def test_elbow_axis_is_a_unit_vector_in_the_humerus():
    np.testing.assert_allclose(pp.elbow_axis(make_record()), [1.0, 0.0, 0.0])
    turned = pp.elbow_axis(make_record(hu=[0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(turned, [0.0, 1.0, 0.0], atol=1e-15)


def test_rest_is_the_middle_of_the_ranges():
    rest = pp.rest_pose(make_record())
    assert rest["rest_EL"] == pytest.approx(0.2)
    for name, sequence in (("SC", "YZX"), ("AC", "YZX"), ("GH", "YZY")):
        expected = Rotation.from_euler(sequence, [0.2, 0.2, 0.2]).as_matrix()
        np.testing.assert_allclose(rest[f"rest_{name}"], expected, atol=1e-15)


def test_a_capsule_takes_the_place_of_the_glenohumeral_spring_alone():
    plain = make_record()
    tracked = pp.dynamics_parameters(plain, THORAX, 0.0)
    chosen = replace(plain, choices=replace(plain.choices, glenohumeral="capsule"))
    np.testing.assert_array_equal(pp.with_capsule(tracked, plain), tracked)
    np.testing.assert_array_equal(pp.dynamics_parameters(chosen, THORAX, 0.0), tracked)
    spring, capsule = unpack(tracked), unpack(pp.with_capsule(tracked, chosen))
    np.testing.assert_array_equal(spring["joint_stiffness"], [1.5] * 4)
    np.testing.assert_array_equal(spring["spring_torque"], [0.0] * 4)
    np.testing.assert_array_equal(capsule["joint_stiffness"], [1.5, 1.5, 0.0, 1.5])
    np.testing.assert_array_equal(capsule["spring_torque"], [0.0, 0.0, 0.3, 0.0])
    np.testing.assert_array_equal(capsule["rest_GH"], np.eye(3).ravel())
    changed = {"joint_stiffness", "spring_torque", "rest_GH"}
    for name in set(spring) - changed:
        np.testing.assert_array_equal(capsule[name], spring[name])


def test_capsule_ends_passive_elevation_where_examiners_find_its_end():
    """A relaxed arm of 4 kg, 10 N m when horizontal, is held up between 80 and 100 deg."""
    torque = CONSTANTS.passive_joint.capsule_Nm
    borne = {
        degrees: -float(
            spring_torques(
                sm.Matrix(Rotation.from_euler("X", degrees, degrees=True).as_matrix()),
                sm.eye(3), sm.Float(0), sm.Float(torque),
            )[0]
        )
        for degrees in (30, 80, 100)
    }  # fmt: skip
    assert borne[80] < 10.0 < borne[100]
    assert borne[30] < 0.5, "slack while the arm hangs"


def test_parameters_are_found_under_their_names():
    values = unpack(pp.dynamics_parameters(make_record(), THORAX, hand_load_kg=2.0))
    assert values["mass_load"] == 2.0
    np.testing.assert_allclose(values["com_load"], [0.0, -0.27, 0.03])
    assert values["mass_scapula"] == 2.0
    np.testing.assert_array_equal(values["thorax_radii"], THORAX["radii_m"])
    np.testing.assert_array_equal(values["contact_AI"], [-0.1, -0.1, 0.0])
    np.testing.assert_array_equal(values["joint_damping"], [0.7] * 4)
    assert values["stop_stiffness"] == 400.0
    assert values["stop_eps"] == 0.01
    np.testing.assert_array_equal(values["range_least_SC"], [0.0, 1.0, 2.0])
    np.testing.assert_array_equal(values["range_largest_AC"], [3.5, 4.5, 5.5])


def test_value_that_is_not_finite_is_refused():
    record = make_record()
    record = replace(record, conoid=replace(record.conoid, length_m=np.nan))
    with pytest.raises(ModelError, match="conoid_length"):
        pp.dynamics_parameters(record, THORAX, 0.0)


def test_ligament_contact_and_bones_have_their_own_numbers():
    ligament = ConoidRecord("clavicle_r", (1, 2, 3), "scapula_r", (4, 5, 6), 80.0, 0.09, 0.07)
    record = replace(make_record(), conoid=ligament)
    values = unpack(pp.dynamics_parameters(record, THORAX, hand_load_kg=0.0))
    expected = {
        "gravity": [0.0, -9.8, 0.0],
        "offset_SC": [0.02, 0.0, 0.0],
        "offset_AC": [0.15, 0.0, 0.0],
        "offset_GH": [0.0, -0.05, 0.0],
        "offset_EL": [0.0, -0.3, 0.0],
        "conoid_origin": [1.0, 2.0, 3.0],
        "conoid_insertion": [4.0, 5.0, 6.0],
        "conoid_length": ligament.length_m,
        "conoid_stiffness": ligament.stiffness_N_per_m,
        "conoid_eps": ligament.eps_m,
        "contact_TS": [-0.1, 0.0, 0.0],
        "thorax_centre": THORAX["centre_m"],
        "contact_stiffness": 2e4,
        "contact_eps": 0.01,
        "joint_stiffness": [1.5] * 4,
        "mass_clavicle": 1.0,
        "mass_humerus": 3.0,
        "com_humerus": [0.1, 0.2, 0.3],
        "inertia_scapula": [4e-3, 1e-3, 4e-3, 0.0, 0.0, 0.0],
    }
    assert {ligament.length_m, ligament.stiffness_N_per_m, ligament.eps_m} == {80.0, 0.09, 0.07}
    for name, value in expected.items():
        np.testing.assert_array_equal(values[name], value, err_msg=name)


def test_every_muscle_and_its_curves_have_their_own_numbers():
    curves = Hill(*(float(k) for k in range(1, 9)))
    record = make_record()
    record = replace(
        record,
        muscles=(muscle("one"), muscle("two", size=2.0)),
        constants=replace(record.constants, hill=curves),
    )
    muscles = pp.muscle_parameters(record)
    assert muscles.names == ("one", "two")
    expected = {
        "max_isometric_force": 100.0,
        "optimal_fibre_length": 0.1,
        "tendon_slack_length": 0.05,
        "activation_time": 0.01,
        "deactivation_time": 0.04,
    }
    for name, value in expected.items():
        np.testing.assert_allclose(getattr(muscles, name), [value, 2.0 * value], err_msg=name)
    assert muscles.capacity.tolist() == [1.0, 1.0]
    found = muscles.constants
    assert (found.gaussian_width, found.passive_stiffness, found.passive_strain) == (
        curves.f_gauss, curves.k_pe, curves.epsilon_m0
    )  # fmt: skip
    assert (found.d1, found.d2, found.d3, found.d4) == (4.0, 5.0, 6.0, 7.0)
    assert found.max_velocity == curves.v_max
