"""A person around the anatomy of a participant: the spread is what the diagnosis cannot know."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.quantities.joint_loading import glenoid_angles
from simulated_persons.arm import Anatomy, spread
from simulated_persons.observation import CHANNELS, Measurement, perfect_measurement
from simulated_persons.opensim_plant.body import JOINTS, SEGMENTS, Body


@dataclass(frozen=True, eq=False)
class OpenSimArm:
    """One person in one condition: body and control, and what recording does to the truth."""

    anatomy: Anatomy
    body: Body
    measurement: Measurement


def draw_opensim_person(anatomy: Anatomy, rng: np.random.Generator) -> OpenSimArm:
    """A person whose strength, fibres, masses, tendons and control differ from the model's.

    As far as those of the other plant: strength +-15 %, fibre lengths +-3 %, masses +-5 %, cost of
    using a muscle +-20 %, tendons of 3 to 5 % strain. Moment arms differ from the model's by what
    OpenSim's paths do.
    """
    record, names = anatomy.record, np.unique(anatomy.groups)
    group = np.searchsorted(names, anatomy.groups)
    generic, count = muscle_parameters(record), len(anatomy.names)

    def by_group(width: float) -> np.ndarray:
        return spread(rng, width, len(names))[group]

    body = Body(
        mass_factor=spread(rng, 0.05, len(SEGMENTS)),
        load_kg=np.array(0.0),
        gravity=np.array(record.gravity_mps2),
        force_factor=by_group(0.15),
        fibre_factor=by_group(0.03),
        end_force=np.ones(count),
        tendon_strain=np.full(count, rng.uniform(0.03, 0.05)),
        rise_s=rng.uniform(1.1, 1.6) * np.array(generic.activation_time),
        fall_s=rng.uniform(0.9, 1.2) * np.array(generic.deactivation_time),
        cost=by_group(0.2),
        tonic=np.zeros(count),
        cap=np.ones(count),
        glenoid_rad=np.array(glenoid_angles(record)),
        conoid_m=np.array([record.conoid.origin_m, record.conoid.insertion_m]),
        joint_damping=np.zeros(len(JOINTS)),
        capsule_Nm=np.array(0.0),
        friction_Nm=np.array(0.0),
        arm_force_N=np.zeros(3),
        arm_force_share=np.array(1.0),
    )
    return OpenSimArm(anatomy, body, perfect_measurement(spread(rng, 0.15, len(CHANNELS))))
