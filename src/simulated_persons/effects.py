"""Effects injected into plants, in their own terms; labels and units are those of the answers.

Each effect changes one arm. Its name follows the contract of ``result.json``; how it works is not
shared with the diagnosis: a tear removes muscle lines, a capsule is an exponential torque, a
glenoid acts through the wish for stability.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scapulohumeral.dynamics.muscle_forces import MuscleForces
from simulated_persons.arm import Arm
from simulated_persons.observation import CHANNELS, NEIGHBOURS

TORN_LINE = 0.03  # force left in a torn line: a line without any makes no path
HAND_RADIUS_M = 0.04
SEVERE_CAP = 0.5


@dataclass(frozen=True)
class Injection:
    """An effect with its amplitude.

    Attributes
    ----------
    label : ``side/family[/member]``, or ``unknown/...`` for one outside the library
    parameter : name of the primary parameter in answers; None where plant and library measure the
        effect in different terms, so that amplitudes cannot be compared
    amplitude : in the unit of that parameter
    apply : changes an arm; where it changes the record only, one of any plant
    """

    label: str
    parameter: str | None
    amplitude: float
    apply: Callable[[Any], Any]

    @property
    def family(self) -> str:
        """Name of the function that draws it."""
        return self.label.split("/")[2 if self.label.startswith("unknown") else 1]


TORN_GROUPS = ("infra", "delt_scap", "serr_ant", "trap_scap")
FIBRE_GROUPS = ("delt_scap", "serr_ant", "trap_scap", "trap_clav")
PAINFUL_GROUPS = ("infra", "delt_scap", "serr_ant", "trap_scap")
SEGMENTS = {"upper_arm": ("humerus",), "forearm": ("forearm",), "arm": ("humerus", "forearm")}
TIRED_GROUPS = ("delt_scap", "serr_ant", "trap_scap", "all")
# Where cuffs of aids sit, of the way from the elbow to the hand.
CUFF_SHARE = 0.55
JOINT_ROWS = {"SC": slice(0, 3), "AC": slice(3, 6), "GH": slice(6, 9), "EL": slice(9, 10)}


def hand_load(rng: np.random.Generator) -> Injection:
    """A gripped weight: a rigid body with its own inertia, a little beyond the hand's centre."""
    mass = float(rng.uniform(0.4, 3.0))

    def apply(arm: Arm) -> Arm:
        p = dict(arm.parameters)
        inertia = 0.4 * mass * HAND_RADIUS_M**2
        p["inertia_forearm"] = p["inertia_forearm"] + inertia * np.array([1, 1, 1, 0, 0, 0])
        p["mass_load"], p["com_load"] = np.array([mass]), 1.03 * p["com_load"]
        return replace(arm, parameters=p)

    return Injection("body/hand_load", "mass_kg", mass, apply)


def segment_mass(rng: np.random.Generator) -> Injection:
    """Heavier or lighter segments: their girth changes, so inertia grows faster than mass."""
    member = str(rng.choice(list(SEGMENTS)))
    factor = float(_side(rng, (0.62, 0.72), (1.28, 1.4)))

    def apply(arm: Arm) -> Arm:
        p = dict(arm.parameters)
        for segment in SEGMENTS[member]:
            p[f"mass_{segment}"] = factor * p[f"mass_{segment}"]
            p[f"inertia_{segment}"] = factor**1.5 * p[f"inertia_{segment}"]
        return replace(arm, parameters=p)

    return Injection(f"body/segment_mass/{member}", "mass_factor", factor, apply)


def strength_loss(rng: np.random.Generator, members: tuple[str, ...] = TORN_GROUPS) -> Injection:
    """A tear: some lines of a group hardly pull any more; the amplitude is the force left.

    Lines of a group differ in strength: those are torn that make up a share of its force.
    """
    group = str(rng.choice(members))
    share, order = rng.uniform(0.4, 0.9), rng.random(200)

    def apply(arm: Arm) -> Arm:
        force = _torn(arm.muscles.max_force, arm.anatomy.groups == group, share, order)
        return replace(arm, muscles=replace(arm.muscles, max_force=force))

    left = 1.0 - share * (1.0 - TORN_LINE)
    return Injection(f"body/strength_loss/{group}", "f0_factor", float(left), apply)


def fatigue(rng: np.random.Generator) -> Injection:
    """Muscles that tire within each trial, soon at first and then more slowly."""
    group = str(rng.choice(TIRED_GROUPS))
    left = float(rng.uniform(0.45, 0.8))

    def apply(arm: Arm) -> Arm:
        chosen = (arm.anatomy.groups == group) | (group == "all")
        end = arm.muscles.end_force * np.where(chosen, left, 1.0)
        return replace(arm, muscles=replace(arm.muscles, end_force=end))

    return Injection(f"body/fatigue/{group}", "end_force_factor", left, apply)


