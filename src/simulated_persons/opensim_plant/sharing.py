"""How a person shares out torques among muscles, frame by frame, and what joints feel.

Contact of the scapula with the thorax and tension of the conoid ligament are no part of OpenSim's
model: they are unknown forces that only push, and only pull, and cost hardly anything. The reaction
of the glenoid stays inside its rim, as solvers of muscle redundancy for OpenSim's shoulders have it
(Belli et al. 2023, PLoS ONE 18: e0295003). Torques that nothing gives are reserves.

Letters: F frames, M muscles, D = 8 directions around the glenoid.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from simulated_persons.opensim_plant.body import Body
from simulated_persons.opensim_plant.least_effort import Demand, least_effort
from simulated_persons.opensim_plant.mechanics import ACTIVATIONS, Mechanics

# Shear over compression that the rim holds: superior-inferior, anterior-posterior (Lippitt et al.
# 1993, J Shoulder Elbow Surg 2: 27-35: up to 0.6, least from front to back).
RIM = np.array([0.57, 0.32])
DIRECTIONS = 2.0 * np.pi * np.arange(8) / 8
TORQUE_WEIGHT = 2.0  # 1/(N m)^2: reserves of about a tenth of a newton metre
# Rows of the rim count forces in this many newtons, so that they are as large as torques.
RIM_N, RIM_WEIGHT = 50.0, 5.0
# Unknown forces are counted in kilonewtons, at most this many.
UNKNOWN_N, MOST_UNKNOWN = 1000.0, 10.0
SUPPORTS = 3
LINEARISATIONS = 2  # of muscle forces by activation, from those of the frame before


@dataclass(frozen=True, eq=False)
class Sharing:
    """What muscles and joints do at F frames.

    activation (F, M); support (F, 3) contact at two points and tension of the conoid [N]; reserve
    (F, 10) torque that nothing gives [N m]; reaction (F, 3) of the glenoid on the humeral head,
    scapula axes, without the inertia of the arm, which is small [N].
    """

    activation: np.ndarray
    support: np.ndarray
    reserve: np.ndarray
    reaction: np.ndarray


def share(mechanics: Mechanics, body: Body, left: np.ndarray) -> Sharing:
    """Share out the torques of F frames; `left` (F, M) of each active force has not tired."""
    tired = with_tired(mechanics, left)
    frames, muscles = left.shape
    activation, support = np.empty((frames, muscles)), np.empty((frames, SUPPORTS))
    now, multipliers = np.full(muscles, 0.2), np.zeros(10 + len(DIRECTIONS))
    for frame in range(frames):
        for _ in range(LINEARISATIONS):
            demand = _demand(tired.at(frame), body, now)
            answer, multipliers = least_effort(demand, multipliers)
            now = answer[:muscles]
        activation[frame] = now
        support[frame] = UNKNOWN_N * answer[muscles : muscles + SUPPORTS]
    return outcome(tired, activation, support)


def outcome(mechanics: Mechanics, activation: np.ndarray, support: np.ndarray) -> Sharing:
    """What is left over, and the reaction, of activations (F, M) and supports (F, 3) [N]."""
    force = tendon_force(mechanics.force, activation)
    given = np.einsum("fm,fmk->fk", force, mechanics.arms)
    given += np.einsum("fs,fsk->fk", support, mechanics.support)
    reaction = -np.einsum("fm,fmk->fk", force, mechanics.pull) - mechanics.burden
    return Sharing(activation, support, mechanics.torque - given, reaction)


def tendon_force(force: np.ndarray, activation: np.ndarray) -> np.ndarray:
    """Tendon forces (F, M) [N] at activations (F, M), between those known at `ACTIVATIONS`."""
    upper = np.clip(np.searchsorted(ACTIVATIONS, activation), 1, len(ACTIVATIONS) - 1)
    low, high = (np.take_along_axis(force, k[:, None], 1)[:, 0] for k in (upper - 1, upper))
    start, end = ACTIVATIONS[upper - 1], ACTIVATIONS[upper]
    return low + (high - low) * (activation - start) / (end - start)


def with_tired(mechanics: Mechanics, left: np.ndarray) -> Mechanics:
    """Mechanics with what is left (F, M) of the active forces; a resting muscle is as it was."""
    rest = mechanics.force[:, :1]
    return replace(mechanics, force=rest + left[:, None] * (mechanics.force - rest))


def _demand(mechanics: Mechanics, body: Body, activation: np.ndarray) -> Demand:
    """What one frame asks, with forces that are secants through rest and given activations (M,)."""
    force, arms, pull = mechanics.force[0], mechanics.arms[0], mechanics.pull[0]
    above = np.maximum(activation - ACTIVATIONS[0], 1e-3)
    unit = (tendon_force(force[None], (ACTIVATIONS[0] + above)[None])[0] - force[0]) / above
    passive = force[0] - ACTIVATIONS[0] * unit
    # Inside the rim: what the reaction is inside it by is some number above zero, a slack.
    rim = rim_rows(body) / RIM_N
    slack = -UNKNOWN_N / RIM_N * np.eye(len(rim))
    matrix = np.block(
        [
            [unit * arms.T, UNKNOWN_N * mechanics.support[0].T, np.zeros((10, len(rim)))],
            [-unit * (rim @ pull.T), np.zeros((len(rim), SUPPORTS)), slack],
        ]
    )
    head = passive @ pull + mechanics.burden[0]
    unknown = np.ones(SUPPORTS + len(rim))
    return Demand(
        matrix=matrix,
        target=np.concatenate([mechanics.torque[0] - passive @ arms, rim @ head]),
        weight=np.repeat([TORQUE_WEIGHT, RIM_WEIGHT], [10, len(rim)]),
        cost=body.cost,
        low=np.concatenate([np.maximum(body.tonic, ACTIVATIONS[0]), 0.0 * unknown]),
        high=np.concatenate([body.cap, MOST_UNKNOWN * unknown]),
    )


def rim_rows(body: Body) -> np.ndarray:
    """Rows (D, 3): what a reaction in scapula axes is inside the rim by, in each direction."""
    inclination, version = body.glenoid_rad
    axes = Rotation.from_euler("YZ", [version, -inclination]).as_matrix()
    normal, superior, posterior = axes.T
    around = np.stack([np.cos(DIRECTIONS) / RIM[0], np.sin(DIRECTIONS) / RIM[1]], axis=1)
    return normal - around[:, :1] * superior - around[:, 1:] * posterior
