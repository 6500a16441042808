"""What another tempo asks of the muscles: how long a movement took is known on both sides.

Letters: N nodes, K channels.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.optimal_movement import Movement, movement
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import (
    KINEMATIC_CHANNELS,
    SensorSetup,
    difference,
    predicted,
)
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.model.rotations import Array
from scapulohumeral.ocp.solving.solver import Start

# ASSUME: repeats of a movement differ by more than this share of their duration, and what such a
# difference asks of the muscles is far below the scatter of EMG.
SAME_TEMPO = 0.02
MOTION = len(KINEMATIC_CHANNELS)


def tempo_change(
    move: Movement,
    point: Start,
    mean_record: Observation,
    compared_s: float,
    sensors: SensorSetup,
    model: ParticipantModel,
    settings: GapSettings,
) -> Array:
    """Change (N, K) of EMG and joint force if the movement takes another time; motion is kept.

    Parameters
    ----------
    move, point : nominal movement and its solution; mean_record : what it tracks
    compared_s : duration of the trials that are compared with it
    sensors : what is recorded; model, settings : of the nominal movement

    Raises
    ------
    SolveError                       the movement cannot be done in that time
    """
    slow = _record(move, point, mean_record.duration_s, sensors)
    ratio = mean_record.duration_s / compared_s
    change = np.zeros_like(difference(slow, slow))
    if change.shape[1] == MOTION or abs(np.log(ratio)) < SAME_TEMPO:
        return change
    other = movement(model, replace(mean_record, duration_s=compared_s), settings)
    other = other.driven(move.drive)
    x = move.trajectory(point)
    start = Start(other.set_up.layout.join(replace(x, u=ratio * x.u)))
    solved = other.solved_again(other.body, start, settings.iterations)
    change[:, MOTION:] = difference(_record(other, solved, compared_s, sensors), slow)[:, MOTION:]
    return change


def tempo_errors(change: Array, relative_error: float) -> Array:
    """Change (R, N, K) per standard deviation of what each of R channels of a change is off by."""
    channels = np.flatnonzero(change.any(axis=0))
    errors = np.zeros((len(channels), *change.shape))
    errors[np.arange(len(channels)), :, channels] = relative_error * change[:, channels].T
    return errors


def _record(move: Movement, point: Start, duration_s: float, sensors: SensorSetup) -> Observation:
    x = move.trajectory(point)
    return predicted(x, duration_s, sensors.channels, sensors.electrodes, sensors.contact)
