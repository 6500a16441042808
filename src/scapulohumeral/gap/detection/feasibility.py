"""Whether any activations at all could have done what was recorded, whatever their cost.

Where none could, no other control explains it: body, input or measurement differ from the model.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linprog

from scapulohumeral.gap.recording.observables import Recorder
from scapulohumeral.gap.result import NoCost
from scapulohumeral.gap.signatures.of_tasks import Response

# EMG may have this error, and this factor to either side for its gain.
EMG_ERROR, EMG_GAIN = 0.05, 1.6
# Generalised force below which a frame counts as balanced [N m].
BALANCED_NM = 0.5
FRAMES = 12


def no_cost(
    responses: Sequence[Response], recorded: Sequence[np.ndarray], recorder: Recorder
) -> NoCost:
    """Whether any activations in [0, 1], whatever their cost, balance the motion and show this EMG.

    Parameters
    ----------
    responses : nominal solutions
    recorded : (N, C) mean EMG of the test trials of each task
    recorder : electrodes
    """
    if not recorder.channels:
        return NoCost(False, None)
    infeasible = []
    for response, emg in zip(responses, recorded, strict=True):
        middle = 0.5 * (emg[1:] + emg[:-1])
        for i in np.unique(np.linspace(0, len(middle) - 1, FRAMES).astype(int)):
            missing = _missing(response.levers[i], response.needed[i], recorder, middle[i])
            infeasible.append(missing > BALANCED_NM)
    return NoCost(True, float(100.0 * np.mean(infeasible)))


def _missing(levers: np.ndarray, needed: np.ndarray, recorder: Recorder, emg: np.ndarray) -> float:
    """Least sum of generalised forces [N m] that activations with this EMG leave unbalanced."""
    muscles = levers.shape[1]
    slack = np.hstack([np.eye(len(needed)), -np.eye(len(needed))])
    none = np.zeros((len(emg), slack.shape[1]))
    solved = linprog(
        np.concatenate([np.zeros(muscles), np.ones(slack.shape[1])]),
        A_ub=np.vstack(
            [np.hstack([recorder.electrodes, none]), np.hstack([-recorder.electrodes, none])]
        ),
        b_ub=np.concatenate(
            [np.clip(EMG_GAIN * emg + EMG_ERROR, 0.0, None), EMG_ERROR - emg / EMG_GAIN]
        ),
        A_eq=np.hstack([levers, slack]),
        b_eq=needed,
        bounds=[(0.0, 1.0)] * muscles + [(0.0, None)] * slack.shape[1],
    )
    return np.inf if solved.fun is None else float(solved.fun)
