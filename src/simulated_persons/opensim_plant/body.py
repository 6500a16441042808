"""What OpenSim is told of one person in one condition, as arrays that fit into one file.

Letters: M muscles.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

# File that lists the trials, and exit code of the process where a load cannot be shared out.
JOBS, UNSHARED = "jobs.json", 3
SEGMENTS = ("clavicle", "scapula", "humerus", "forearm")
JOINTS = ("SC", "AC", "GH", "EL")


@dataclass(frozen=True, eq=False)
class Body:
    """Body and control of one person. Factors are relative to the participant's model.

    Attributes
    ----------
    mass_factor : (4,) of `SEGMENTS`; ulna, radius and hand are the forearm
    load_kg : () gripped weight
    gravity : (3,) in the thorax [m/s^2]
    force_factor, fibre_factor : (M,) of maximal isometric force and of optimal fibre length
    end_force : (M,) share of the active force left at the end of a trial
    tendon_strain : (M,) strain of the tendon at maximal isometric force [1]
    rise_s, fall_s : (M,) time constants of activation
    cost : (M,) weight of each muscle's effort; tonic, cap : (M,) bounds of activation
    glenoid_rad : (2,) inferior inclination and anterior version
    conoid_m : (2, 3) ends of the conoid ligament on clavicle and scapula, in their axes
    joint_damping : (4,) of `JOINTS` [N m s/rad]
    capsule_Nm : () scale of an exponential torque against raising the humerus in the glenoid
    friction_Nm : () of the glenohumeral joint, about each axis
    arm_force_N : (3,) force on the forearm in thorax axes; arm_force_share : () of the way from
        the elbow to the centre of the hand at which it acts
    """

    mass_factor: np.ndarray
    load_kg: np.ndarray
    gravity: np.ndarray
    force_factor: np.ndarray
    fibre_factor: np.ndarray
    end_force: np.ndarray
    tendon_strain: np.ndarray
    rise_s: np.ndarray
    fall_s: np.ndarray
    cost: np.ndarray
    tonic: np.ndarray
    cap: np.ndarray
    glenoid_rad: np.ndarray
    conoid_m: np.ndarray
    joint_damping: np.ndarray
    capsule_Nm: np.ndarray  # noqa: N815 - unit
    friction_Nm: np.ndarray  # noqa: N815 - unit
    arm_force_N: np.ndarray  # noqa: N815 - unit
    arm_force_share: np.ndarray


def write_body(body: Body, path: Path) -> None:
    """Write a body as .npz."""
    np.savez(path, **vars(body))


def read_body(path: Path) -> Body:
    """Read what :func:`write_body` wrote."""
    with np.load(path) as arrays:
        return Body(**arrays)
