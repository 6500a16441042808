"""All trials of cases, without noise: each person moves, with and without the effect.

Letters: S control steps.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import relative_angle
from simulated_persons.arm import batch
from simulated_persons.case_person import Person, draw_case
from simulated_persons.drawing.study import Study
from simulated_persons.movement import (
    SETTLE_S,
    Variation,
    draw_variation,
    movement_made,
    no_variation,
    phase_of_trial,
    wished_poses,
)
from simulated_persons.observation import Recording, electrode_matrix, record
from simulated_persons.plan import YIELDS, Plan
from simulated_persons.simulation import GIRDLE_STIFFNESS, TICK_S, Trace, keep, simulate
from simulated_persons.wish import humerus_of, make_wish

BATCH = 100
LARGEST_MISS = np.deg2rad(25.0)  # of the humerus: beyond, the arm did not do the task
# Largest rotation of a person who keeps a movement: torques that the muscles do not give, over the
# stiffness of a shoulder.
LARGEST_DEFLECTION = np.deg2rad(0.3)
# Side of noise-free trials that are done as the test is, but without the effect.
OTHERWISE = "otherwise"
TIRING = 2.0  # muscles tire as 1 - exp(-2 phase)
# Why a case cannot be recorded.
MISSED = "the arm misses its task"
TOO_WEAK = "muscles cannot keep the movement"

# By side, task and repeat; repeat 0 is free of noise.
Recordings = dict[tuple[str, str, int], Recording]


@dataclass(frozen=True, eq=False)
class Run:
    """One trial to simulate; `name` is (side, task, repeat), repeat 0 being noise-free.

    `arm` is an `Arm`, or that of another plant.

    `keeps`: the person does exactly the wished `pose` (S, 13).
    """

    case: str
    name: tuple[str, str, int]
    arm: Any
    pose: np.ndarray
    keeps: bool


@dataclass(frozen=True, eq=False)
class Way:
    """How a person does a task: a motion, and a path (10, WAVES) [rad] on top of it."""

    motion: Motion
    path_rad: np.ndarray

    def poses(self, variation: Variation) -> np.ndarray:
        """Wished poses (S, 13) of a trial."""
        return wished_poses(self.motion, variation.and_also(self.path_rad))


def simulated(study: Study, plans: Sequence[Plan]) -> dict[str, Recordings | str]:
    """Noise-free recordings of every trial, or why a case has none: `MISSED`, `TOO_WEAK`."""
    persons = {plan.id: draw_case(study.anatomies[plan.participant], plan) for plan in plans}
    ways = _ways(study, plans, persons)
    able = [plan for plan in plans if plan.id in ways]
    found: dict[str, Recordings | str] = {plan.id: MISSED for plan in plans}
    found.update({plan.id: {} for plan in able})
    runs = {plan.id: trial_runs(plan, persons[plan.id], ways[plan.id]) for plan in able}
    for run, q, trace, failure in _followed(plans, runs):
        trials = found[run.case]
        if failure:
            found[run.case] = failure
        elif not isinstance(trials, str):
            anatomy = run.arm.anatomy
            electrodes = electrode_matrix(anatomy.names, anatomy.groups)
            trials[run.name] = record(
                q, trace.excitation, trace.reaction_N, run.arm.measurement, electrodes
            )
    return found


def _ways(
    study: Study, plans: Sequence[Plan], persons: Mapping[str, Person]
) -> dict[str, dict[tuple[bool, str], Way]]:
    """Movement of each task of each case, as usual (False) and otherwise (True).

    Who keeps a movement keeps the one that the arm made when it followed the recording without
    any effect. Cases whose arm could not are left out.
    """
    ways: dict[str, dict[tuple[bool, str], Way]] = {}
    first: dict[str, list[Run]] = {}
    still = no_variation()
    for plan in plans:
        person = persons[plan.id]
        ways[plan.id] = recorded_ways(study, plan, person)
        if plan.person != YIELDS:
            first[plan.id] = [
                Run(plan.id, (str(otherwise), task, 0), person.usual, way.poses(still), False)
                for (otherwise, task), way in ways[plan.id].items()
            ]
    for run, q, _, failure in _followed(plans, first):
        if failure:
            ways.pop(run.case, None)
        elif run.case in ways:
            otherwise, task, _ = run.name
            key = otherwise == str(True), task
            ways[run.case][key] = Way(movement_made(q), 0.0 * ways[run.case][key].path_rad)
    return ways


def recorded_ways(study: Study, plan: Plan, person: Person) -> dict[tuple[bool, str], Way]:
    """Recorded movement of each task of a case, as usual (False) and otherwise (True)."""
    return {
        (otherwise, task): Way(study.motions[plan.participant, task], path)
        for task in (*plan.tasks, plan.hidden)
        for otherwise, path in ((False, 0.0 * person.change[task]), (True, person.change[task]))
        if plan.otherwise or not otherwise
    }


def _followed(
    plans: Sequence[Plan], runs: Mapping[str, Sequence[Run]]
) -> Iterator[tuple[Run, np.ndarray, Trace, str]]:
    """Simulate the runs of all cases: poses, trace, and why it is none of the task, or nothing."""
    together: dict[tuple[str, bool], list[Run]] = defaultdict(list)
    for plan in plans:
        for run in runs.get(plan.id, ()):
            together[plan.participant, run.keeps].append(run)
    for group in together.values():
        group.sort(key=lambda run: len(run.pose))
        for start in range(0, len(group), BATCH):
            yield from _follow(group[start : start + BATCH])


def trial_runs(plan: Plan, person: Person, ways: Mapping[tuple[bool, str], Way]) -> list[Run]:
    """Every trial of a case: noise-free twins of all tasks, repeats of those that are recorded."""
    runs = []

    def add(side: str, task: str, repeat: int, arm: Any, way: Way, varied: Variation) -> None:
        keeps = plan.person != YIELDS
        runs.append(Run(plan.id, (side, task, repeat), arm, way.poses(varied), keeps))

    for task in (*plan.tasks, plan.hidden):
        usual, tested = ways[False, task], ways[plan.otherwise, task]
        add("reference", task, 0, person.usual, usual, no_variation())
        add("test", task, 0, person.affected, tested, no_variation())
        if task == plan.hidden:
            continue
        if plan.otherwise:
            add(OTHERWISE, task, 0, person.usual, tested, no_variation())
        sides = (("reference", person.usual, usual), ("test", person.second, tested))
        for side, arm, way in sides:
            for repeat in range(1, plan.repeats + 1):
                if side == "test" or plan.reference:
                    varied = draw_variation(person.rng, person.scale[task])
                    add(side, task, repeat, arm, way, varied)
    return runs


def _follow(runs: Sequence[Run]) -> Iterator[tuple[Run, np.ndarray, Trace, str]]:
    """Simulate runs of one anatomy together; all of them keep their motion, or none does."""
    longest = max(len(run.pose) for run in runs)
    pose = np.stack([_held(run.pose, longest) for run in runs], axis=1)
    body, control = batch([run.arm for run in runs])
    phase = np.ones((longest, len(runs)))
    for number, run in enumerate(runs):
        phase[: len(run.pose), number] = phase_of_trial(len(run.pose))
    wish = make_wish(pose, TICK_S, tiredness(phase), body.muscles.end_force)
    with np.errstate(all="ignore"):  # an arm that cannot do its task may diverge: it is dropped
        trace = (keep if runs[0].keeps else simulate)(body, control, wish)
    for number, run in enumerate(runs):
        own = Trace(*(part[: len(run.pose), number] for part in vars(trace).values()))
        yield run, own.q, own, _failure(run, own, wish.humerus[: len(run.pose), number])


def tiredness(phase: np.ndarray) -> np.ndarray:
    """How far muscles are on their way from fresh to the end of a trial, at phases of it."""
    return np.expm1(-TIRING * phase) / np.expm1(-TIRING)


def _failure(run: Run, trace: Trace, humerus: np.ndarray) -> str:
    """Why a trace is none of the task, of humeri (S, 4) in the thorax; empty if it is."""
    if not relative_angle(humerus_of(trace.q), humerus).max() <= LARGEST_MISS:
        return MISSED
    noise_free = run.name[2] == 0
    if run.keeps and noise_free and not deflection(trace.missing_Nm) <= LARGEST_DEFLECTION:
        return TOO_WEAK
    return ""


def deflection(missing: np.ndarray) -> float:
    """How far joints give for want of torques (S, 10): largest root mean square [rad]."""
    recorded = missing[round(SETTLE_S / TICK_S) :]
    return float(np.sqrt(np.mean(recorded**2, axis=0)).max() / GIRDLE_STIFFNESS)


def _held(pose: np.ndarray, count: int) -> np.ndarray:
    """Poses (count, 13) that stay where they end."""
    return np.vstack([pose, np.repeat(pose[-1:], count - len(pose), axis=0)])
