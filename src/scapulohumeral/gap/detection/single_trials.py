"""Whether a gap rests on one trial: a movement that went otherwise once is no difference of sides.

Among three repeats of a real person one may stand out from all others, and a mean difference that
is large for noise is then that one trial. So each trial in turn is left out (the jackknife), and
the rest has to differ, too. A trial that cannot be left out has to tell as much as two.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.detection.presence import Presence, surest, tested
from scapulohumeral.gap.detection.shaped import z_value
from scapulohumeral.gap.labels import LOAD
from scapulohumeral.gap.residual.differences import (
    OneTrial,
    Records,
    mean_difference,
    repeat_noise,
)
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import Detectable
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

STATISTIC, ALONE = "without_one_trial", "one_trial_alone"


@dataclass(frozen=True)
class Odd:
    """The trial that a gap rests on.

    Attributes
    ----------
    trial : without which there is no gap
    p_value : of the rest
    """

    trial: OneTrial
    p_value: float


def level(alpha: float) -> float:
    """Level at which the rest has to differ: with one trial at the same, both have `alpha`."""
    return float(np.sqrt(alpha))


def rests_on_one(
    records: Records,
    signatures: Sequence[TaskSignatures],
    residual: Residual,
    shapes: Mapping[str, Sequence[np.ndarray]],
    settings: GapSettings,
    inflation: float,
    seed: int,
) -> Odd | None:
    """The trial without which the others do not differ; None without one, see also :func:`alone`.

    Parameters
    ----------
    records, signatures : of the tasks that are compared
    residual : difference of all trials, with all that it may be off by
    shapes : slopes (D, P) of the effects that tests look for, by name of the test
    settings : of the diagnosis
    inflation, seed : as for `presence.difference_map`
    """
    found = []
    for trial, rest in records.of_tasks(residual.tasks).thinned():
        left = _residual(rest, signatures, residual, settings)
        rows = residual.rows(left.tasks)
        slopes = {name: [one[rows] for one in many] for name, many in shapes.items()}
        shown = {name: [one for one in many if np.any(one)] for name, many in slopes.items()}
        p_value = surest(tested(left, shown, settings.alpha, inflation, seed)[1]).p_value
        found.append(Odd(trial, p_value))
    worst = max(found, key=lambda one: one.p_value, default=None)
    return worst if worst and worst.p_value > level(settings.alpha) else None


def alone(records: Records) -> tuple[OneTrial, ...]:
    """Trials that cannot be left out: of a single task, the only ones of their side.

    None where both sides recorded the same movements: that one went otherwise is no difference.
    """
    if records.of_one_movement or len(records.mean_records) > 1:
        return ()
    return tuple(
        OneTrial(side, task, 0)
        for side, tasks in records.sides.items()
        for task, trials in tasks.items()
        if len(trials) == 1
    )


def contradicted(found: Presence, odd: Odd, alpha: float) -> Presence:
    """A finding that does not stand where it rests on one trial; its value becomes a z value."""
    return replace(
        found,
        present=False,
        p_value=max(found.p_value, odd.p_value),
        statistic=STATISTIC,
        value=float(z_value(odd.p_value)),
        threshold=float(z_value(level(alpha))),
    )


def as_sure_as_two(found: Presence, by_noise: float, alpha: float) -> Presence:
    """A finding of a trial that cannot be left out, see :func:`alone`; its value is a z value.

    Two that each have a p value of `alpha` are by chance as rare as its square: so rare has one to
    be alone. Its p value is told as that of each of two.

    Parameters
    ----------
    found : the finding, which stood up to other arrangements of the trials
    by_noise : its p value by thresholds simulated from the noise: so few arrangements tell no more
        than that they do not contradict it
    alpha : false alarms allowed
    """
    p_value = float(np.sqrt(by_noise))
    return replace(
        found,
        present=p_value <= alpha,
        p_value=max(p_value, found.p_value),
        statistic=ALONE,
        value=float(z_value(p_value)),
        threshold=float(z_value(alpha)),
    )


def alone_in_words(one: OneTrial, name: str) -> str:
    """Why a gap may be no more than one trial."""
    return (
        f"{one.side} trial {name} is the only one of its side: a movement that went otherwise once "
        "looks like a gap, so that only a rare difference is one; record repeats, or a second task"
    )


def few_in_words(records: Records, detectable: Sequence[Detectable]) -> list[str]:
    """Why no gap says little where a side has one trial of each task; empty if none has.

    Parameters
    ----------
    records : trials that were compared
    detectable : smallest amplitudes that they would have shown
    """
    few = [
        side
        for side, tasks in records.sides.items()
        if tasks and all(len(trials) == 1 for trials in tasks.values())
    ]
    if records.of_one_movement or not few:
        return []
    load = next((one for one in detectable if one.label == LOAD), None)
    shown = "no load in the hand that is considered would have shown"
    if load is not None:
        shown = f"a load in the hand would hardly have shown below {load.value:.2g} {load.unit}"
    return [
        f"no gap says little here, with one {' and one '.join(few)} trial of each task: {shown}; "
        "the answer lists what would have shown of other causes (smallest_detectable); record "
        "repeats"
    ]


def in_words(odd: Odd, name: str) -> str:
    """What to do about the trial that a gap rests on."""
    return (
        f"the gap rests on {odd.trial.side} trial {name} (task {odd.trial.task}): the others alone "
        f"show none (p {odd.p_value:.2g}), and one trial is no gap; look at it, or record another"
    )


def _residual(
    records: Records,
    signatures: Sequence[TaskSignatures],
    whole: Residual,
    settings: GapSettings,
) -> Residual:
    """Difference of some of the trials, with the noise that they show and all else as before."""
    kept = [of_task for of_task in signatures if of_task.task in records.mean_records]
    noise = repeat_noise(records, whole.functions, settings)
    own = mean_difference(records, kept, noise, whole.functions)
    rows = np.ix_(*2 * [whole.rows(own.tasks)])
    rest = (whole.covariance - whole.noise)[rows]
    return replace(own, covariance=own.noise + rest)
