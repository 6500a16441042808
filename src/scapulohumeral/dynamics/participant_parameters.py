"""Run-time parameters of a participant: from the model record to vectors.

Ulna, radius and hand move as one forearm, because pronation is locked. The forearm frame has its
origin at the elbow and the axes of the humerus at zero flexion.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from scapulohumeral.dynamics.hill import HillConstants, MuscleParameters
from scapulohumeral.dynamics.parameters import BALL_JOINTS, GIRDLE_JOINTS, pack, unpack
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import (
    JOINT_SEQUENCES,
    axis_rotation,
    euler_to_quaternion,
    joint_rotation,
    quaternion_to_matrix,
)

Array = np.ndarray
REST_COORDINATES = {
    "SC": ("SC_y", "SC_z", "SC_x"),
    "AC": ("AC_y", "AC_z", "AC_x"),
    "GH": ("GH_y", "GH_z", "GH_yy"),
}


def dynamics_parameters(
    record: ModelRecord, thorax: Mapping[str, Any], hand_load_kg: float
) -> Array:
    """Parameter vector (P,) of a participant with a hand load.

    Parameters
    ----------
    record : model record "model/1"
    thorax : fitted thorax ellipsoid, keys ``centre_m`` and ``radii_m``
    hand_load_kg : point mass at the mass centre of the hand [kg]
    """
    constants, joints, segments = record.constants, record.joints, record.segments
    contact, conoid = constants.scapulothoracic_contact, record.conoid
    passive = constants.passive_joint
    points = [record.markers[name].location_m for name in contact.points]
    values: dict[str, Any] = {
        "gravity": record.gravity_mps2,
        "offset_SC": joints["sc1"].location_m,
        "offset_AC": joints["ac1"].location_m,
        "offset_GH": joints["gh1"].location_m,
        "offset_EL": joints["hu"].location_m,
        "axis_EL": elbow_axis(record),
        "mass_load": hand_load_kg,
        "conoid_origin": conoid.origin_m,
        "conoid_insertion": conoid.insertion_m,
        "conoid_length": conoid.length_m,
        "conoid_stiffness": conoid.stiffness_N_per_m,
        "conoid_eps": conoid.eps_m,
        "contact_TS": points[0],
        "contact_AI": points[1],
        "thorax_centre": thorax["centre_m"],
        "thorax_radii": thorax["radii_m"],
        "contact_stiffness": contact.stiffness_N_per_m,
        "contact_eps": contact.eps,
        "joint_stiffness": [passive.k1_Nm_per_rad] * 4,
        # The study's springs are linear; the authors' are a choice of the problem.
        "spring_torque": [0.0] * 4,
        "joint_damping": [passive.b_Nms_per_rad] * 4,
        "stop_stiffness": passive.k2_Nm_per_rad2,
        "stop_eps": passive.eps_rad,
        **forearm_parameters(record),
        **girdle_range(record),
        **rest_pose(record),
    }
    for name in ("clavicle", "scapula", "humerus"):
        segment = segments[f"{name}_r"]
        values[f"mass_{name}"] = segment.mass_kg
        values[f"com_{name}"] = segment.com_m
        values[f"inertia_{name}"] = segment.inertia_kgm2
    return pack(values)


def girdle_range(record: ModelRecord) -> dict[str, list[float]]:
    """Least and largest angles of the sternoclavicular and acromioclavicular joints [rad]."""
    return {
        f"range_{end}_{joint}": [
            record.girdle_range_rad[name][place] for name in REST_COORDINATES[joint]
        ]
        for joint in GIRDLE_JOINTS
        for place, end in enumerate(("least", "largest"))
    }


def elbow_axis(record: ModelRecord) -> Array:
    """Unit flexion axis in the humerus frame, shape (3,)."""
    axis = joint_rotation(record.joints["hu"].orientation_rad) @ np.array(record.axes["EL_x"])
    return axis / np.linalg.norm(axis)


def rest_pose(record: ModelRecord) -> dict[str, Any]:
    """Rest orientations of the passive joint springs: the middle of each coordinate's range."""

    def middle(name: str) -> float:
        return 0.5 * (record.coordinates[name].min_rad + record.coordinates[name].max_rad)

    rest: dict[str, Any] = {"rest_EL": middle("EL_x")}
    for joint in BALL_JOINTS:
        angles = np.array([middle(name) for name in REST_COORDINATES[joint]])
        rest[f"rest_{joint}"] = quaternion_to_matrix(
            euler_to_quaternion(angles, JOINT_SEQUENCES[joint])
        )
    return rest