def external_force(rng: np.random.Generator) -> Injection:
    """An aid that lifts the arm, or a cable that pulls it, not quite upright."""
    point = str(rng.choice(("hand", "forearm")))
    up = float(_side(rng, (-20.0, -6.0), (6.0, 25.0)))
    aside = rng.uniform(-0.2, 0.2, size=2) * abs(up)

    def apply(arm: Arm) -> Arm:
        share = 1.0 if point == "hand" else CUFF_SHARE
        extra = replace(
            arm.extra,
            arm_force_N=np.array([[aside[0], up, aside[1]]]),
            arm_force_share=np.array([share]),
        )
        return replace(arm, extra=extra)

    return Injection(f"input/external_force/{point}", "up_N", up, apply)


def fibre_length(rng: np.random.Generator) -> Injection:
    """Longer or shorter fibres of a group, with the tendon unchanged."""
    group = str(rng.choice(FIBRE_GROUPS))
    factor = float(_side(rng, (0.8, 0.87), (1.13, 1.2)))

    def apply(arm: Arm) -> Arm:
        optimal = arm.muscles.optimal_length * np.where(arm.anatomy.groups == group, factor, 1.0)
        return replace(arm, muscles=replace(arm.muscles, optimal_length=optimal))

    return Injection(f"body/fibre_length/{group}", "fibre_factor", factor, apply)


def tendon_compliance(rng: np.random.Generator) -> Injection:
    """Softer tendons, of one group or of all; plants have elastic tendons anyway."""
    group = str(rng.choice(("all", "delt_scap", "infra")))
    strain = float(rng.uniform(0.09, 0.14))

    def apply(arm: Arm) -> Arm:
        chosen = (arm.anatomy.groups == group) | (group == "all")
        soft = np.where(chosen, strain, arm.muscles.tendon_strain)
        return replace(arm, muscles=replace(arm.muscles, tendon_strain=soft))

    return Injection(f"body/tendon_compliance/{group}", None, strain, apply)


def passive_gh(rng: np.random.Generator) -> Injection:
    """A stiff capsule: exponential torque beyond an elevation of the humerus in the glenoid."""
    scale, onset = float(rng.uniform(1.5, 6.0)), np.deg2rad(rng.uniform(35, 55))

    def apply(arm: Arm) -> Arm:
        extra = replace(
            arm.extra, capsule_Nm=np.array([scale]), capsule_onset_rad=np.array([onset])
        )
        return replace(arm, extra=extra)

    return Injection("body/passive_gh", None, scale, apply)


def joint_damping(rng: np.random.Generator) -> Injection:
    """A viscous joint."""
    joint = str(rng.choice(("SC", "AC", "GH", "EL")))
    damping = float(rng.uniform(1.5, 3.0))

    def apply(arm: Arm) -> Arm:
        p = dict(arm.parameters)
        p["joint_damping"] = p["joint_damping"] + damping * (np.array(list(JOINT_ROWS)) == joint)
        return replace(arm, parameters=p)

    return Injection(f"body/joint_damping/{joint}", "damping_Nms_rad", damping, apply)


def thorax_surface(rng: np.random.Generator) -> Injection:
    """A wider or narrower thorax under the scapula."""
    factor = float(_side(rng, (0.90, 0.96), (1.02, 1.05)))

    def apply(arm: Arm) -> Arm:
        p = dict(arm.parameters)
        p["thorax_radii"] = factor * p["thorax_radii"]
        return replace(arm, parameters=p)

    return Injection("body/thorax_surface", "radius_factor", factor, apply)


def glenoid_orientation(rng: np.random.Generator) -> Injection:
    """A glenoid turned forward or backward; control keeps the reaction inside it."""
    version = float(_side(rng, (-15, -9), (9, 15)))

    def apply(arm: Arm) -> Arm:
        angles = arm.control.glenoid_rad + np.deg2rad([0.0, version])
        return replace(arm, control=replace(arm.control, glenoid_rad=angles))

    return Injection("body/glenoid_orientation", "version_deg", version, apply)


def co_contraction(rng: np.random.Generator) -> Injection:
    """Muscles that cross a joint and are never less active than a floor."""
    joint = str(rng.choice(("SC", "AC", "GH", "EL")))
    floor = float(rng.uniform(0.05, 0.15))

    def apply(arm: Arm) -> Arm:
        crossing = _crossing(arm.anatomy.forces, joint)
        tonic = np.where(crossing, floor, arm.control.tonic)
        return replace(arm, control=replace(arm.control, tonic=tonic))

    return Injection(f"control/co_contraction/{joint}", "tonic_floor", floor, apply)


