"""What a laboratory records of a simulated trial, with its errors.

Joint angles, EMG envelopes, and the force on an instrumented glenoid.

Letters: S control steps, M muscles, C = 8 EMG channels.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from scapulohumeral.model.rotations import (
    make_continuous,
    pose_to_trial,
    quaternion_conjugate,
    quaternion_multiply,
    quaternion_to_matrix,
    rotation_vector_to_quaternion,
)
from simulated_persons.movement import SETTLE_S, smooth_noise
from simulated_persons.scatter import ANGLE_DEG, curves
from simulated_persons.simulation import TICK_S

# Electrodes of the paper (supplement, table of EMG groups): muscle group, elements under them.
ELECTRODES: dict[str, tuple[str, tuple[str, ...]]] = {
    "EMG_trap_clav": ("trap_clav", ("trap_clav_1",)),
    "EMG_delt_ant": ("delt_clav", ("delt_clav_1", "delt_clav_2")),
    "EMG_delt_lat": ("delt_scap", ("delt_scap_8", "delt_scap_9", "delt_scap10", "delt_scap11")),
    "EMG_delt_post": ("delt_scap", ("delt_scap_3", "delt_scap_4", "delt_scap_5")),
    "EMG_infra": ("infra", ("infra_2", "infra_3", "infra_4")),
    "EMG_trap_up": ("trap_scap", ("trap_scap_1", "trap_scap_2")),
    "EMG_trap_mid": ("trap_scap", ("trap_scap_5", "trap_scap_6")),
    "EMG_serr": ("serr_ant", ("serr_ant_2", "serr_ant_3", "serr_ant_4")),
}
CHANNELS = tuple(ELECTRODES)
NEIGHBOURS = (
    ("EMG_delt_ant", "EMG_delt_lat"),
    ("EMG_delt_lat", "EMG_delt_post"),
    ("EMG_delt_post", "EMG_infra"),
    ("EMG_infra", "EMG_trap_mid"),
    ("EMG_trap_clav", "EMG_trap_up"),
)
OWN_SHARE = 0.5  # of the envelope from the elements under the electrode, the rest from the group
ENVELOPE_HZ = 4.0
FORCE_HZ = 6.0
# Noise of single trials: of humerus and elbow, whose motion itself scatters; that of clavicle and
# scapula is what repeats of real people scatter by.
ANGLE_NOISE_DEG = 0.5
# Skin markers hardly see how clavicle and humerus turn about their long axes: standard deviation of
# an error that changes slowly over a movement; a share of it differs from session to session.
AXIAL_DEG, AXIAL_WAVES, AXIAL_SESSION = np.array([10.0, 5.0]), 3, 0.25
HEART_HZ = 1.2
ARTEFACT_ONSET, ARTEFACT_FULL = np.deg2rad([60.0, 120.0])
# With these, and what movement itself scatters, repeats scatter as those of a real person do
# (config/recordings/hand_load/emg.csv).
EMG_SHARE_NOISE, EMG_FLOOR_NOISE = 0.10, 0.012
FORCE_SHARE_NOISE, FORCE_NOISE_N = 0.02, 5.0


@dataclass(frozen=True, eq=False)
class Measurement:
    """What recording does to the truth.

    Attributes
    ----------
    emg_gain : (C,); crosstalk : (C, C) share of each donor (column) in each receiver (row)
    delay_s : of excitations after envelopes (EMG leads)
    speed_gain : growth of all envelopes per rad/s of humeral speed
    thorax_rad, scapula_rad, humerus_rad : constant rotations of the recorded frames (3,)
    artefact_rad : rotation (3,) of the recorded scapula at 120 deg of elevation, from 60 deg on
    slope : (C,) gain of each envelope at 120 deg of elevation over that with the arm hanging
    heart : (C,) height of heart beats in each envelope
    axial_rad : (2, B) amplitudes over phase of the error about the long axes of clavicle, humerus
    """

    emg_gain: np.ndarray
    crosstalk: np.ndarray
    delay_s: float
    speed_gain: float
    thorax_rad: np.ndarray
    scapula_rad: np.ndarray
    humerus_rad: np.ndarray
    artefact_rad: np.ndarray
    slope: np.ndarray
    heart: np.ndarray
    axial_rad: np.ndarray


def perfect_measurement(emg_gain: np.ndarray) -> Measurement:
    """No errors but the gains of the electrodes (C,)."""
    zero, count = np.zeros(3), len(emg_gain)
    return Measurement(
        emg_gain=emg_gain,
        crosstalk=np.zeros((count, count)),
        delay_s=0.0,
        speed_gain=0.0,
        thorax_rad=zero,
        scapula_rad=zero,
        humerus_rad=zero,
        artefact_rad=zero,
        slope=np.ones(count),
        heart=np.zeros(count),
        axial_rad=np.zeros((2, AXIAL_WAVES)),
    )


def draw_axial(rng: np.random.Generator, share: float) -> np.ndarray:
    """Amplitudes (2, AXIAL_WAVES) of an error of axial rotation [rad], over the usual one."""
    size = 1.0 / (1.0 + np.arange(AXIAL_WAVES))
    size /= np.linalg.norm(size)
    return share * np.deg2rad(AXIAL_DEG)[:, None] * size * rng.normal(size=(2, AXIAL_WAVES))


@dataclass(frozen=True, eq=False)
class Recording:
    """One recorded trial.

    time (S,) [s]; angles (S, 10) [rad]; EMG (S, C); force (S, 3) of the humerus on the glenoid in
    axes of the scapula [N].
    """

    time_s: np.ndarray
    angles_rad: np.ndarray
    emg: np.ndarray
    force_N: np.ndarray  # noqa: N815 - unit


def record(
    q: np.ndarray,
    excitation: np.ndarray,
    reaction: np.ndarray,
    measurement: Measurement,
    electrodes: np.ndarray,
) -> Recording:
    """Noise-free recording of a trace of one simulation.

    Parameters
    ----------
    q : (S, 13); excitation : (S, M); reaction : (S, 3) of the glenoid on the humeral head [N]
    measurement : errors; electrodes : (C, M), made by :func:`electrode_matrix`
    """
    keep = slice(round(SETTLE_S / TICK_S), None)
    pose = turned_frames(q[keep], measurement)
    envelope = np.maximum(_smooth(np.maximum(excitation @ electrodes.T, 0.0), ENVELOPE_HZ), 0.0)
    envelope = _delayed(envelope, measurement.delay_s)[keep]
    speed = np.linalg.norm(np.gradient(q[keep][:, 8:12], TICK_S, axis=0), axis=1)[:, None]
    envelope *= 1.0 + measurement.speed_gain * 2.0 * speed
    lifted = (1.0 - np.cos(_elevation(q[keep]))) / (1.0 - np.cos(ARTEFACT_FULL))
    envelope *= 1.0 + (measurement.slope - 1.0) * lifted[:, None]
    raw = measurement.emg_gain * envelope
    raw = raw + raw @ measurement.crosstalk.T
    beats = 0.5 * (1.0 + np.cos(2.0 * np.pi * HEART_HZ * TICK_S * np.arange(len(raw))))
    raw = raw + measurement.heart * beats[:, None]
    angles = np.unwrap(pose_to_trial(pose), axis=0)
    force = -_smooth(reaction, FORCE_HZ)[keep]
    return Recording(TICK_S * np.arange(len(pose)), angles, raw, force)


def _smooth(curves: np.ndarray, cutoff_hz: float) -> np.ndarray:
    """Curves (S, K), low-pass filtered without delay."""
    sections = butter(2, cutoff_hz, fs=1.0 / TICK_S, output="sos")
    return sosfiltfilt(sections, curves, axis=0)


def add_noise(recording: Recording, rng: np.random.Generator, scale: float) -> Recording:
    """Recording with the errors of one repeat, smooth in time; the girdle scatters by a scale."""
    count = len(recording.time_s)
    phase = np.linspace(0.0, 1.0, count)
    noise = np.deg2rad(ANGLE_NOISE_DEG) * smooth_noise(rng, phase, 10)
    noise[:, :6] = scale * np.deg2rad(ANGLE_DEG[:6]) * smooth_noise(rng, phase, 6)
    share = EMG_SHARE_NOISE * smooth_noise(rng, phase, recording.emg.shape[1])
    floor = EMG_FLOOR_NOISE * smooth_noise(rng, phase, recording.emg.shape[1])
    emg = np.maximum(recording.emg * (1.0 + share) + floor, 0.0)
    share = FORCE_SHARE_NOISE * smooth_noise(rng, phase, 3)
    force = recording.force_N * (1.0 + share) + FORCE_NOISE_N * smooth_noise(rng, phase, 3)
    return Recording(recording.time_s, recording.angles_rad + noise, emg, force)


def electrode_matrix(names: tuple[str, ...], groups: np.ndarray) -> np.ndarray:
    """What each electrode sees of each muscle element, (C, M), rows summing to one."""
    matrix = np.zeros((len(ELECTRODES), len(names)))
    for row, (group, elements) in enumerate(ELECTRODES.values()):
        members = groups == group
        matrix[row, members] = (1.0 - OWN_SHARE) / members.sum()
        for element in elements:
            matrix[row, names.index(element)] += OWN_SHARE / len(elements)
    return matrix


def turned_frames(pose: np.ndarray, measurement: Measurement) -> np.ndarray:
    """Poses (S, 13) as recorded with turned frames and bones that their skin does not follow."""
    sc, ac, gh = pose[:, :4], pose[:, 4:8], pose[:, 8:12]
    scapula = quaternion_multiply(sc, ac)
    humerus = quaternion_multiply(scapula, gh)
    lifted = _elevation(pose) - ARTEFACT_ONSET
    ramp = np.clip(lifted / (ARTEFACT_FULL - ARTEFACT_ONSET), 0.0, 1.5)
    ramp = ramp**2 * (3.0 - 2.0 * np.minimum(ramp, 1.0))
    moved = measurement.scapula_rad + ramp[:, None] * measurement.artefact_rad
    thorax = rotation_vector_to_quaternion(-measurement.thorax_rad)
    # Long axes: x of the clavicle, y of the humerus.
    axial = curves(np.linspace(0.0, 1.0, len(pose)), measurement.axial_rad)
    rolled, twisted = (
        rotation_vector_to_quaternion(axial[:, k, None] * np.eye(3)[k]) for k in range(2)
    )
    sc = quaternion_multiply(quaternion_multiply(thorax, sc), rolled)
    scapula = quaternion_multiply(
        quaternion_multiply(thorax, scapula), rotation_vector_to_quaternion(moved)
    )
    humerus = quaternion_multiply(
        quaternion_multiply(thorax, humerus),
        quaternion_multiply(twisted, rotation_vector_to_quaternion(measurement.humerus_rad)),
    )
    ac = quaternion_multiply(quaternion_conjugate(sc), scapula)
    gh = quaternion_multiply(quaternion_conjugate(scapula), humerus)
    return np.hstack([*(make_continuous(part) for part in (sc, ac, gh)), pose[:, 12:]])


def _elevation(pose: np.ndarray) -> np.ndarray:
    """Angle (S,) [rad] between the long axes of humerus and thorax."""
    humerus = quaternion_multiply(quaternion_multiply(pose[:, :4], pose[:, 4:8]), pose[:, 8:12])
    return np.arccos(np.clip(quaternion_to_matrix(humerus)[:, 1, 1], -1.0, 1.0))


def _delayed(envelope: np.ndarray, delay: float) -> np.ndarray:
    """Envelopes that lead the excitations by a delay [s]."""
    time = TICK_S * np.arange(len(envelope))
    return np.stack([np.interp(time + delay, time, column) for column in envelope.T], axis=1)
