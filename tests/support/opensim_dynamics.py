"""What OpenSim says of torques, for comparison with the equations of motion."""

import numpy as np
import opensim

from scapulohumeral.model.rotations import ANGLE_NAMES


def inverse_dynamics(
    model: opensim.Model, angles: np.ndarray, speeds: np.ndarray, accelerations: np.ndarray
) -> np.ndarray:
    """Generalised torques (P, 10) [N m] that move the bodies, without muscles.

    Parameters
    ----------
    model : its forearm and thorax stay at their defaults
    angles, speeds, accelerations : (P, 10) joint angles in the order of ``rotations.ANGLE_NAMES``
        [rad], and their derivatives
    """
    copy = model.clone()
    muscles = copy.updMuscles()
    for index in range(muscles.getSize()):
        muscles.get(index).set_appliesForce(False)
    state = copy.initSystem()
    coordinates = [copy.updCoordinateSet().get(name) for name in ANGLE_NAMES]
    solver = opensim.InverseDynamicsSolver(copy)
    columns = _speed_columns(state, coordinates)
    result = np.empty(angles.shape)
    for p in range(len(angles)):
        values = zip(coordinates, angles[p].tolist(), speeds[p].tolist(), strict=True)
        for coordinate, angle, speed in values:
            coordinate.setValue(state, angle, False)
            coordinate.setSpeedValue(state, speed)
        acceleration = opensim.Vector(state.getNU(), 0.0)
        for column, value in zip(columns, accelerations[p].tolist(), strict=True):
            acceleration.set(column, value)
        torque = solver.solve(state, acceleration)
        result[p] = [torque.get(column) for column in columns]
    return result


def _speed_columns(state: opensim.State, coordinates: list[opensim.Coordinate]) -> list[int]:
    """Places of the coordinates among the speeds of the state, found by setting them apart."""
    for k, coordinate in enumerate(coordinates, start=1):
        coordinate.setSpeedValue(state, float(k))
    speeds = state.getU()
    values = [speeds.get(i) for i in range(speeds.size())]
    return [values.index(float(k)) for k in range(1, len(coordinates) + 1)]
