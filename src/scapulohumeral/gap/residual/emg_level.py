"""EMG that tells no level, brought to the one that the model predicts.

A fraction of another maximum than that of a contraction as hard as possible tells when a muscle
acts, and in which trial it acts more. What the model says that a cause adds is a share of the
maximal contraction: added to a recording that peaks at one, it would be too little.

Letters: N nodes, C channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.optimal_movement import movement, nominal_start
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.parallel import side_by_side
from scapulohumeral.gap.recording.observables import SensorSetup
from scapulohumeral.gap.residual.differences import Records
from scapulohumeral.gap.settings import GapSettings


def at_level_of_model(
    records: Records, model: ParticipantModel, settings: GapSettings, threads: int
) -> Records:
    """The same, each channel of EMG as high in the mean records as the model predicts them.

    One factor for each channel, of all tasks and trials of both sides, so that their ratios stay. A
    task whose movement cannot be solved has no say in it.

    Parameters
    ----------
    records : with EMG; threads : processes that solve movements side by side
    """
    jobs = [(one, model, records.sensors, settings) for one in records.mean_records.values()]
    found = side_by_side(_predicted_or_none, jobs, threads)
    pairs = [
        (one.emg, predicted)
        for one, predicted in zip(records.mean_records.values(), found, strict=True)
        if one.emg is not None and predicted is not None
    ]
    if not pairs:
        return records
    recorded, predicted = (_height(np.concatenate(part)) for part in zip(*pairs, strict=True))
    factors = predicted / recorded
    return replace(
        records,
        test=_scaled(records.test, factors),
        reference=_scaled(records.reference, factors),
        mean_records={task: _times(one, factors) for task, one in records.mean_records.items()},
    )


def _predicted_or_none(
    mean_record: Observation, model: ParticipantModel, sensors: SensorSetup, settings: GapSettings
) -> np.ndarray | None:
    """Predicted EMG (N, C) of the nominal movement; None if it cannot be solved."""
    move = movement(model, mean_record, settings)
    try:
        point = move.solved(move.body, nominal_start(move, settings), settings.iterations)
    except SolveError:
        return None
    return move.trajectory(point).e @ sensors.electrodes.T


def _height(emg: np.ndarray) -> np.ndarray:
    """Root mean square (C,) of EMG (N, C)."""
    return np.sqrt(np.mean(emg**2, axis=0))


def _scaled(
    side: Mapping[str, Sequence[Observation]], factors: np.ndarray
) -> dict[str, list[Observation]]:
    return {task: [_times(one, factors) for one in trials] for task, trials in side.items()}


def _times(one: Observation, factors: np.ndarray) -> Observation:
    return one if one.emg is None else replace(one, emg=one.emg * factors)