def with_capsule(parameters: Array, record: ModelRecord) -> Array:
    """Parameters (P,) for a girdle that moves freely: with a glenohumeral capsule, if chosen.

    The capsule, the exponential spring of the equations at rest where the axes of humerus and
    scapula are the same, takes the place of the linear spring. Where the girdle follows a recording
    the linear one stays, with which muscles are calibrated and validated. The capsule would take 5
    N m there at most (par2, driving): 70 deg between the long axes, which alone are worth 4.6 N m.
    """
    if record.choices.glenohumeral != "capsule":
        return parameters
    values: dict[str, Any] = {name: block.copy() for name, block in unpack(parameters).items()}
    place = BALL_JOINTS.index("GH")
    values["joint_stiffness"][place] = 0.0
    values["spring_torque"][place] = record.constants.passive_joint.capsule_Nm
    return pack({**values, "rest_GH": np.eye(3)})


def forearm_parameters(record: ModelRecord) -> dict[str, Any]:
    """Mass, mass centre and inertia of the forearm, and where the hand holds a load."""
    mass, com, inertia, hand = forearm(record)
    return {
        "mass_forearm": mass,
        "com_forearm": com,
        "inertia_forearm": inertia,
        "com_load": hand,
    }


def forearm(record: ModelRecord) -> tuple[float, Array, Array, Array]:
    """Mass [kg], mass centre [m], inertia (xx yy zz xy xz yz) [kg m^2] and hand centre [m].

    All in the forearm frame; inertia about the common mass centre.
    """
    parts = []
    for segment, (origin, rotation) in forearm_frames(record).items():
        body = record.segments[segment]
        centre = origin + rotation @ np.array(body.com_m)
        parts.append((body.mass_kg, centre, rotation @ _matrix(body.inertia_kgm2) @ rotation.T))
    mass = sum(m for m, _, _ in parts)
    com = sum(m * c for m, c, _ in parts) / mass
    inertia = np.zeros((3, 3))
    for m, centre, own in parts:
        d = centre - com
        inertia += own + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, com, inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]], parts[-1][1]


def forearm_frames(record: ModelRecord) -> dict[str, tuple[Array, Array]]:
    """Where ulna, radius and hand are in the forearm: origin (3,) [m] and rotation (3, 3)."""
    rotation, origin = joint_rotation(record.joints["hu"].orientation_rad), np.zeros(3)
    spin = axis_rotation(np.array(record.axes["PS_y"]), record.pronation_rad)
    frames = {"ulna_r": (origin, rotation)}
    for segment, joint, turn in (("radius_r", "ur", spin), ("hand_r", "rc", np.eye(3))):
        origin = origin + rotation @ np.array(record.joints[joint].location_m)
        rotation = rotation @ joint_rotation(record.joints[joint].orientation_rad) @ turn
        frames[segment] = (origin, rotation)
    return frames


def muscle_parameters(record: ModelRecord) -> MuscleParameters:
    """Generic muscle parameters of a participant: scaled, with full capacity."""
    muscles, hill = record.muscles, record.constants.hill

    def column(key: str) -> Array:
        return np.array([getattr(muscle, key) for muscle in muscles])

    return MuscleParameters(
        names=record.muscle_names,
        max_isometric_force=column("max_isometric_force_N"),
        optimal_fibre_length=column("optimal_fibre_length_m"),
        tendon_slack_length=column("tendon_slack_length_m"),
        activation_time=column("activation_time_s"),
        deactivation_time=column("deactivation_time_s"),
        capacity=np.ones(len(muscles)),
        constants=HillConstants(
            gaussian_width=hill.f_gauss,
            passive_stiffness=hill.k_pe,
            passive_strain=hill.epsilon_m0,
            d1=hill.d1,
            d2=hill.d2,
            d3=hill.d3,
            d4=hill.d4,
            max_velocity=hill.v_max,
        ),
    )


def _matrix(inertia) -> Array:
    xx, yy, zz, xy, xz, yz = inertia
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
