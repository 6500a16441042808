"""Parameters, bounds and muscles of the problem that choices stand for.

Numbers of the authors' public program (zoufaond/Quaternion-Predictive-SHR, MIT) stand below with
the file that they are from.

Letters: N nodes, M muscles, P scalar parameters of the equations of motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.parameters import BALL_JOINTS, pack, unpack
from scapulohumeral.dynamics.participant_parameters import forearm_parameters
from scapulohumeral.model.muscle_paths.authors_thorax import (
    CONTACT_POINTS_M,
    THORAX_CENTRE_M,
    THORAX_RADII_M,
)
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import euler_to_quaternion, quaternion_to_matrix
from scapulohumeral.ocp.problem import Bounds
from scapulohumeral.problems.problem_choices import ProblemChoices

# Springs (Python/equations.py): exponential, in calibration, validation and prediction; torque of
# SC, AC and GH [N m], rest poses [deg] as Y-Z-X angles, that of GH the axes of the scapula; damping
# of all joints [N m s/rad]. The elbow has no spring.
SPRING_TORQUE_NM = (1.0, 1.0, 0.25, 0.0)
SPRING_REST_DEG = {"SC": (-21.5, 5.0, 0.3), "AC": (52.6, 7.0, 1.0), "GH": (0.0, 0.0, 0.0)}
DAMPING_NMS_PER_RAD = 0.5
# Conoid ligament (das3_readosim.m of 98b9480): stiffness [N/m], slack length [m], smoothing, which
# their law k/2 (d + sqrt(d^2 + eps)) does not square [m^2], and insertion [m]: beside the origin of
# muscle 83, the long head of the biceps in DAS3, the short head in a model without serr_ant12.
CONOID_STIFFNESS_N_PER_M = 1000.0
CONOID_LENGTH_M = 0.017
CONOID_EPS_M2 = 1e-3
CONOID_INSERTION_M = (-0.0094, -0.0176, -0.0312)
# Least share of their force that lost muscles keep (56eeedd): none would divide by zero.
LEAST_FORCE = 1e-6
SCALAR_PARTS = [0, 4, 8]


def chosen_parameters(
    parameters: np.ndarray, record: ModelRecord, choices: ProblemChoices
) -> np.ndarray:
    """Run-time parameters (P,) of the study's model with the choices put on."""
    values: dict[str, object] = {name: block.copy() for name, block in unpack(parameters).items()}
    if choices.forearm == "unturned":
        values |= forearm_parameters(replace(record, pronation_rad=0.0))
    if choices.humerus_centre_m is not None:
        x, _, z = unpack(parameters)["com_humerus"]
        values["com_humerus"] = [x, -choices.humerus_centre_m, z]
    if choices.capsule_Nm is not None:
        torque = unpack(parameters)["spring_torque"].copy()
        torque[BALL_JOINTS.index("GH")] = choices.capsule_Nm
        values["spring_torque"] = torque
    if choices.springs == "exponential":
        values |= _exponential_springs()
    if choices.conoid == "soft":
        values |= {
            "conoid_stiffness": CONOID_STIFFNESS_N_PER_M,
            "conoid_length": CONOID_LENGTH_M,
            "conoid_eps": np.sqrt(CONOID_EPS_M2),
            "conoid_insertion": CONOID_INSERTION_M,
        }
    if choices.contact == "published":
        values |= {"thorax_centre": THORAX_CENTRE_M, "thorax_radii": THORAX_RADII_M}
        values |= CONTACT_POINTS_M
    if choices.contact == "none":
        values["contact_stiffness"] = 0.0
    if not choices.stops:
        values["stop_stiffness"] = 0.0
    return pack(values)


def _exponential_springs() -> Mapping[str, object]:
    rest = {
        f"rest_{joint}": quaternion_to_matrix(
            euler_to_quaternion(np.deg2rad(SPRING_REST_DEG[joint]), "YZX")
        )
        for joint in BALL_JOINTS
    }
    return {
        "joint_stiffness": [0.0] * 4,
        "spring_torque": SPRING_TORQUE_NM,
        "joint_damping": [DAMPING_NMS_PER_RAD] * 4,
        **rest,
    }


def chosen_bounds(choices: ProblemChoices, reference: np.ndarray, usual: Bounds) -> Bounds:
    """Bounds of the unknowns for a reference motion in coordinates (N, 13), of `usual` ones."""
    bounds = replace(usual, ends_at_rest=choices.ends_at_rest)
    if choices.largest_compression_N is not None:
        # The reaction on the humeral head points away from the glenoid.
        bounds = replace(bounds, compression=(0.0, choices.largest_compression_N))
    if choices.coordinate_margin is not None:
        box = np.stack([reference.min(axis=0), reference.max(axis=0)])
        box += np.array([[-choices.coordinate_margin], [choices.coordinate_margin]])
        # Theirs, too, let scalar parts reach 1 but not more.
        box[1, SCALAR_PARTS] = np.minimum(box[1, SCALAR_PARTS], 1.0)
        bounds = replace(bounds, coordinates=box)
    return bounds


def without_force(
    muscles: MuscleParameters, limited: np.ndarray, capacity: float, lost_force: str
) -> MuscleParameters:
    """Muscle parameters with some muscles (M,) limited to a share of their force."""
    if lost_force == "whole":
        share = np.where(limited, max(capacity, LEAST_FORCE), 1.0)
        return replace(muscles, max_isometric_force=muscles.max_isometric_force * share)
    return replace(muscles, capacity=muscles.capacity * np.where(limited, capacity, 1.0))
