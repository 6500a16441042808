"""A small movement and made-up records for tests of the inference of a diagnosis."""

from dataclasses import replace

import numpy as np
from small_arm import (
    NAMES,
    STEP,
    small_forces,
    small_motion,
    small_muscles,
    small_objective,
    small_parameters,
)

from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.gap.effects.base import Setup
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.control_bias import no_drive
from scapulohumeral.gap.nominal.force_levers import ALONG
from scapulohumeral.gap.nominal.optimal_movement import EXCITATION_EFFORT, Movement
from scapulohumeral.gap.settings import (
    GapSettings,
    JointSpread,
    ModelSpread,
    NoisePrior,
    OneMovement,
    SessionSpread,
)
from scapulohumeral.model.rotations import trial_to_pose

NODES = 12
CHANNELS = ("EMG_a", "EMG_b")
SETUP = Setup(NAMES, CHANNELS, (CHANNELS,), False)
SETTINGS = GapSettings(
    nodes=NODES,
    phase_functions=4,
    iterations=200,
    alpha=0.05,
    short_list=3,
    refits=1,
    signature_error=0.2,
    prior_no_gap=0.2,
    prior_none=0.1,
    prior_moved=0.1,
    simulated=0.05,
    one_movement=OneMovement(0.25, 50.0),
    calibration="gap/calibration.json",
    null_bank="gap/no_bank.json",
    geometry={},
    session=SessionSpread(0.05, 0.5, 0.005, 0.5, 2.0, 0.3, 5.0),
    noise=NoisePrior(JointSpread(1.0, 1.0, 1.0, 1.0), [0.01, 0.005], 0.01, 0.0, 20.0, 3.0),
    model=ModelSpread(4.0, 0.08, 150.0, 0.5),
    weights={},
)


def small_body() -> Body:
    """The small arm; one group per muscle, and a muscle across every joint."""
    crossing = np.array([[1, 1, 1, 0], [0, 0, 1, 1], [0, 0, 0, 1]], dtype=bool)
    return Body(
        muscles=small_muscles(),
        parameters=unpack(small_parameters()),
        glenoid_rad=np.array([0.11, 0.23]),
        effort=np.full(3, EXCITATION_EFFORT),
        floor=np.zeros(3),
        cap=np.ones(3),
        seen=np.ones(3),
        groups=np.array(NAMES),
        crossing=crossing,
        tendon_load=np.linspace(0.1, 0.5, 3 * (NODES - 1)).reshape(-1, 3),
        gh_elevation_rad=np.linspace(0.3, 1.2, NODES - 1),
        gh_lift=np.tile([1.0, 0.0, 0.0], (NODES - 1, 1)),
        levers={
            point: np.random.default_rng(k).normal(0.0, 0.01, (NODES - 1, 13, 3))
            for k, point in enumerate(ALONG)
        },
        pull=np.random.default_rng(2).normal(0.0, 0.01, (NODES - 1, 13, 3)),
        external_Nm=np.zeros((NODES - 1, 10)),
        external_N=np.zeros((NODES - 1, 3)),
        stability=1.0,
        rates=1.0,
    )


def small_movement(equations) -> Movement:
    """The tracking problem of the small arm's elevation."""
    objective = small_objective(equations.name, NODES, 1.0)
    body, drive = small_body(), no_drive(NODES, 3)
    objective = replace(
        objective,
        weights=replace(objective.weights, emg=1.0),
        emg=drive.term(body.effort),
    )
    return Movement(small_forces(equations), body, objective, small_motion(NODES) + 0.05, drive)


def small_record(peak: float = 1.4) -> Observation:
    """A made-up record of an elevation to `peak` [rad] with two EMG channels."""
    angles = small_motion(NODES)
    angles[:, 7] = np.linspace(0.3, peak, NODES)
    phase = np.linspace(0.0, 1.0, NODES)
    emg = np.stack([0.1 + 0.3 * phase, 0.2 + 0.1 * np.sin(3.0 * phase)], axis=1)
    return Observation(STEP * (NODES - 1), trial_to_pose(angles), CHANNELS, emg, None)
