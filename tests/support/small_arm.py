"""A small model with few muscles for tests of the optimal control problem."""

import numpy as np
from arm import parameters

from scapulohumeral.dynamics.hill import HillConstants, MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.model.muscle_paths.geometry import ROTATION_FEATURES, MuscleGeometry
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.objective import Objective, Weights

STEP = 0.04
# One straight muscle from scapula to humerus, one polynomial across GH and elbow, one elbow only.
NAMES = ("coracobrachialis", "biceps", "brachialis")


def small_geometry() -> MuscleGeometry:
    """Three muscles with plausible lengths and arms."""
    exponents = np.zeros((5, 10), dtype=int)
    exponents[1, 9] = 1
    exponents[2, 7] = 1
    exponents[3, [7, 9]] = 1
    exponents[4, 8] = 2
    length = np.zeros((3, 5 + ROTATION_FEATURES))
    length[0, 0] = 0.05
    length[0, 5 + 27 : 5 + 36] = 1e-3 * np.arange(-4, 5)
    length[1, :5] = [0.30, -0.03, 0.02, 0.005, 0.01]
    length[2, :2] = [0.16, -0.02]
    translation = np.zeros((3, *length.shape))
    translation[:, 0, 0] = [0.1, -0.2, 0.05]
    translation[:, 1, [0, 2]] = [[0.2, 0.1], [-0.9, 0.05], [0.1, 0.2]]
    return MuscleGeometry(NAMES, exponents, length, translation, np.array([True, False, False]))


def small_muscles() -> MuscleParameters:
    """Hill parameters of the three muscles."""
    return MuscleParameters(
        names=NAMES,
        max_isometric_force=np.array([200.0, 500.0, 400.0]),
        optimal_fibre_length=np.array([0.12, 0.13, 0.09]),
        tendon_slack_length=np.array([0.09, 0.17, 0.06]),
        activation_time=np.array([0.015, 0.02, 0.03]),
        deactivation_time=np.array([0.05, 0.06, 0.07]),
        capacity=np.array([1.0, 0.7, 1.0]),
        constants=HillConstants(),
    )


def small_parameters() -> np.ndarray:
    """Dynamics parameters of the plausible arm, nearly weightless: three muscles cannot lift it.

    Stops of the girdle are soft and its springs linear: stiff ones and exponential ones give the
    small problem several optima.
    """
    soft = {"contact_stiffness": 100.0, "stop_stiffness": 0.5, "spring_torque": [0.0] * 4}
    return pack(parameters(gravity=[0.01, -0.1, 0.02], mass_load=0.0, **soft))


def small_motion(nodes: int) -> np.ndarray:
    """Joint angles (nodes, 10) [rad] of a slow elevation with elbow flexion."""
    s = np.linspace(0.0, 1.0, nodes)[:, None]
    start = np.array([-0.4, 0.1, 0.2, 0.8, 0.05, 0.0, 0.2, 0.4, 0.3, 0.3])
    end = np.array([-0.5, 0.2, 0.3, 0.85, 0.2, 0.05, 0.3, 0.7, 0.2, 0.6])
    return start + (end - start) * s**2 * (3 - 2 * s)


def small_objective(name: str, nodes: int, stability: float) -> Objective:
    """All terms of the objective on the slow elevation."""
    errors = pose_errors(name)
    return Objective(
        errors=errors,
        reference=errors.reference(small_motion(nodes) + 0.05, 0.5),
        weights=Weights(stability=stability, regularisation=3e-3, reaction_rate=3e-7, anchor=20.0),
        step=STEP,
        glenoid=(0.11, 0.23),
        superior_inferior_share=0.31,
        activity=np.linspace(0.5, 1.0, nodes),
    )


def small_forces(equations) -> MuscleForces:
    """Muscle forces of the three muscles on given equations."""
    return MuscleForces(equations, small_geometry())
