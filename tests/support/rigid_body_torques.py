"""Joint torques of a participant's arm without springs, ligament and contact, in a process of its
own: python rigid_body_torques.py EQUATIONS_FOLDER RECORD_JSON STATES_NPZ TORQUES_NPZ

States are joint angles, rates and accelerations (P, 10). Torques (P, 10) are conjugate to the
angles, computed in both formulations.
"""

import sys
from pathlib import Path

import numpy as np
from arm import RIGID
from cached_equations import cached_equations

from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.dynamics.participant_parameters import dynamics_parameters
from scapulohumeral.model.record import read_record
from scapulohumeral.model.rotations import JOINT_SEQUENCES, euler_rate_jacobian, trial_to_pose

THORAX = {"centre_m": [0.0, 0.0, 0.0], "radii_m": [1.0, 1.0, 1.0]}  # without contact of no effect
STEP = 1e-5


def angular(angles, rates):
    """Relative angular velocities (P, 10) in child axes of angle rates."""
    w = rates.copy()
    for start, sequence in zip((0, 3, 6), JOINT_SEQUENCES.values(), strict=True):
        columns = slice(start, start + 3)
        jacobian = euler_rate_jacobian(angles[:, columns], sequence)
        w[:, columns] = np.einsum("pij,pj->pi", jacobian, rates[:, columns])
    return w


def angle_torques(angles, torque):
    """Torques conjugate to the angles of torques (P, 10) about child axes."""
    result = torque.copy()
    for start, sequence in zip((0, 3, 6), JOINT_SEQUENCES.values(), strict=True):
        columns = slice(start, start + 3)
        jacobian = euler_rate_jacobian(angles[:, columns], sequence)
        result[:, columns] = np.einsum("pij,pi->pj", jacobian, torque[:, columns])
    return result


def main(folder, record, states, output):
    values = unpack(dynamics_parameters(read_record(record), THORAX, 0.0))
    p = pack({**values, **RIGID})
    with np.load(states) as data:
        angles, rates, accelerations = (data[k] for k in ("angles", "rates", "accelerations"))
    nothing = np.zeros((len(angles), 3))

    euler = cached_equations("euler", folder)
    residual = euler.residual(np.hstack([angles, rates, accelerations, nothing]), p)

    quaternion = cached_equations("quaternion", folder)
    later, earlier = (
        angular(angles + s * STEP * rates, rates + s * STEP * accelerations) for s in (1.0, -1.0)
    )
    alpha = (later - earlier) / (2.0 * STEP)
    z = np.hstack([trial_to_pose(angles), angular(angles, rates), alpha, nothing])
    torque = -quaternion.residual(z, p)[:, :10]
    np.savez(output, euler=-residual[:, :10], quaternion=angle_torques(angles, torque))


if __name__ == "__main__":
    main(*(Path(argument) for argument in sys.argv[1:]))
