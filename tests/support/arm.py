"""An arm of plausible size and its mechanics in plain vectors, independent of the package.

A state is given as joint angles (10,), and angular velocities w (10,): those of clavicle, scapula
and humerus relative to their parents in child axes, and of the elbow. Vectors are in thorax axes.
"""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

SEGMENTS = ("clavicle", "scapula", "humerus", "forearm")
SEQUENCES = ("YZX", "YZX", "YZY")


def parameters(**changes) -> dict:
    """Values of all parameter blocks, by name."""
    return {
        "gravity": [0.3, -9.7, 0.5],
        "offset_SC": [0.02, 0.01, -0.03],
        "offset_AC": [0.15, 0.01, 0.02],
        "offset_GH": [-0.01, -0.03, 0.02],
        "offset_EL": [0.01, -0.29, 0.005],
        "axis_EL": np.array([0.96, 0.1, -0.2]) / np.linalg.norm([0.96, 0.1, -0.2]),
        "mass_clavicle": 0.2,
        "com_clavicle": [0.07, 0.01, 0.01],
        "inertia_clavicle": [1e-4, 5e-4, 6e-4, 1e-5, -2e-5, 3e-5],
        "mass_scapula": 0.7,
        "com_scapula": [-0.05, -0.04, 0.01],
        "inertia_scapula": [1e-3, 8e-4, 7e-4, -1e-4, 5e-5, 2e-5],
        "mass_humerus": 2.1,
        "com_humerus": [0.01, -0.14, 0.0],
        "inertia_humerus": [1.5e-2, 2e-3, 1.6e-2, 3e-4, -1e-4, 2e-4],
        "mass_forearm": 1.6,
        "com_forearm": [0.01, -0.18, 0.02],
        "inertia_forearm": [2e-2, 2e-3, 2.1e-2, -2e-4, 3e-4, 1e-4],
        "mass_load": 1.5,
        "com_load": [0.02, -0.3, 0.01],
        "conoid_origin": [0.12, -0.01, -0.01],
        "conoid_insertion": [-0.03, 0.01, 0.03],
        "conoid_length": 0.017,
        "conoid_stiffness": 1000.0,
        "conoid_eps": 1e-3,
        "contact_TS": [-0.11, -0.04, 0.0],
        "contact_AI": [-0.11, -0.13, 0.01],
        "thorax_centre": [0.0, -0.13, 0.05],
        "thorax_radii": [0.11, 0.16, 0.08],
        "contact_stiffness": 2e4,
        "contact_eps": 0.01,
        "joint_stiffness": [1.0, 2.0, 3.0, 0.5],
        "spring_torque": [0.8, 1.2, 0.25, 0.6],
        "joint_damping": [0.5, 0.6, 0.7, 0.8],
        "stop_stiffness": 40.0,
        "stop_eps": 0.05,
        "range_least_SC": [-0.6, 0.1, 0.2],
        "range_largest_SC": [-0.4, 0.3, 0.4],
        "range_least_AC": [0.7, 0.0, 0.0],
        "range_largest_AC": [0.9, 0.2, 0.2],
        "rest_SC": Rotation.from_euler("YZX", [-0.4, 0.1, 0.3]).as_matrix(),
        "rest_AC": Rotation.from_euler("YZX", [0.8, 0.1, 0.1]).as_matrix(),
        "rest_GH": Rotation.from_euler("YZY", [0.2, 0.5, -0.1]).as_matrix(),
        "rest_EL": 0.7,
        **changes,
    }


# No springs, stops, dampers, ligament or contact: rigid bodies under gravity.
RIGID = {
    "conoid_stiffness": 0.0,
    "contact_stiffness": 0.0,
    "joint_stiffness": [0.0] * 4,
    "spring_torque": [0.0] * 4,
    "joint_damping": [0.0] * 4,
    "stop_stiffness": 0.0,
}


@dataclass(frozen=True)
class Arm:
    """Places and velocities of an arm in one state; lists are in the order of SEGMENTS."""

    p: dict
    joint_rotations: list
    rotations: list
    omegas: list
    origins: list
    velocities: list

    def at(self, segment: str, name: str):
        """Position and velocity of a point given by parameter name in a segment's frame."""
        k = SEGMENTS.index(segment)
        lever = self.rotations[k] @ np.asarray(self.p[name])
        velocity = self.velocities[k] + np.cross(self.omegas[k], lever)
        return self.origins[k] + lever, velocity


def arm(p: dict, rotations: list, elbow: float, w) -> Arm:
    """The arm with rotation matrices of SC, AC, GH, an elbow angle and relative velocities."""
    axis = np.asarray(p["axis_EL"])
    joint_rotations = [*rotations, Rotation.from_rotvec(elbow * axis).as_matrix()]
    relative = [w[:3], w[3:6], w[6:9], w[9] * axis]
    matrix, omega = np.eye(3), np.zeros(3)
    origin, velocity = np.zeros(3), np.zeros(3)
    turned, spins, origins, velocities = [], [], [], []
    for joint, turn, rate in zip(("SC", "AC", "GH", "EL"), joint_rotations, relative, strict=True):
        lever = matrix @ np.asarray(p[f"offset_{joint}"])
        velocity = velocity + np.cross(omega, lever)
        origin = origin + lever
        matrix = matrix @ turn
        omega = omega + matrix @ rate
        for values, value in (
            (turned, matrix), (spins, omega), (origins, origin), (velocities, velocity)
        ):  # fmt: skip
            values.append(value)
    return Arm(p, joint_rotations, turned, spins, origins, velocities)


