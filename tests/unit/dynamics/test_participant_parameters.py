"""Numbers of a model record in the equations: combined forearm, rest pose, muscles."""

import numpy as np
import pytest
from arm import HILL_RECORD
from scipy.spatial.transform import Rotation

from scapulohumeral.dynamics import participant_parameters as pp
from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.errors import ModelError

pytestmark = pytest.mark.unit

STRAIGHT = [0.0, 0.0, 0.0]


def segment(mass, com, inertia):
    return {"mass_kg": mass, "com_m": com, "inertia_kgm2": inertia}


def make_record(pronation=0.0, hu=STRAIGHT):
    """A forearm of three parts along y, and round numbers for the rest."""
    rod = [4e-3, 1e-3, 4e-3, 0.0, 0.0, 0.0]
    bodies = ("clavicle_r", "scapula_r", "humerus_r")
    names = ("SC_y", "SC_z", "SC_x", "AC_y", "AC_z", "AC_x", "GH_y", "GH_z", "GH_yy", "EL_x")
    return {
        "gravity_mps2": [0.0, -9.8, 0.0],
        "segments": {
            **{name: segment(k + 1.0, [0.1, 0.2, 0.3], rod) for k, name in enumerate(bodies)},
            "ulna_r": segment(1.0, [0.0, -0.1, 0.0], rod),
            "radius_r": segment(1.0, [0.02, -0.1, 0.0], rod),
            "hand_r": segment(0.5, [0.0, -0.05, 0.03], [1e-3, 2e-3, 3e-3, 1e-4, 2e-4, 3e-4]),
        },
        "joints": {
            "sc1": {"location_m": [0.02, 0.0, 0.0], "orientation_rad": STRAIGHT},
            "ac1": {"location_m": [0.15, 0.0, 0.0], "orientation_rad": STRAIGHT},
            "gh1": {"location_m": [0.0, -0.05, 0.0], "orientation_rad": STRAIGHT},
            "hu": {"location_m": [0.0, -0.3, 0.0], "orientation_rad": hu},
            "ur": {"location_m": [0.0, -0.02, 0.0], "orientation_rad": STRAIGHT},
            "rc": {"location_m": [0.0, -0.2, 0.0], "orientation_rad": STRAIGHT},
        },
        "axes": {"EL_x": [2.0, 0.0, 0.0], "PS_y": [0.0, 1.0, 0.0]},
        "pronation_rad": pronation,
        "coordinates": {name: {"min_rad": -0.2, "max_rad": 0.6} for name in names},
        "girdle_range_rad": {name: [k, k + 0.5] for k, name in enumerate(names[:6])},
        "markers": {
            "upper": {"location_m": [-0.1, 0.0, 0.0]},
            "lower": {"location_m": [-0.1, -0.1, 0.0]},
        },
        "conoid": {
            "origin_m": [0.1, 0.0, 0.0],
            "insertion_m": [0.0, 0.0, 0.1],
            "length_m": 0.02,
            "stiffness_N_per_m": 1000.0,
            "eps_m": 1e-3,
        },
        "constants": {
            "scapulothoracic_contact": {
                "points": ["upper", "lower"],
                "stiffness_N_per_m": 2e4,
                "eps": 0.01,
            },
            "passive_joint": {
                "k1_Nm_per_rad": 1.5,
                "k2_Nm_per_rad2": 400.0,
                "eps_rad": 0.01,
                "b_Nms_per_rad": 0.7,
            },
            "hill": HILL_RECORD,
        },
        "muscles": [
            {
                "name": "only",
                "max_isometric_force_N": 300.0,
                "optimal_fibre_length_m": 0.1,
                "tendon_slack_length_m": 0.2,
                "activation_time_s": 0.01,
                "deactivation_time_s": 0.04,
            }
        ],
    }


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
            part = record["segments"][name]
            velocity = np.cross(omega, origin + rotation.apply(part["com_m"]))
            own = rotation.apply(omega, inverse=True)
            xx, yy, zz, xy, xz, yz = part["inertia_kgm2"]
            matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            expected += 0.5 * part["mass_kg"] * velocity @ velocity + 0.5 * own @ matrix @ own
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
    for joint, sequence in (("SC", "YZX"), ("AC", "YZX"), ("GH", "YZY")):
        expected = Rotation.from_euler(sequence, [0.2, 0.2, 0.2]).as_matrix()
        np.testing.assert_allclose(rest[f"rest_{joint}"], expected, atol=1e-15)


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
    record["conoid"]["length_m"] = np.nan
    with pytest.raises(ModelError, match="conoid_length"):
        pp.dynamics_parameters(record, THORAX, 0.0)


def test_muscles_have_full_capacity():
    muscles = pp.muscle_parameters(make_record())
    assert muscles.names == ("only",)
    assert muscles.capacity.tolist() == [1.0]
    assert muscles.constants.max_velocity == 10.0
