"""What is compared: joint rotations, EMG and joint force at equal steps of phase.

Kinematic channels are rotation vectors Log(R R_anchor^T) in proximal frames [deg], never
differences of Euler angles: the outer glenohumeral angles are undefined when the arm hangs.

Letters: T recorded frames, N nodes of phase, C EMG channels, K channels, M muscle elements,
B phase functions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.fft import dct
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.case import GapTrial
from scapulohumeral.model.girdle_range import arm_elevation
from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    trial_to_pose,
)
from scapulohumeral.ocp.objective import Trajectory

KINEMATIC_CHANNELS = (
    *(f"{joint}_r{axis}" for joint in ("SC", "AC", "GH") for axis in "xyz"),
    "EL_rx",
)


# Of envelopes, unless the participant's are fractions of other maxima.
EMG_UNIT = "fraction_of_mvc"
# Points of a movement between two steps of phase, to see what these miss.
FINE = 10
CONTACT_CHANNELS = ("GHF_x", "GHF_y", "GHF_z")
JOINT_QUATERNIONS = (slice(0, 4), slice(4, 8), slice(8, 12))


def channel_names(emg: Sequence[str], contact: bool) -> tuple[str, ...]:
    """Names of the K channels in their order."""
    return (*KINEMATIC_CHANNELS, *emg, *(CONTACT_CHANNELS if contact else ()))


def channel_kind(channel: str) -> str:
    """Kind of observable: "kinematics", "emg" or "contact_force"."""
    if channel in KINEMATIC_CHANNELS:
        return "kinematics"
    return "contact_force" if channel in CONTACT_CHANNELS else "emg"


def channel_unit(channel: str) -> str:
    """Unit in which a channel is compared."""
    units = {"kinematics": "deg", "emg": EMG_UNIT, "contact_force": "N"}
    return units[channel_kind(channel)]


def recorded(trial: GapTrial, channels: tuple[str, ...], contact: bool, nodes: int) -> Observation:
    """A recorded trial within its movement.

    EMG and force are averaged over the phase that a node stands for, whatever their rate.
    """
    times, angles = trial.moved(nodes)
    emg = force = None
    if channels and trial.emg is not None:
        emg = _averaged(trial.emg.time_s, trial.emg.of(channels), times)
    if contact and trial.contact is not None:
        force = _averaged(trial.contact.time_s, trial.contact.force_N, times)
    duration = trial.window_s[1] - trial.window_s[0]
    return Observation(duration, trial_to_pose(angles), channels, emg, force)


def _averaged(time_s: Array, values: Array, times: Array) -> Array:
    """Means of curves (T, C) over one step about each of the times (N,), (N, C).

    Where curves start late or end early, as far as clocks may differ, their end value is held.
    """
    half = 0.5 * (times[1] - times[0])
    area = cumulative_trapezoid(values, time_s, axis=0, initial=0)
    low, high = (np.clip(times + sign * half, time_s[0], time_s[-1]) for sign in (-1.0, 1.0))
    held = high <= low
    width = np.where(held, 1.0, high - low)
    curves = [
        np.where(
            held,
            np.interp(times, time_s, curve),
            (np.interp(high, time_s, column) - np.interp(low, time_s, column)) / width,
        )
        for curve, column in zip(values.T, area.T, strict=True)
    ]
    return np.stack(curves, axis=1)


def missed_deg(trial: GapTrial, nodes: int) -> float:
    """How far straight lines between equal steps of phase miss an elevation, RMS [deg]."""
    fine, coarse = (trial.moved(count) for count in (FINE * nodes, nodes))
    raised = np.rad2deg(arm_elevation(fine[1]))
    line = np.interp(fine[0], coarse[0], np.rad2deg(arm_elevation(coarse[1])))
    return float(np.sqrt(np.mean((raised - line) ** 2)))


def predicted(
    x: Trajectory, duration_s: float, channels: tuple[str, ...], electrodes: Array, contact: bool
) -> Observation:
    """What would be recorded of a solution; electrodes (C, M) average excitations."""
    emg = x.e @ electrodes.T if channels else None
    # The unknown reaction is the force of the glenoid on the humerus.
    force = -x.reaction if contact else None
    return Observation(duration_s, x.q, channels, emg, force)


def predicted_changes(
    x: Trajectory,
    steps: Sequence[Trajectory],
    channels: tuple[str, ...],
    electrodes: Array,
    contact: bool,
) -> Array:
    """Derivatives (P, N, K) of the channels of what :func:`predicted` records, along steps (P)."""
    moved = np.stack([step.q for step in steps])
    parts = []
    for part in JOINT_QUATERNIONS:
        # A rotation vector is twice the vector part of dq q*, for a q of length one.
        turn = quaternion_multiply(moved[..., part], quaternion_conjugate(x.q[:, part]))
        square = np.sum(x.q[:, part] ** 2, axis=1, keepdims=True)
        parts.append(np.rad2deg(2.0 * turn[..., 1:] / square))
    parts.append(np.rad2deg(moved[..., 12:]))
    if channels:
        parts.append(np.stack([step.e for step in steps]) @ electrodes.T)
    if contact:
        parts.append(-np.stack([step.reaction for step in steps]))
    return np.concatenate(parts, axis=2)


def electrode_matrix(emg_groups: Sequence[Sequence[str]], groups: np.ndarray) -> Array:
    """Means over the elements of each channel's muscle groups, (C, M), of groups (M,)."""
    members = np.array([np.isin(groups, list(names)) for names in emg_groups], dtype=float)
    members = members.reshape(len(emg_groups), len(groups))
    return members / np.maximum(members.sum(axis=1, keepdims=True), 1.0)


