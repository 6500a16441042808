"""What stands for shoulder girdle motion that a recording does not hold: published rules.

- Axial rotation of the clavicle, which no pair of landmarks shows: the turn about its long axis
  that brings the scapula relative to the clavicle closest to its posture at rest (rule of DAS3,
  after van der Helm and Pronk 1995, J Biomech Eng 117:27).
- Clavicle and scapula altogether: linear regression on the elevation of the humerus (de Groot and
  Brand 2001, Clin Biomech 16:735), with the mean posture at rest of DAS3.

Letters: T frames. Angles of the model in radians: clavicle, scapula in the thorax Y-Z-X, humerus in
the thorax Y-Z-Y.
"""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.model.rotations import Array

# Clavicle and scapula in the thorax at rest, Y-Z-X, mean of the subjects behind DAS3 [deg].
REST_CLAVICLE_DEG = (-28.573324, 11.679804, 7.482095)
REST_SCAPULA_DEG = (32.047376, 10.669100, -10.320259)
# Rows: constant [deg], slope on the plane of elevation [1], on the elevation [1], on the angle at
# rest [1]; de Groot and Brand 2001, as DAS3 uses them.
CLAVICLE_Y = (-4.983, 0.120, -0.242, 0.851)
CLAVICLE_Z = (3.917, -0.046, 0.123, 0.493)
SCAPULA_Y = (-1.203, 0.140, -0.049, 0.901)
SCAPULA_Z = (3.095, -0.079, 0.396, 0.414)
SCAPULA_X = (0.659, -0.028, 0.184, 0.886)
# Below this elevation the plane of elevation is noise; it then counts by its share [rad].
PLANE_FROM_RAD = np.deg2rad(15.0)


def rest_scapula_in_clavicle() -> Array:
    """Scapula relative to the clavicle at rest, (3, 3)."""
    clavicle = Rotation.from_euler("YZX", REST_CLAVICLE_DEG, degrees=True)
    scapula = Rotation.from_euler("YZX", REST_SCAPULA_DEG, degrees=True)
    return (clavicle.inv() * scapula).as_matrix()


def clavicle_direction_angles(direction: Array) -> Array:
    """Protraction and elevation, (T, 2) [rad], of clavicle directions (T, 3) in the thorax."""
    x, y, z = direction.T
    return np.column_stack([np.arctan2(-z, x), np.arcsin(np.clip(y, -1.0, 1.0))])


def clavicle_rotation(direction: Array, scapula: Array) -> Array:
    """Clavicle in the thorax with its axial rotation estimated.

    Of all turns a about the long axis it takes the one with the smallest angle between the scapula
    relative to the clavicle and its posture at rest: the maximum of trace(R0^T Rx(-a) M), where M
    is the scapula relative to the unturned clavicle.

    Parameters
    ----------
    direction : array, shape (T, 3)      unit vectors SC to AC, thorax axes
    scapula : array, shape (T, 3, 3)     scapula in the thorax

    Returns
    -------
    array, shape (T, 3, 3)               clavicle in the thorax
    """
    yz = clavicle_direction_angles(direction)
    unturned = Rotation.from_euler("YZ", yz).as_matrix()
    moved = unturned.swapaxes(1, 2) @ scapula @ rest_scapula_in_clavicle().T
    turn = np.arctan2(moved[:, 2, 1] - moved[:, 1, 2], moved[:, 1, 1] + moved[:, 2, 2])
    return unturned @ Rotation.from_euler("X", turn[:, None]).as_matrix()


def regressed_girdle(humerus: Array) -> tuple[Array, Array]:
    """Clavicle directions (T, 3) and scapulae (T, 3, 3) in the thorax, from the humerus alone.

    Parameters
    ----------
    humerus : array, shape (T, 3, 3)     humerus in the thorax
    """
    plane, elevation = humerus_elevation(humerus)
    share = np.clip(elevation / PLANE_FROM_RAD, 0.0, 1.0)
    plane_deg, elevation_deg = np.rad2deg(plane * share), np.rad2deg(elevation)

    def angle(rule: tuple[float, ...], rest_deg: float) -> Array:
        constant, on_plane, on_elevation, on_rest = rule
        degrees = constant + on_plane * plane_deg + on_elevation * elevation_deg
        return np.deg2rad(degrees + on_rest * rest_deg)

    y = angle(CLAVICLE_Y, REST_CLAVICLE_DEG[0])
    z = angle(CLAVICLE_Z, REST_CLAVICLE_DEG[1])
    direction = Rotation.from_euler("YZ", np.column_stack([y, z])).as_matrix()[:, :, 0]
    rules = (SCAPULA_Y, SCAPULA_Z, SCAPULA_X)
    scapula = [angle(rule, rest) for rule, rest in zip(rules, REST_SCAPULA_DEG, strict=True)]
    return direction, Rotation.from_euler("YZX", np.column_stack(scapula)).as_matrix()


def humerus_elevation(humerus: Array) -> tuple[Array, Array]:
    """Plane of elevation and elevation, both (T,) [rad], of humeri (T, 3, 3) in the thorax.

    The plane is 0 to the right and +90 deg to the front, as GH_y.
    """
    x, y, z = humerus[:, :, 1].T
    return np.arctan2(z, -x), np.arccos(np.clip(y, -1.0, 1.0))
