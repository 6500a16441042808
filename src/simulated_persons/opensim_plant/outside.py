"""Forces on the bodies that OpenSim's model lacks: aids, stiff and rough joints.

Moments and forces (2, 3) act at the origins of bodies, in ground axes, which are the thorax's.
"""

from __future__ import annotations

import numpy as np
import opensim

from simulated_persons.opensim_plant.body import JOINTS, Body

# Each joint's bodies, proximal first; None is the thorax, which does not move.
PAIRS: dict[str, tuple[str | None, str]] = {
    "SC": (None, "clavicle_r"),
    "AC": ("clavicle_r", "scapula_r"),
    "GH": ("scapula_r", "humerus_r"),
    "EL": ("humerus_r", "ulna_r"),
}
CAPSULE_ONSET_RAD, CAPSULE_RATE = np.deg2rad(45.0), 6.0  # stiffens e-fold every 10 deg
LARGEST_SWING_RAD = 0.6  # beyond the onset: nobody is stiffer
FRICTION_SPEED = 0.2  # rad/s, below which friction fades

Forces = dict[str, np.ndarray]


def outside_forces(bodies: dict[str, opensim.Body], state: opensim.State, body: Body) -> Forces:
    """Sum of all such forces, for bodies on which any act; velocities must be realised."""
    result: Forces = {}
    for joint, damping in zip(JOINTS, body.joint_damping.tolist(), strict=True):
        if damping > 0.0:
            _between(result, joint, -damping * _turning(bodies, state, joint))
    if body.friction_Nm > 0.0:
        turning = _turning(bodies, state, "GH")
        _between(result, "GH", -float(body.friction_Nm) * np.tanh(turning / FRICTION_SPEED))
    if body.capsule_Nm > 0.0:
        _between(result, "GH", float(body.capsule_Nm) * _capsule(bodies, state))
    if np.any(body.arm_force_N):
        _add(result, "hand_r", _aid(bodies, state, body))
    return result


def _add(forces: Forces, name: str, more: np.ndarray) -> None:
    forces[name] = forces.get(name, np.zeros((2, 3))) + more


def _between(forces: Forces, joint: str, torque: np.ndarray) -> None:
    """Torque (3,) of the proximal body on the distal one, and its reaction."""
    proximal, distal = PAIRS[joint]
    moment = np.array([torque, np.zeros(3)])
    _add(forces, distal, moment)
    if proximal is not None:
        _add(forces, proximal, -moment)


def _turning(bodies: dict[str, opensim.Body], state: opensim.State, joint: str) -> np.ndarray:
    """Angular velocity (3,) [rad/s] of the distal body against the proximal one."""
    proximal, distal = PAIRS[joint]
    of = _spin(bodies[distal], state)
    return of if proximal is None else of - _spin(bodies[proximal], state)


def _spin(bone: opensim.Body, state: opensim.State) -> np.ndarray:
    return array_of(bone.getVelocityInGround(state).get(0))


def _capsule(bodies: dict[str, opensim.Body], state: opensim.State) -> np.ndarray:
    """Torque (3,) over its scale that turns the humerus back to the upright of the scapula."""
    upright, humerus = (axes_of(bodies[name], state)[:, 1] for name in PAIRS["GH"] if name)
    back = np.cross(humerus, upright)
    sine = max(float(np.linalg.norm(back)), 1e-6)
    angle = np.arctan2(sine, humerus @ upright)
    swing = np.clip(angle - CAPSULE_ONSET_RAD, 0.0, LARGEST_SWING_RAD)
    return np.expm1(CAPSULE_RATE * swing) * back / sine


def _aid(bodies: dict[str, opensim.Body], state: opensim.State, body: Body) -> np.ndarray:
    """Moment about the origin of the hand, and force (2, 3): ulna, radius and hand are rigid."""
    hand = bodies["hand_r"]
    elbow, origin = (array_of(bodies[n].getPositionInGround(state)) for n in ("ulna_r", "hand_r"))
    centre = array_of(hand.findStationLocationInGround(state, hand.getMassCenter()))
    point = elbow + float(body.arm_force_share) * (centre - elbow)
    return np.array([np.cross(point - origin, body.arm_force_N), body.arm_force_N])


def array_of(vector: opensim.Vec3) -> np.ndarray:
    """Numbers (3,) of a vector."""
    return np.array([vector.get(k) for k in range(3)])


def axes_of(bone: opensim.Body, state: opensim.State) -> np.ndarray:
    """Axes of a body, as columns (3, 3), in ground axes."""
    rotation = bone.getTransformInGround(state).R()
    return np.array([[rotation.get(i, j) for j in range(3)] for i in range(3)])
