"""How much an effect changes what is observed, without noise: does a case show its cause at all?

Letters: K channels (10 kinematic, then EMG, then joint force), F = 101 phase points.
"""

from __future__ import annotations

import numpy as np

from scapulohumeral.model.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    trial_to_pose,
)
from simulated_persons.observation import CHANNELS, Recording
from simulated_persons.scatter import ANGLE_DEG

KINEMATIC = (
    "SC_rx", "SC_ry", "SC_rz", "AC_rx", "AC_ry", "AC_rz", "GH_rx", "GH_ry", "GH_rz", "EL_rx",
)  # fmt: skip
CONTACT = ("GHF_x", "GHF_y", "GHF_z")
PHASE = np.linspace(0.0, 1.0, 101)
# Registered before any draw: an effect counts as shown if, in some channel, its root mean square
# over the movement is at least this many standard errors of the difference that a case contains.
FOOTPRINT_MULTIPLE = 2.0
# Standard deviation between repeats that it is measured with: angles of real people, timing taken
# off; share of maximum; newtons.
EMG_FLOOR, EMG_FLOOR_SHARE = 0.015, 0.1
FORCE_FLOOR_N, FORCE_FLOOR_SHARE = 10.0, 0.05
# Without reference trials a record can be compared with a model only, which misses arms without any
# effect by 1 to 8 deg and 0.02 to 0.16 of maximum (open cases): nothing smaller can be seen.
MODEL_ANGLE_DEG, MODEL_EMG, MODEL_FORCE_N = 4.0, 0.08, 150.0


def channel_names(emg: bool, contact: bool) -> tuple[str, ...]:
    """Names of the K channels."""
    return (*KINEMATIC, *(CHANNELS if emg else ()), *(CONTACT if contact else ()))


def difference(test: Recording, reference: Recording, emg: bool, contact: bool) -> np.ndarray:
    """Test minus reference (F, K): rotation vectors in proximal axes [deg], EMG [1], force [N]."""
    pose, base = (trial_to_pose(_at_phase(r.angles_rad)) for r in (test, reference))
    columns = []
    for joint in range(3):
        part = slice(4 * joint, 4 * joint + 4)
        turn = quaternion_multiply(pose[:, part], quaternion_conjugate(base[:, part]))
        columns.append(2.0 * turn[:, 1:] * np.sign(turn[:, :1]))
    columns.append(pose[:, 12:] - base[:, 12:])
    changes = [np.rad2deg(np.hstack(columns))]
    if emg:
        changes.append(_at_phase(test.emg) - _at_phase(reference.emg))
    if contact:
        changes.append(_at_phase(test.force_N) - _at_phase(reference.force_N))
    return np.hstack(changes)


def floor(
    reference: Recording, repeats: int, emg: bool, contact: bool, referenced: bool
) -> np.ndarray:
    """Standard error (F, K) of the difference between two means of repeats, or to a model."""
    sd = [np.tile(ANGLE_DEG, (len(PHASE), 1))]
    model = [MODEL_ANGLE_DEG]
    if emg:
        sd.append(EMG_FLOOR + EMG_FLOOR_SHARE * _at_phase(reference.emg))
        model.append(MODEL_EMG)
    if contact:
        force = np.linalg.norm(_at_phase(reference.force_N), axis=1, keepdims=True)
        sd.append(np.repeat(FORCE_FLOOR_N + FORCE_FLOOR_SHARE * force, 3, axis=1))
        model.append(MODEL_FORCE_N)
    repeated = np.hstack(sd)
    if referenced:
        return repeated * np.sqrt(2.0 / repeats)
    missed = np.repeat(model, [part.shape[1] for part in sd])
    return np.sqrt(repeated**2 / repeats + missed**2)


def footprints(sigma: np.ndarray) -> np.ndarray:
    """Root mean square over phase of a change in standard errors (F, K), per channel (K,)."""
    return np.sqrt(np.mean(sigma**2, axis=0))


def _at_phase(values: np.ndarray) -> np.ndarray:
    phase = np.linspace(0.0, 1.0, len(values))
    return np.stack([np.interp(PHASE, phase, column) for column in values.T], axis=1)
