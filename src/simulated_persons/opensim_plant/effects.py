"""What drawn effects do in OpenSim's model.

Labels and amplitudes are drawn as for the other plant; what acts on the body or its control is put
in here, in the terms of OpenSim's model. Effects on the record are those of the other plant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from scapulohumeral.model.muscle_paths.body_chain import CHAIN_POSITION
from simulated_persons.effects import (
    CUFF_SHARE,
    SEGMENTS,
    SEVERE_CAP,
    Injection,
    tilted,
)
from simulated_persons.opensim_plant.arm import OpenSimArm
from simulated_persons.opensim_plant.body import JOINTS
from simulated_persons.opensim_plant.body import SEGMENTS as BODY_SEGMENTS

# Changes of a body by the member and the amplitude of an effect.
Action = Callable[[OpenSimArm, str, float], Mapping[str, Any]]


def affected(arm: OpenSimArm, injection: Injection) -> OpenSimArm:
    """An arm with an effect; those on the record change what recording does."""
    action = ACTIONS.get(injection.family)
    if action is None:
        changed: OpenSimArm = injection.apply(arm)
        return changed
    member = injection.label.split("/")[-1]
    changes = action(arm, member, injection.amplitude)
    return replace(arm, body=replace(arm.body, **changes))


def _hand_load(arm: OpenSimArm, member: str, mass: float) -> Mapping[str, Any]:
    return {"load_kg": arm.body.load_kg + mass}


def _segment_mass(arm: OpenSimArm, member: str, factor: float) -> Mapping[str, Any]:
    chosen = np.isin(BODY_SEGMENTS, SEGMENTS[member])
    return {"mass_factor": arm.body.mass_factor * np.where(chosen, factor, 1.0)}


def _strength_loss(arm: OpenSimArm, member: str, left: float) -> Mapping[str, Any]:
    return {"force_factor": arm.body.force_factor * np.where(_of(arm, member), left, 1.0)}


def _fatigue(arm: OpenSimArm, member: str, left: float) -> Mapping[str, Any]:
    return {"end_force": arm.body.end_force * np.where(_of(arm, member), left, 1.0)}


def _fibre_length(arm: OpenSimArm, member: str, factor: float) -> Mapping[str, Any]:
    return {"fibre_factor": arm.body.fibre_factor * np.where(_of(arm, member), factor, 1.0)}


def _tendon_compliance(arm: OpenSimArm, member: str, strain: float) -> Mapping[str, Any]:
    return {"tendon_strain": np.where(_of(arm, member), strain, arm.body.tendon_strain)}


def _passive_gh(arm: OpenSimArm, member: str, scale: float) -> Mapping[str, Any]:
    return {"capsule_Nm": arm.body.capsule_Nm + scale}


def _joint_damping(arm: OpenSimArm, member: str, damping: float) -> Mapping[str, Any]:
    return {"joint_damping": arm.body.joint_damping + damping * (np.array(JOINTS) == member)}


def _glenoid_orientation(arm: OpenSimArm, member: str, version: float) -> Mapping[str, Any]:
    return {"glenoid_rad": arm.body.glenoid_rad + np.deg2rad([0.0, version])}


def _co_contraction(arm: OpenSimArm, member: str, floor: float) -> Mapping[str, Any]:
    return {"tonic": np.where(_crossing(arm, member), floor, arm.body.tonic)}


def _pain_inhibition(arm: OpenSimArm, member: str, factor: float) -> Mapping[str, Any]:
    chosen = _of(arm, member)
    cap = np.where(chosen, SEVERE_CAP, arm.body.cap)
    return {"cost": arm.body.cost * np.where(chosen, factor, 1.0), "cap": cap}


def _thorax_tilt(arm: OpenSimArm, member: str, forward_deg: float) -> Mapping[str, Any]:
    return {"gravity": tilted(arm.body.gravity, forward_deg)}


def _external_force(arm: OpenSimArm, member: str, up: float) -> Mapping[str, Any]:
    share = np.array(1.0 if member == "hand" else CUFF_SHARE)
    return {"arm_force_N": np.array([0.0, up, 0.0]), "arm_force_share": share}


def _friction(arm: OpenSimArm, member: str, torque: float) -> Mapping[str, Any]:
    return {"friction_Nm": arm.body.friction_Nm + torque}


ACTIONS: dict[str, Action] = {
    "hand_load": _hand_load,
    "segment_mass": _segment_mass,
    "strength_loss": _strength_loss,
    "fatigue": _fatigue,
    "fibre_length": _fibre_length,
    "tendon_compliance": _tendon_compliance,
    "passive_gh": _passive_gh,
    "joint_damping": _joint_damping,
    "glenoid_orientation": _glenoid_orientation,
    "co_contraction": _co_contraction,
    "pain_inhibition": _pain_inhibition,
    "thorax_tilt": _thorax_tilt,
    "external_force": _external_force,
    "friction": _friction,
}


def _of(arm: OpenSimArm, member: str) -> np.ndarray:
    """Muscles (M,) of a group, or all."""
    return (arm.anatomy.groups == member) | (member == "all")


def _crossing(arm: OpenSimArm, joint: str) -> np.ndarray:
    """Which muscles (M,) run from one side of a joint to the other."""
    place = JOINTS.index(joint)
    muscles = arm.anatomy.record.muscles
    spans = [[CHAIN_POSITION[p.body] for p in muscle.points] for muscle in muscles]
    return np.array([min(span) <= place < max(span) for span in spans])
