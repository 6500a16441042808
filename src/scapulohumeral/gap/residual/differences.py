"""Recorded trials of the tasks that are compared, and the differences to explain.

Letters: T tasks, N nodes, K channels, D coefficients.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.linalg import block_diag

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.nominal.optimal_movement import nominal_body
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.case import Case, GapTrial
from scapulohumeral.gap.recording.marks import (
    unmeasured_angles,
    unmeasured_segments,
)
from scapulohumeral.gap.recording.observables import (
    SensorSetup,
    carried,
    channel_names,
    difference,
    electrode_matrix,
    mean,
    missed_deg,
    recorded,
    without,
)
from scapulohumeral.gap.residual.noise import Noise, Repeats, trial_noise
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import TaskSignatures

Side = Literal["test", "reference"]
# ASSUME: what the mesh misses of a movement by less is no part of the comparison [deg].
MISSED_DEG = 3.0
# From this ratio of durations on a reader wants to know.
OTHER_TEMPO = 1.1


@dataclass(frozen=True, eq=False)
class Records:
    """Recorded trials of the tasks that are compared.

    Attributes
    ----------
    test, reference : task -> trials; no reference in no-reference mode
    mean_records : task -> mean of its trials, to which changes are relative
    sensors : what is recorded; channels : (K,) names
    of_one_person : whether a person is compared with the same person, who chose both movements:
        with reference trials, and not between simulations
    of_one_movement : whether both sides recorded the same movements. Test trials are then mean
        records that differ from the mean as each record does from its partner, and the reference
        is that mean, which is exact
    """

    test: Mapping[str, Sequence[Observation]]
    reference: Mapping[str, Sequence[Observation]]
    mean_records: Mapping[str, Observation]
    sensors: SensorSetup
    channels: tuple[str, ...]
    of_one_person: bool
    of_one_movement: bool = False

    @property
    def sides(self) -> dict[Side, Mapping[str, Sequence[Observation]]]:
        """Trials of both sides that scatter, by task."""
        if self.of_one_movement:
            return {"test": self.test}
        return {"test": self.test, "reference": self.reference}

    @property
    def durations_s(self) -> dict[str, float]:
        """Mean duration of the test trials of each task."""
        return {
            task: float(np.mean([one.duration_s for one in self.test[task]]))
            for task in self.mean_records
        }

    def about_mean(self, task: str, trials: Iterable[Observation]) -> np.ndarray:
        """Curves (L, N, K) of trials of a task relative to its mean record."""
        return np.stack([difference(one, self.mean_records[task]) for one in trials])

    def of_tasks(self, tasks: Collection[str]) -> Records:
        """The same for some of the tasks."""
        kept = [task for task in self.mean_records if task in tasks]
        return replace(
            self,
            test={task: self.test[task] for task in kept},
            reference={task: self.reference[task] for task in kept if self.reference},
            mean_records={task: self.mean_records[task] for task in kept},
        )

    def thinned(self) -> Iterator[tuple[OneTrial, Records]]:
        """Each trial in turn, and the records without it.

        Where it is the only one of its side, its task goes with it; of a single task it stays.
        """
        for side, tasks in self.sides.items():
            for task, trials in tasks.items():
                places = (OneTrial(side, task, i) for i in range(len(trials)))
                rest = ((place, self._without(place)) for place in places)
                yield from ((place, left) for place, left in rest if left.mean_records)

    def _without(self, place: OneTrial) -> Records:
        """The same without one trial, or without its task if no other is on its side."""
        task, of_test = place.task, place.side == "test"
        trials = self.sides[place.side]
        left = [one for i, one in enumerate(trials[task]) if i != place.index]
        if not left:
            return self.of_tasks(set(self.mean_records) - {task})
        if of_test:
            fewer = replace(self, test={**self.test, task: left})
        else:
            fewer = replace(self, reference={**self.reference, task: left})
        base = mean((fewer.reference or fewer.test)[task])
        return replace(fewer, mean_records={**self.mean_records, task: base})


@dataclass(frozen=True)
class OneTrial:
    """A trial by its place: side "test" or "reference", task, and index among its side's trials."""

    side: Side
    task: str
    index: int

    def name(self, case: Case) -> str:
        """What the trial is called in a case."""
        trials = case.test if self.side == "test" else case.reference
        return [one.name for one in trials if one.task == self.task][self.index]


