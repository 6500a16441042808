"""Whether any activations at all could have done what was recorded, whatever their cost.

Where none could, no other control explains it: body, input or measurement differ from the model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from scapulohumeral.gap.recording.observables import SensorSetup
from scapulohumeral.gap.result import Feasibility
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

# EMG may have this error, and this factor to either side for its gain.
EMG_ERROR, EMG_GAIN = 0.05, 1.6
# Generalised force below which a frame counts as balanced [N m].
BALANCED_NM = 0.5
FRAMES = 12


def no_cost(
    signatures: Sequence[TaskSignatures], recorded: Sequence[np.ndarray], sensors: SensorSetup
) -> Feasibility:
    """Whether any activations in [0, 1], whatever their cost, balance the motion and show this EMG.

    Parameters
    ----------
    signatures : nominal solutions
    recorded : (N, C) mean EMG of the test trials of each task
    sensors : electrodes
    """
    infeasible = []
    for of_task, emg in zip(signatures, recorded, strict=True):
        middle = 0.5 * (emg[1:] + emg[:-1])
        for i in np.unique(np.linspace(0, len(middle) - 1, FRAMES).astype(int)):
            missing = _missing(of_task.levers[i], of_task.needed[i], sensors, middle[i])
            infeasible.append(missing > BALANCED_NM)
    return Feasibility(True, float(100.0 * np.mean(infeasible)))


def _missing(
    levers: np.ndarray, needed: np.ndarray, sensors: SensorSetup, emg: np.ndarray
) -> float:
    """Least sum of generalised forces [N m] that activations with this EMG leave unbalanced."""
    muscles = levers.shape[1]
    slack = np.hstack([np.eye(len(needed)), -np.eye(len(needed))])
    none = np.zeros((len(emg), slack.shape[1]))
    solved = linprog(
        np.concatenate([np.zeros(muscles), np.ones(slack.shape[1])]),
        A_ub=np.vstack(
            [np.hstack([sensors.electrodes, none]), np.hstack([-sensors.electrodes, none])]
        ),
        b_ub=np.concatenate(
            [np.clip(EMG_GAIN * emg + EMG_ERROR, 0.0, None), EMG_ERROR - emg / EMG_GAIN]
        ),
        A_eq=np.hstack([levers, slack]),
        b_eq=needed,
        bounds=[(0.0, 1.0)] * muscles + [(0.0, None)] * slack.shape[1],
    )
    return np.inf if solved.fun is None else float(solved.fun)