def pain_inhibition(rng: np.random.Generator) -> Injection:
    """A group that costs more to use, and is never used fully."""
    group, factor = str(rng.choice(PAINFUL_GROUPS)), float(rng.uniform(4.0, 12.0))

    def apply(arm: Arm) -> Arm:
        chosen = arm.anatomy.groups == group
        cost = np.where(chosen, factor, 1.0) * arm.control.cost
        cap = np.where(chosen, SEVERE_CAP, arm.control.cap)
        return replace(arm, control=replace(arm.control, cost=cost, cap=cap))

    return Injection(f"control/pain_inhibition/{group}", None, factor, apply)


def thorax_tilt(rng: np.random.Generator) -> Injection:
    """A trunk that leans forward: gravity turns in its frame."""
    angle = float(_side(rng, (-20, -10), (10, 20)))

    def apply(arm: Arm) -> Arm:
        p = dict(arm.parameters)
        p["gravity"] = tilted(p["gravity"], angle)
        return replace(arm, parameters=p)

    return Injection("input/thorax_tilt", "forward_deg", angle, apply)


def frame_misalignment(rng: np.random.Generator) -> Injection:
    """A segment frame that was digitised askew, about one of its axes."""
    segment, axis = str(rng.choice(("thorax", "scapula", "humerus"))), int(rng.integers(3))
    angle = float(_side(rng, (-14, -4), (4, 14)))

    def apply(arm: Arm) -> Arm:
        turn = np.deg2rad(angle) * np.eye(3)[axis]
        return replace(arm, measurement=replace(arm.measurement, **{f"{segment}_rad": turn}))

    name = f"r{'xyz'[axis]}_deg"
    return Injection(f"input/frame_misalignment/{segment}", name, angle, apply)


def scapula_sta(rng: np.random.Generator) -> Injection:
    """Skin that slides over the lifted scapula."""
    angle = float(_side(rng, (-20, -6), (6, 20)))

    def apply(arm: Arm) -> Arm:
        turn = np.deg2rad([0.0, 0.0, angle])
        return replace(arm, measurement=replace(arm.measurement, artefact_rad=turn))

    return Injection("measurement/scapula_sta", "upward_deg", angle, apply)


def emg_gain(rng: np.random.Generator) -> Injection:
    """An electrode, or all of them, normalised by a wrong maximum."""
    channel = str(rng.choice((*CHANNELS, "all")))
    factor = float(_side(rng, (0.4, 0.7), (1.4, 2.5)))

    def apply(arm: Arm) -> Arm:
        chosen = np.array([channel in (name, "all") for name in CHANNELS])
        gain = arm.measurement.emg_gain * np.where(chosen, factor, 1.0)
        return replace(arm, measurement=replace(arm.measurement, emg_gain=gain))

    return Injection(f"measurement/emg_gain/{channel}", "gain_factor", factor, apply)


def electrode_shift(rng: np.random.Generator) -> Injection:
    """Skin that slides over a muscle with its electrode as the arm is lifted."""
    channel = str(rng.choice(CHANNELS))
    factor = float(_side(rng, (0.4, 0.65), (1.5, 2.5)))

    def apply(arm: Arm) -> Arm:
        slope = np.where(np.array(CHANNELS) == channel, factor, arm.measurement.slope)
        return replace(arm, measurement=replace(arm.measurement, slope=slope))

    return Injection(f"measurement/electrode_shift/{channel}", "slope_factor", factor, apply)


def movement_strategy(rng: np.random.Generator) -> Injection:
    """Nothing but the movement done otherwise; how, follows from the seed of the case."""
    return Injection("control/movement_strategy", None, 1.0, lambda arm: arm)


def emg_crosstalk(rng: np.random.Generator) -> Injection:
    """An electrode that also hears a declared neighbour."""
    pair = NEIGHBOURS[rng.integers(len(NEIGHBOURS))]
    donor, receiver = pair if rng.random() < 0.5 else pair[::-1]
    return _crosstalk(f"measurement/emg_crosstalk/{donor}>{receiver}", donor, receiver, rng)


def emd(rng: np.random.Generator) -> Injection:
    """Envelopes that lead the muscles by longer than usual."""
    delay = float(rng.uniform(60, 118))

    def apply(arm: Arm) -> Arm:
        return replace(arm, measurement=replace(arm.measurement, delay_s=delay / 1000.0))

    return Injection("measurement/emd", "delay_ms", delay, apply)


def friction(rng: np.random.Generator) -> Injection:
    """Outside the library, far: Coulomb friction of the glenohumeral joint."""
    torque = float(rng.uniform(1.5, 4.0))

    def apply(arm: Arm) -> Arm:
        return replace(arm, extra=replace(arm.extra, friction_Nm=np.array([torque])))

    return Injection("unknown/far/friction", None, torque, apply)