def arm_from_angles(p: dict, angles, w) -> Arm:
    """The arm at ten joint angles."""
    rotations = [
        Rotation.from_euler(sequence, angles[3 * k : 3 * k + 3]).as_matrix()
        for k, sequence in enumerate(SEQUENCES)
    ]
    return arm(p, rotations, angles[9], w)


def kinetic_energy(state: Arm) -> float:
    """Of all segments and the load [J]."""
    p, energy = state.p, 0.0
    for k, segment in enumerate(SEGMENTS):
        _, velocity = state.at(segment, f"com_{segment}")
        xx, yy, zz, xy, xz, yz = p[f"inertia_{segment}"]
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        spin = state.rotations[k].T @ state.omegas[k]
        energy += 0.5 * p[f"mass_{segment}"] * velocity @ velocity + 0.5 * spin @ inertia @ spin
    _, velocity = state.at("forearm", "com_load")
    return energy + 0.5 * p["mass_load"] * velocity @ velocity


def gravity_energy(state: Arm) -> float:
    """Potential energy in gravity [J]."""
    p = state.p
    moments = [p[f"mass_{s}"] * state.at(s, f"com_{s}")[0] for s in SEGMENTS]
    moments.append(p["mass_load"] * state.at("forearm", "com_load")[0])
    return -float(np.dot(p["gravity"], np.sum(moments, axis=0)))


def spring_energy(state: Arm) -> float:
    """Potential energy of the passive joints [J]: k (1 - cos(angle from rest)), elbow k a^2 / 2."""
    p, energy = state.p, 0.0
    for k, joint in enumerate(("SC", "AC", "GH")):
        turn = np.asarray(p[f"rest_{joint}"]).T @ state.joint_rotations[k]
        energy += p["joint_stiffness"][k] * (3.0 - np.trace(turn)) / 2.0
    axis = np.asarray(p["axis_EL"])
    elbow = Rotation.from_matrix(state.joint_rotations[3]).as_rotvec() @ axis
    return energy + 0.5 * p["joint_stiffness"][3] * (elbow - p["rest_EL"]) ** 2


def exponential_spring_energy(state: Arm) -> float:
    """Work of springs that pull with t (exp(angle / 0.3) - 1) / (exp(2) - 1), elbow included [J].

    The model rounds the tip at no rotation: there the sine counts as hypot(sine, 0.01).
    """
    p, energy = state.p, 0.0
    angles = []
    for k, joint in enumerate(("SC", "AC", "GH")):
        turn = np.asarray(p[f"rest_{joint}"]).T @ state.joint_rotations[k]
        angles.append(Rotation.from_matrix(turn).magnitude())
    elbow = Rotation.from_matrix(state.joint_rotations[3]).as_rotvec() @ np.asarray(p["axis_EL"])
    for k, angle in enumerate(angles):

        def torque(x: float) -> float:
            sine = np.hypot(np.sin(x), 0.01)
            return np.expm1(np.arctan2(sine, np.cos(x)) / 0.3) * np.sin(x) / sine

        energy += p["spring_torque"][k] * quad(torque, 0.0, angle, epsabs=1e-13)[0]

    def hinge(x: float) -> float:
        return np.expm1(np.hypot(x, 0.01) / 0.3) * x / np.hypot(x, 0.01)

    turned = elbow - p["rest_EL"]
    energy += p["spring_torque"][3] * quad(hinge, 0.0, turned, epsabs=1e-13)[0]
    return energy / np.expm1(2.0)


def stop_energy(state: Arm) -> float:
    """Integral of k e^2 over the smooth excess e of the angles of SC and AC [J]."""
    p, k, e = state.p, state.p["stop_stiffness"], state.p["stop_eps"]
    energy = 0.0
    for joint, matrix in zip(("SC", "AC"), state.joint_rotations, strict=False):
        angles = Rotation.from_matrix(matrix).as_euler("YZX")
        for x in (p[f"range_least_{joint}"] - angles, angles - p[f"range_largest_{joint}"]):
            energy += k * np.sum(x**3 / 6 + e**2 * x / 4 + (x**2 + e**2) ** 1.5 / 6)
    return energy


def conoid_energy(state: Arm) -> float:
    """Integral of the tension k (s + sqrt(s^2 + e^2)) / 2 over the stretch s [J]."""
    p = state.p
    line = state.at("scapula", "conoid_insertion")[0] - state.at("clavicle", "conoid_origin")[0]
    s, e = np.linalg.norm(line) - p["conoid_length"], p["conoid_eps"]
    root = np.hypot(s, e)
    return 0.25 * p["conoid_stiffness"] * (s**2 + s * root + e**2 * np.arcsinh(s / e))


def contact_energy(state: Arm) -> float:
    """Integral of k |A|^2 F- / 2 over the level-set value F of both contact points [J]."""
    p, energy = state.p, 0.0
    e, radii = p["contact_eps"], np.asarray(p["thorax_radii"])
    for name in ("contact_TS", "contact_AI"):
        offset = (state.at("scapula", name)[0] - p["thorax_centre"]) / radii
        level = offset @ offset - 1.0
        integral = level**2 - level * np.hypot(level, e) - e**2 * np.arcsinh(level / e)
        energy += p["contact_stiffness"] * (radii @ radii) * integral / 8.0
    return energy


def energy(state: Arm) -> float:
    """Total mechanical energy [J]."""
    parts = (
        kinetic_energy, gravity_energy, spring_energy, exponential_spring_energy, stop_energy,
        conoid_energy, contact_energy,
    )  # fmt: skip
    return sum(part(state) for part in parts)
