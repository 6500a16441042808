"""What changes between two recordings of one person without a cause.

Letters: R nuisances.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from scapulohumeral.gap.effects.emd import PARAMS as DELAY
from scapulohumeral.gap.effects.emd import Emd
from scapulohumeral.gap.effects.frame_misalignment import SEGMENTS
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.marks import AXIAL_ROTATION, ELBOW
from scapulohumeral.gap.recording.observables import SensorSetup, phase_functions
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.model.rotations import Array

# Smooth changes of posture and smooth slack forces: mean, trend, and one bend more each.
SMOOTH = 4
# Place of the elbow's flexion in a pose.
FLEXION = 12
# Standard deviations of smooth functions that together vary by one unit, slow ones the most.
SMOOTH_SHARES = 1.0 / np.arange(1, SMOOTH + 1) / np.linalg.norm(1.0 / np.arange(1, SMOOTH + 1))


def session_records(mean_record: Observation, settings: GapSettings) -> list[Observation]:
    """Records (R) with one standard deviation of each error of a new session.

    Frames of three segments, axial rotation of the clavicle, gain, offset and timing of EMG.
    """
    s = settings.session
    records = []
    for segment in SEGMENTS:
        for vector in np.deg2rad(s.frame_deg) * np.eye(3):
            records.append(replace(mean_record, pose=turn_frame(mean_record.pose, segment, vector)))
    records += _turned(mean_record, "clavicle", s.clavicle_axial_deg, np.eye(3)[:1])
    if mean_record.emg is not None:
        for k in range(len(mean_record.channels)):
            one = np.eye(len(mean_record.channels))[k]
            for emg in (
                mean_record.emg * (1.0 + s.emg_gain * one),
                mean_record.emg + s.emg_offset * one,
            ):
                records.append(replace(mean_record, emg=emg))
        delay = Emd("measurement", "emd", None, DELAY, frozenset(), (), "")
        records.append(delay.observe(mean_record, np.array([s.timing_ms])))
    return records


def unmeasured_records(mean_record: Observation, sensors: SensorSetup) -> list[Observation]:
    """Records (R) with one standard deviation of each turn of what nobody measured, smooth over the
    movement: `mean_record` has rules or constants in place of it.
    """
    records = [
        record
        for segment, deviation in sensors.unmeasured.items()
        for record in _turned(mean_record, segment, deviation, np.eye(3))
    ]
    angles = sensors.unmeasured_angles
    if AXIAL_ROTATION in angles:
        long_axis = np.eye(3)[1:2]
        records += _turned(mean_record, "humerus", angles[AXIAL_ROTATION], long_axis)
    if ELBOW in angles:
        for shape in _smooth_shapes(len(mean_record.pose)):
            pose = mean_record.pose.copy()
            pose[:, FLEXION] += np.deg2rad(angles[ELBOW]) * shape
            records.append(replace(mean_record, pose=pose))
    return records


def _turned(
    mean_record: Observation, segment: str, deviation_deg: float, axes: Array
) -> Iterator[Observation]:
    """Records with a segment turned about each of its axes (A, 3), smoothly over the movement."""
    for shape in _smooth_shapes(len(mean_record.pose)):
        for axis in axes:
            vectors = np.deg2rad(deviation_deg) * shape[:, None] * axis
            yield replace(mean_record, pose=turn_frame(mean_record.pose, segment, vectors))


def _smooth_shapes(nodes: int) -> Array:
    """Smooth functions (SMOOTH, N) of phase that together vary by one unit."""
    return SMOOTH_SHARES[:, None] * phase_functions(nodes, SMOOTH).T * np.sqrt(nodes)