def read_records(
    case: Case, model: ParticipantModel, settings: GapSettings, warnings: list[str]
) -> Records:
    """Records of the tasks that have trials on both sides, or of all without reference trials.

    `warnings` gets one sentence per task that is left out.
    """

    def observed(trials: Iterable[GapTrial]) -> dict[str, list[Observation]]:
        tasks: dict[str, list[Observation]] = {}
        for trial in (one for one in trials if one in compared):
            one = recorded(trial, case.channels, case.has_contact, settings.nodes)
            tasks.setdefault(trial.task, []).append(one)
        return tasks

    compared = case.compared
    test, reference = observed(case.test), observed(case.reference)
    if case.one_movement:
        test, reference = _paired(test, reference)
    warnings += [
        f"{trial.name}: {settings.nodes} points of phase miss its movement by {missed:.0f} deg "
        "(root mean square); give one movement a trial (window_s), or more nodes in the settings"
        for trial in compared
        if (missed := missed_deg(trial, settings.nodes)) > MISSED_DEG
    ]
    if left := sorted(set(case.tasks) - set(test)):
        warnings.append(f"tasks without reference trials are left out: {', '.join(left)}")
    base = reference or test
    groups = nominal_body(model, settings.nodes).groups
    electrodes = electrode_matrix(
        [case.participant.emg_channels[name] for name in case.channels], groups
    )
    return Records(
        test=test,
        reference={task: reference[task] for task in test if reference},
        mean_records={task: mean(base[task]) for task in test},
        sensors=SensorSetup(
            case.channels,
            electrodes,
            case.has_contact,
            unmeasured_segments(compared),
            unmeasured_angles(compared),
        ),
        channels=channel_names(case.channels, case.has_contact),
        of_one_person=bool(reference) and not settings.of_simulations and not case.one_movement,
        of_one_movement=case.one_movement,
    )


def _paired(
    test: Mapping[str, Sequence[Observation]], reference: Mapping[str, Sequence[Observation]]
) -> tuple[dict[str, list[Observation]], dict[str, list[Observation]]]:
    """Both sides of records of the same movements, see :class:`Records`: trial i of a task is one.

    So what the person did otherwise from trial to trial is in neither side.
    """
    means = {task: mean(trials) for task, trials in reference.items()}
    carried_ = {
        task: [
            carried(one, partner, means[task])
            for one, partner in zip(trials, reference[task], strict=True)
        ]
        for task, trials in test.items()
    }
    return carried_, {task: [one] for task, one in means.items()}


def solved_part(
    records: Records, found: Sequence[TaskSignatures | SolveError], warnings: list[str]
) -> Records:
    """Records of the tasks whose nominal movement was solved.

    Raises
    ------
    SolveError                       none was
    """
    faults = {
        task: one
        for task, one in zip(records.mean_records, found, strict=True)
        if isinstance(one, SolveError)
    }
    if len(faults) == len(records.mean_records):
        raise next(iter(faults.values()))
    warnings += [f"task {task} is left out: {error}" for task, error in faults.items()]
    return records.of_tasks(set(records.mean_records) - set(faults))


def at_one_tempo(
    records: Records, signatures: Sequence[TaskSignatures], warnings: list[str]
) -> Records:
    """The same, with EMG and joint force of test trials as the tempo of the reference asks for.

    `warnings` gets one sentence per task with another tempo.
    """
    test, durations_s = dict(records.test), records.durations_s
    for of_task in signatures:
        task = of_task.task
        test[task] = [without(one, of_task.tempo) for one in records.test[task]]
        longer = durations_s[task] / records.mean_records[task].duration_s
        if np.any(of_task.tempo) and abs(np.log(longer)) > np.log(OTHER_TEMPO):
            warnings.append(
                f"test trials of task {task} last {longer:.2f} times as long as reference trials: "
                "what this changes of EMG and joint force, as the model predicts it, is taken off"
            )
    return replace(records, test=test)


def repeat_noise(records: Records, functions: np.ndarray, settings: GapSettings) -> Noise:
    """Covariance of one trial, from all that was repeated."""
    repeats = {
        task: Repeats(
            mean_record,
            tuple(records.about_mean(task, side[task]) for side in records.sides.values() if side),
        )
        for task, mean_record in records.mean_records.items()
    }
    return trial_noise(repeats, records.channels, functions, settings.noise)


