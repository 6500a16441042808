"""What a prediction leaves open beside its model: the study's own problem or that of the authors.

The authors' public program (zoufaond/Quaternion-Predictive-SHR, MIT) solves another problem than
the paper prints. Each difference is a choice here, so that one code solves both problems and
everything between them. Numbers of theirs stand below with the file that they are from.

Letters: N nodes, M muscles, P scalar parameters of the equations of motion.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.parameters import BALL_JOINTS, pack, unpack
from scapulohumeral.dynamics.participant_parameters import forearm_parameters
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.authors_thorax import (
    CONTACT_POINTS_M,
    THORAX_CENTRE_M,
    THORAX_RADII_M,
)
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.model.rotations import euler_to_quaternion, quaternion_to_matrix
from scapulohumeral.ocp.problem import Bounds

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


@dataclass(frozen=True)
class ProblemChoices:
    """One optimal control problem among those between the study's own and the authors'.

    Attributes
    ----------
    arm : "own" (humerus and elbow as tracked) or "published" (those of the published composite)
    springs : "own" springs of the model, or "exponential" ones of all joints but the elbow, with
        their rest pose and damping
    forearm : how radius and hand lie as masses: "turned" by the locked pronation, or "unturned" in
        the axes of the ulna
    humerus_centre_m : distance of the humerus' mass centre from its head along the bone [m]; None:
        as scaled
    capsule_Nm : torque of the exponential spring of the model's glenohumeral joint at 0.6 rad;
        None: that of the model
    conoid : "stiff" at the recorded length, or "soft"
    contact : "fitted" thorax ellipsoid, the "published" one, or "none"
    stops : whether clavicle and scapula have stops at the ends of their ranges
    strength_exponent : power of strength in squared activations [1]; None: as configured
    reaction_rate : weight of squared rates of the joint reaction [s/N^2]; None: as configured
    largest_compression_N : bound of the lateral reaction, which then may not pull; None: neither
    clavicle_anchor : weight of the sum of the clavicle's quaternion components, less that of its
        recorded orientation at the start, at the first and the last node [1/s]
    ends_at_rest : whether all speeds are zero at the first and the last node
    coordinate_margin : how far quaternion components may leave the range of the reference [1]
    lost_force : what limited muscles lose, "active" force or "whole"
    elbow_in_pauses : whether the elbow is tracked between the elevations, too
    """

    arm: str = "own"
    springs: str = "own"
    forearm: str = "turned"
    humerus_centre_m: float | None = None
    capsule_Nm: float | None = None
    conoid: str = "stiff"
    contact: str = "fitted"
    stops: bool = True
    strength_exponent: float | None = None
    reaction_rate: float | None = None
    largest_compression_N: float | None = None
    clavicle_anchor: float = 0.0
    ends_at_rest: bool = False
    coordinate_margin: float | None = None
    lost_force: str = "active"
    elbow_in_pauses: bool = False

    def __post_init__(self) -> None:
        """Refuse words that name no choice, and numbers that are none."""
        words = {
            "arm": ("own", "published"),
            "springs": ("own", "exponential"),
            "forearm": ("turned", "unturned"),
            "conoid": ("stiff", "soft"),
            "contact": ("fitted", "published", "none"),
            "lost_force": ("active", "whole"),
        }
        for key, allowed in words.items():
            if getattr(self, key) not in allowed:
                raise ConfigError(
                    f"choice {key}: {getattr(self, key)!r}; choose {' or '.join(allowed)}"
                )
        for key in (
            "humerus_centre_m",
            "capsule_Nm",
            "reaction_rate",
            "largest_compression_N",
            "coordinate_margin",
        ):
            value = getattr(self, key)
            if value is not None and not value > 0:
                raise ConfigError(f"choice {key}: {value}; expected a positive number")
        if self.capsule_Nm is not None and self.springs == "exponential":
            raise ConfigError(
                f"choice capsule_Nm: {self.capsule_Nm} beside exponential springs, which have a "
                "torque of their own; leave one of both out"
            )
        if not self.clavicle_anchor >= 0:
            raise ConfigError(
                f"choice clavicle_anchor: {self.clavicle_anchor}; expected no negative number"
            )


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


def chosen_bounds(choices: ProblemChoices, reference: np.ndarray) -> Bounds:
    """Bounds of the unknowns for a reference motion in coordinates (N, 13)."""
    bounds = Bounds(ends_at_rest=choices.ends_at_rest)
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
