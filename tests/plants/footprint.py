"""How much an effect changes what is observed, without noise: does a case show its cause at all?

Letters: K channels (10 kinematic, then EMG), F = 101 phase points.
"""

from __future__ import annotations

import numpy as np

from plants.observation import CHANNELS, Recording
from scapulohumeral.model.rotations import (
    quaternion_conjugate,
    quaternion_multiply,
    trial_to_pose,
)

KINEMATIC = (
    "SC_rx", "SC_ry", "SC_rz", "AC_rx", "AC_ry", "AC_rz", "GH_rx", "GH_ry", "GH_rz", "EL_rx",
)  # fmt: skip
PHASE = np.linspace(0.0, 1.0, 101)
# Registered before any draw: an effect counts as shown if, in some channel, its root mean square
# over the movement is at least this many standard errors of the difference that a case contains.
FOOTPRINT_MULTIPLE = 2.0
# Standard deviation between repeats that it is measured with: degrees, and share of maximum.
ANGLE_FLOOR_DEG = 1.3
EMG_FLOOR, EMG_FLOOR_SHARE = 0.015, 0.1
# Without reference trials a record can be compared with a model only, which misses arms without any
# effect by 1 to 8 deg and 0.02 to 0.16 of maximum (open cases): nothing smaller can be seen.
MODEL_ANGLE_DEG, MODEL_EMG = 4.0, 0.08


def channel_names(emg: bool) -> tuple[str, ...]:
    """Names of the K channels."""
    return (*KINEMATIC, *CHANNELS) if emg else KINEMATIC


def difference(test: Recording, reference: Recording, emg: bool) -> np.ndarray:
    """Test minus reference (F, K): rotation vectors in proximal axes [deg], envelopes [1]."""
    pose, base = (trial_to_pose(_at_phase(r, r.angles_rad)) for r in (test, reference))
    columns = []
    for joint in range(3):
        part = slice(4 * joint, 4 * joint + 4)
        turn = quaternion_multiply(pose[:, part], quaternion_conjugate(base[:, part]))
        columns.append(2.0 * turn[:, 1:] * np.sign(turn[:, :1]))
    columns.append(pose[:, 12:] - base[:, 12:])
    angles = np.rad2deg(np.hstack(columns))
    if not emg:
        return angles
    return np.hstack([angles, _at_phase(test, test.emg) - _at_phase(reference, reference.emg)])


def floor(reference: Recording, repeats: int, emg: bool, referenced: bool) -> np.ndarray:
    """Standard error (F, K) of the difference between two means of repeats, or to a model."""
    sd = np.full((len(PHASE), len(KINEMATIC)), ANGLE_FLOOR_DEG)
    model = np.full(sd.shape, MODEL_ANGLE_DEG)
    if emg:
        share = EMG_FLOOR + EMG_FLOOR_SHARE * _at_phase(reference, reference.emg)
        sd, model = np.hstack([sd, share]), np.hstack([model, np.full(share.shape, MODEL_EMG)])
    if referenced:
        return sd * np.sqrt(2.0 / repeats)
    return np.sqrt(sd**2 / repeats + model**2)


def footprints(sigma: np.ndarray) -> np.ndarray:
    """Root mean square over phase of a change in standard errors (F, K), per channel (K,)."""
    return np.sqrt(np.mean(sigma**2, axis=0))


def _at_phase(recording: Recording, values: np.ndarray) -> np.ndarray:
    phase = np.linspace(0.0, 1.0, len(values))
    return np.stack([np.interp(PHASE, phase, column) for column in values.T], axis=1)
