"""One simulated person and one condition: body, control and measurement, before batching.

A person is drawn around the anatomy of a participant: the spread is what the diagnosis cannot know.

Letters: M muscles, P dynamics parameters, C EMG channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.dynamics.participant_parameters import dynamics_parameters, muscle_parameters
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.quantities.joint_loading import glenoid_angles
from simulated_persons.body import Body, ExtraTorques, no_extra_torques
from simulated_persons.muscles import Muscles
from simulated_persons.observation import Measurement, perfect_measurement
from simulated_persons.simulation import Control


@dataclass(frozen=True, eq=False)
class Anatomy:
    """A participant's model: the record and what is made from it."""

    record: ModelRecord
    thorax: Mapping[str, Any]
    forces: MuscleForces

    @property
    def groups(self) -> np.ndarray:
        """Muscle group of each element, (M,)."""
        return np.array(self.record.muscle_groups)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the muscle elements."""
        return self.record.muscle_names


@dataclass(frozen=True, eq=False)
class Arm:
    """One person in one condition.

    Attributes
    ----------
    anatomy : model of the participant
    parameters : dynamics parameters by block
    muscles, extra, control : for one simulation, leading axis 1
    measurement : what recording does to the truth
    """

    anatomy: Anatomy
    parameters: Mapping[str, np.ndarray]
    muscles: Muscles
    extra: ExtraTorques
    control: Control
    measurement: Measurement


def draw_person(anatomy: Anatomy, rng: np.random.Generator) -> Arm:
    """A person whose strength, moment arms, masses and control differ from the model's.

    Strength +-15 %, moment arms +-8 %, fibre lengths +-3 %, masses +-5 % (one standard deviation
    of half of that each, cut at it), slower activation, tendons of 3 to 5 % strain, and a softer,
    wider contact of the scapula.
    """
    parameters = unpack(dynamics_parameters(anatomy.record, anatomy.thorax, 0.0))
    for segment in ("clavicle", "scapula", "humerus", "forearm"):
        factor = spread(rng, 0.05, 1)
        for block in ("mass", "inertia"):
            parameters[f"{block}_{segment}"] = factor * parameters[f"{block}_{segment}"]
    parameters["contact_eps"] = 3.0 * parameters["contact_eps"]
    parameters["contact_stiffness"] = spread(rng, 0.2, 1) * parameters["contact_stiffness"]
    generic, count = muscle_parameters(anatomy.record), len(anatomy.names)
    group = np.unique(anatomy.groups, return_inverse=True)[1]
    number = group.max() + 1

    def by_group(width: float) -> np.ndarray:
        return spread(rng, width, number)[group][None]

    muscles = Muscles(
        max_force=by_group(0.15) * generic.max_isometric_force,
        optimal_length=by_group(0.03) * generic.optimal_fibre_length,
        slack_length=np.array(generic.tendon_slack_length)[None],
        tendon_strain=np.full((1, count), rng.uniform(0.03, 0.05)),
        rise_s=rng.uniform(1.1, 1.6) * generic.activation_time[None],
        fall_s=rng.uniform(0.9, 1.2) * generic.deactivation_time[None],
        arm_scale=by_group(0.08) * np.ones((1, count)),
        end_force=np.ones((1, count)),
    )
    control = Control(
        cost=by_group(0.2) * np.ones((1, count)),
        tonic=np.zeros((1, count)),
        cap=np.ones((1, count)),
        girdle_weight=np.array([0.008 * rng.uniform(0.7, 1.4)]),
        stability_weight=np.array([rng.uniform(0.3, 0.8)]),
        glenoid_rad=_glenoid(anatomy)[None],
    )
    measurement = perfect_measurement(spread(rng, 0.15, 8))
    return Arm(anatomy, parameters, muscles, no_extra_torques(1), control, measurement)


def batch(arms: Sequence[Arm]) -> tuple[Body, Control]:
    """Bodies and controls of several arms of one anatomy, stacked."""

    def stack(parts):
        names = vars(parts[0])
        return replace(
            parts[0], **{k: np.concatenate([getattr(p, k) for p in parts]) for k in names}
        )

    body = Body(
        forces=arms[0].anatomy.forces,
        parameters=np.array([pack(arm.parameters) for arm in arms]),
        muscles=stack([arm.muscles for arm in arms]),
        extra=stack([arm.extra for arm in arms]),
    )
    return body, stack([arm.control for arm in arms])


def _glenoid(anatomy: Anatomy) -> np.ndarray:
    return np.array(glenoid_angles(anatomy.record))


def spread(rng: np.random.Generator, width: float, size: int) -> np.ndarray:
    """Factors around one: normal with half the width as deviation, cut at the width."""
    return 1.0 + np.clip(rng.normal(0.0, 0.5 * width, size), -width, width)