def mean_difference(
    records: Records, signatures: Sequence[TaskSignatures], noise: Noise, functions: np.ndarray
) -> Residual:
    """Differences of the tasks' means; their covariance is that between repeats."""
    curves_ = [np.mean(own, axis=0) for own in _singles(records, signatures)]
    trials = [len(records.test[task]) for task in records.mean_records]
    return _residual(records, tuple(records.mean_records), curves_, trials, noise, functions)


@dataclass(frozen=True, eq=False)
class Fold:
    """Trials of one task that are left out, and what the others of that task differ by.

    Attributes
    ----------
    task : name
    left_out : difference of a test trial, to a reference trial if these scatter
    rest : (D,) mean difference of the other trials
    """

    task: str
    left_out: Residual
    rest: np.ndarray


def folds(
    records: Records, signatures: Sequence[TaskSignatures], noise: Noise, functions: np.ndarray
) -> tuple[Fold, ...]:
    """Every trial left out at least once, on both sides: what is odd in a reference trial is odd in
    all differences to it. A task with one trial on a side has nothing to leave out.
    """
    found = []
    scattering = records.sides.get("reference", {})
    for task, curves_ in zip(records.mean_records, _singles(records, signatures), strict=True):
        test = np.stack([compress([curve], functions) for curve in curves_])
        base = np.zeros((1, test.shape[1]))
        if scattering:
            base = records.about_mean(task, scattering[task])
            base = np.stack([compress([curve], functions) for curve in base])
        if len(test) < 2 or (scattering and len(base) < 2):
            continue
        own = (1.0 + bool(scattering)) * noise.covariances[task]
        for k in range(max(len(test), len(base))):
            i, j = k % len(test), k % len(base)
            rest = np.delete(test, i, axis=0).mean(axis=0)
            if scattering:
                rest = rest - np.delete(base, j, axis=0).mean(axis=0)
            left_out = _of(records, (task,), test[i] - base[j], own, noise, functions)
            found.append(Fold(task, left_out, rest))
    return tuple(found)


def halves(
    records: Records, signatures: Sequence[TaskSignatures], functions: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Differences (D,) of two halves of the test trials; none if a task has but one trial."""
    curves_ = _singles(records, signatures)
    if min(map(len, curves_)) < 2:
        return ()
    parts = ([np.mean(own[part::2], axis=0) for own in curves_] for part in (0, 1))
    return tuple(compress(part, functions) for part in parts)


def _singles(records: Records, signatures: Sequence[TaskSignatures]) -> list[list[np.ndarray]]:
    """Curves (N, K) of each test trial by which it differs from its task's reference."""
    tasks = records.mean_records
    bases = [tasks[r.task] if records.reference else r.nominal for r in signatures]
    return [
        [difference(one, base) for one in records.test[task]]
        for task, base in zip(tasks, bases, strict=True)
    ]


def _residual(
    records: Records,
    tasks: tuple[str, ...],
    curves_: Sequence[np.ndarray],
    trials: Sequence[int],
    noise: Noise,
    functions: np.ndarray,
) -> Residual:
    """Residual of differences (N, K) of tasks, each the mean of so many test trials."""
    scattering = records.sides.get("reference", {})
    counts = [len(scattering.get(task, ())) for task in tasks]
    weights = [1.0 / n + (1.0 / m if m else 0.0) for n, m in zip(trials, counts, strict=True)]
    own = [noise.covariances[task] for task in tasks]
    repeats = block_diag(*(w * one for w, one in zip(weights, own, strict=True)))
    return _of(records, tasks, compress(curves_, functions), repeats, noise, functions)


def _of(
    records: Records,
    tasks: tuple[str, ...],
    delta: np.ndarray,
    repeats: np.ndarray,
    noise: Noise,
    functions: np.ndarray,
) -> Residual:
    """Residual (D,) of tasks with the covariance (D, D) between repeats."""
    return Residual(
        delta=delta,
        covariance=repeats,
        noise=repeats,
        functions=functions,
        tasks=tasks,
        channels=records.channels,
        degrees=tuple(noise.worth[task] for task in tasks),
    )
