"""Large effects are not linear: their parameters are fitted by solving the movements again."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scapulohumeral.gap.isolation.hypothesis import Fit, Hypothesis
from scapulohumeral.gap.isolation.laplace import fit
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.observables import SensorSetup
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures
from scapulohumeral.gap.signatures.resolve import Resolve, recorded_change, stiffened_movement

# Steps of Gauss-Newton in units of the prior spread: the next linearisation decides again.
LARGEST_STEP = 1.5


# Exact iterations of a solve of a tracked movement from one without the effect: after Gauss-Newton
# 24 solves of a case with EMG, on two meshes, needed 1 to 6. One that needs many more is not on its
# way; a predicted one needed 61 without Gauss-Newton.
WARM_ITERATIONS = 60


def refit(
    first: Fit,
    residual: Residual,
    signatures: Sequence[TaskSignatures],
    model: ParticipantModel,
    sensors: SensorSetup,
    settings: GapSettings,
) -> Fit:
    """Gauss-Newton on the parameters of one effect, every step with new solutions of all tasks.

    Parameters
    ----------
    first : fit to derivatives at the nominal solution
    residual, signatures : what is explained, and the nominal solutions
    model, sensors, settings : as for `signatures.task_signatures`

    Raises
    ------
    SolveError                       a movement with the effect cannot be solved
    """
    [effect] = first.hypothesis.effects
    current, moves, stiffness = first, [], first.hypothesis.stiffness
    if effect.changes_body:
        moves = [stiffened_movement(model, of_task, stiffness, settings) for of_task in signatures]
    starts = [of_task.point for of_task in signatures]
    iterations = settings.iterations
    if settings.view == "tracking":
        iterations = min(WARM_ITERATIONS, iterations)
    for _ in range(settings.refits):
        x = _limited(current)
        values, slopes = [], []
        for i, of_task in enumerate(signatures):
            if effect.changes_body:
                problem = Resolve(moves[i], of_task, sensors, iterations)
                value, slope, starts[i] = problem.solved(effect, x, starts[i])
            else:
                value, slope = recorded_change(effect, x, of_task)
            values.append(value)
            slopes.append(slope)
        hypothesis = Hypothesis(
            (effect,),
            x,
            residual.compress(values)[:, None],
            residual.compress(slopes),
            stiffness,
        )
        current = fit(hypothesis, residual, settings.signature_error)
    return current


def _limited(current: Fit) -> np.ndarray:
    """The fitted parameters, no further than a trusted step from the linearisation."""
    hypothesis = current.hypothesis
    reach = LARGEST_STEP * hypothesis.prior_sd
    x = hypothesis.at + np.clip(current.x - hypothesis.at, -reach, reach)
    low, high = hypothesis.bounds
    return np.clip(x, low, high)