def mean_pose(poses: Sequence[Array], weights: Sequence[float]) -> Array:
    """Weighted mean (N, 13) of near poses; weights add up to one.

    Rotations by the mean quaternion, whatever the signs (Markley et al. 2007, small spread).
    """
    stacked = np.stack(poses)
    for part in JOINT_QUATERNIONS:
        agreement = np.sum(stacked[..., part] * stacked[0][:, part], axis=-1, keepdims=True)
        stacked[..., part] *= np.where(agreement < 0.0, -1.0, 1.0)
    pose = np.tensordot(weights, stacked, 1)
    for part in JOINT_QUATERNIONS:
        pose[:, part] /= np.linalg.norm(pose[:, part], axis=1, keepdims=True)
    return pose


def mean(observed: Sequence[Observation]) -> Observation:
    """Mean of repeats."""
    pose = mean_pose([one.pose for one in observed], [1.0 / len(observed)] * len(observed))
    emg = [one.emg for one in observed if one.emg is not None]
    force = [one.contact_N for one in observed if one.contact_N is not None]
    return Observation(
        float(np.mean([one.duration_s for one in observed])),
        pose,
        observed[0].channels,
        np.mean(emg, axis=0) if emg else None,
        np.mean(force, axis=0) if force else None,
    )


def carried(observed: Observation, partner: Observation, onto: Observation) -> Observation:
    """A record that differs from `onto` as a record differs from its partner."""
    pose = onto.pose + observed.pose - partner.pose
    for part in JOINT_QUATERNIONS:
        turn = quaternion_multiply(
            observed.pose[:, part], quaternion_conjugate(partner.pose[:, part])
        )
        pose[:, part] = quaternion_multiply(turn, onto.pose[:, part])
    emg = force = None
    if onto.emg is not None and observed.emg is not None and partner.emg is not None:
        emg = onto.emg + observed.emg - partner.emg
    if (
        onto.contact_N is not None
        and observed.contact_N is not None
        and partner.contact_N is not None
    ):
        force = onto.contact_N + observed.contact_N - partner.contact_N
    return replace(onto, pose=pose, emg=emg, contact_N=force)


def difference(observed: Observation, mean_record: Observation) -> Array:
    """Channels (N, K) of a record relative to another: deg, fraction of MVC, N."""
    parts = []
    for part in JOINT_QUATERNIONS:
        turn = quaternion_multiply(
            observed.pose[:, part], quaternion_conjugate(mean_record.pose[:, part])
        )
        parts.append(np.rad2deg(Rotation.from_quat(turn, scalar_first=True).as_rotvec()))
    parts.append(np.rad2deg(observed.pose[:, 12:] - mean_record.pose[:, 12:]))
    if observed.emg is not None and mean_record.emg is not None:
        parts.append(observed.emg - mean_record.emg)
    if observed.contact_N is not None and mean_record.contact_N is not None:
        parts.append(observed.contact_N - mean_record.contact_N)
    return np.hstack(parts)


def without(observed: Observation, change: Array) -> Observation:
    """A record whose EMG and joint force are less by a change (N, K) of all channels."""
    first = len(KINEMATIC_CHANNELS)
    emg = force = None
    if observed.emg is not None:
        beside = first + observed.emg.shape[1]
        emg, first = observed.emg - change[:, first:beside], beside
    if observed.contact_N is not None:
        force = observed.contact_N - change[:, first:]
    return replace(observed, emg=emg, contact_N=force)


def channel_rates(observed: Observation) -> Array:
    """Rates (N, K) of the channels per unit of phase, which runs from 0 to 1."""
    motion = replace(observed, emg=None, contact_N=None)
    first, last = (
        replace(motion, pose=observed.pose[part]) for part in (slice(-1), slice(1, None))
    )
    steps = difference(last, first)
    # Mean of the steps before and after a node; at both ends there is one only.
    padded = np.concatenate([steps[:1], steps, steps[-1:]])
    rates = 0.5 * (padded[1:] + padded[:-1])
    others = [
        np.gradient(curves, axis=0)
        for curves in (observed.emg, observed.contact_N)
        if curves is not None
    ]
    return (len(observed.pose) - 1) * np.hstack([rates, *others])


def phase_functions(nodes: int, count: int) -> Array:
    """Orthonormal smooth functions of phase (N, B): the first cosines."""
    return dct(np.eye(nodes), norm="ortho", axis=0)[:count].T


@dataclass(frozen=True, eq=False)
class SensorSetup:
    """What is recorded of solutions.

    Attributes
    ----------
    channels : EMG channels; electrodes : (C, M) elements that they average
    contact : whether the joint force is recorded
    unmeasured : segments that a rule stands for, and standard deviations of their turns [deg]
    unmeasured_angles : angles that nobody measured, and their standard deviations [deg], see
        `marks.unmeasured_angles`
    """

    channels: tuple[str, ...]
    electrodes: Array
    contact: bool
    unmeasured: Mapping[str, float] = field(default_factory=dict)
    unmeasured_angles: Mapping[str, float] = field(default_factory=dict)
