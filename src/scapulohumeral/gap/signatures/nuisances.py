"""What changes between two recordings of one person without a cause.

Letters: R nuisances.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from scapulohumeral.gap.effects.emd import PARAMS as DELAY
from scapulohumeral.gap.effects.emd import Emd
from scapulohumeral.gap.effects.frame_misalignment import SEGMENTS
from scapulohumeral.gap.effects.frames import turn_frame
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.observables import phase_functions
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.model.rotations import Array

# Smooth changes of posture and smooth slack forces: mean, trend, and one bend more each.
SMOOTH = 4
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


def unmeasured_records(
    mean_record: Observation, unmeasured: Mapping[str, float]
) -> list[Observation]:
    """Records (R) with one standard deviation of each turn of segments that nobody measured.

    Parameters
    ----------
    mean_record : record with rules in place of them
    unmeasured : segment -> standard deviation of its turns, smooth over the movement [deg]
    """
    return [
        record
        for segment, deviation in unmeasured.items()
        for record in _turned(mean_record, segment, deviation, np.eye(3))
    ]


def _turned(
    mean_record: Observation, segment: str, deviation_deg: float, axes: Array
) -> Iterator[Observation]:
    """Records with a segment turned about each of its axes (A, 3), smoothly over the movement."""
    nodes = len(mean_record.pose)
    for shape in SMOOTH_SHARES[:, None] * phase_functions(nodes, SMOOTH).T * np.sqrt(nodes):
        for axis in axes:
            vectors = np.deg2rad(deviation_deg) * shape[:, None] * axis
            yield replace(mean_record, pose=turn_frame(mean_record.pose, segment, vectors))