def splint(rng: np.random.Generator) -> Injection:
    """Outside the library, far: a spring across the elbow."""
    stiffness = float(rng.uniform(6.0, 12.0))

    def apply(arm: Arm) -> Arm:
        extra = replace(
            arm.extra, elbow_spring_Nm_rad=np.array([stiffness]), elbow_rest_rad=np.array([1.2])
        )
        return replace(arm, extra=extra)

    return Injection("unknown/far/splint", None, stiffness, apply)


def heart(rng: np.random.Generator) -> Injection:
    """Outside the library, far: heart beats in the channels of the chest and the neck."""
    height = float(rng.uniform(0.1, 0.3))

    def apply(arm: Arm) -> Arm:
        near = np.isin(CHANNELS, ("EMG_serr", "EMG_delt_ant", "EMG_trap_clav"))
        beats = np.where(near, height, arm.measurement.heart)
        return replace(arm, measurement=replace(arm.measurement, heart=beats))

    return Injection("unknown/far/heart", None, height, apply)


def uneven_tear(rng: np.random.Generator) -> Injection:
    """Outside the library, near: lines of several groups torn, each to another share."""
    shares, order = rng.uniform(0.2, 0.9, size=3), rng.random(200)

    def apply(arm: Arm) -> Arm:
        force = arm.muscles.max_force
        for group, share in zip(("infra", "supra", "delt_scap"), shares, strict=True):
            force = _torn(force, arm.anatomy.groups == group, share, order)
        return replace(arm, muscles=replace(arm.muscles, max_force=force))

    return Injection("unknown/near/uneven_tear", None, float(shares.mean()), apply)


def distant_crosstalk(rng: np.random.Generator) -> Injection:
    """Outside the library, near: cross-talk between channels that are not declared neighbours."""
    return _crosstalk("unknown/near/distant_crosstalk", "EMG_serr", "EMG_delt_ant", rng)


def speed_gain(rng: np.random.Generator) -> Injection:
    """Outside the library, near: envelopes that grow with the speed of the arm."""
    growth = float(rng.uniform(0.5, 1.2))

    def apply(arm: Arm) -> Arm:
        return replace(arm, measurement=replace(arm.measurement, speed_gain=growth))

    return Injection("unknown/near/speed_gain", None, growth, apply)


LIBRARY_LIKE = (
    hand_load, segment_mass, strength_loss, fatigue, fibre_length, tendon_compliance, passive_gh,
    joint_damping, thorax_surface, glenoid_orientation, co_contraction, pain_inhibition,
    thorax_tilt, external_force, frame_misalignment, scapula_sta, emg_gain, electrode_shift,
    emg_crosstalk, emd,
)  # fmt: skip
UNKNOWN = (friction, splint, heart, uneven_tear, distant_crosstalk, speed_gain)


def tilted(gravity: np.ndarray, forward_deg: float) -> np.ndarray:
    """Gravity in the frame of a thorax (x right, y up, z back) that leans forward."""
    angle = np.deg2rad(forward_deg)
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]]) @ gravity


def _crosstalk(label: str, donor: str, receiver: str, rng: np.random.Generator) -> Injection:
    fraction = float(rng.uniform(0.2, 0.5))

    def apply(arm: Arm) -> Arm:
        mixing = arm.measurement.crosstalk.copy()
        mixing[CHANNELS.index(receiver), CHANNELS.index(donor)] = fraction
        return replace(arm, measurement=replace(arm.measurement, crosstalk=mixing))

    known = label.startswith("measurement")
    return Injection(label, "fraction" if known else None, fraction, apply)


def _torn(force: np.ndarray, members: np.ndarray, share: float, order: np.ndarray) -> np.ndarray:
    """Forces (1, M) with lines of a group torn that make up a share of its force.

    Lines tear one after the other, the last one in part.
    """
    left = force.copy()
    index = np.flatnonzero(members)
    torn = share * force[0, index].sum()
    for line in index[np.argsort(order[: len(index)])]:
        lost = min(torn, force[0, line])
        left[0, line] -= lost * (1.0 - TORN_LINE)
        torn -= lost
    return left


def _crossing(forces: MuscleForces, joint: str) -> np.ndarray:
    """Which muscles have a moment arm about a joint, (M,)."""
    pose = np.zeros((1, 13))
    pose[:, [0, 4, 8]] = 1.0
    pose[:, 12] = 0.5
    return np.any(np.abs(forces.gradients(pose)[0, :, JOINT_ROWS[joint]]) > 1e-6, axis=1)


def _side(rng: np.random.Generator, low: tuple[float, float], high: tuple[float, float]) -> float:
    return rng.uniform(*(low if rng.random() < 0.5 else high))
