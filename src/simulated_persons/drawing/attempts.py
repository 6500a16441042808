"""Cases are drawn until they can be recorded: again, or another one in their place.

What cannot be recorded is an arm that misses its task, one too weak to keep its movement, or a
person with two ways to do a task. An effect that hardly shows is drawn again a few times, too.
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simulated_persons.case_person import scatter_scales
from simulated_persons.drawing.keys import shown
from simulated_persons.drawing.salted import salted
from simulated_persons.drawing.study import Study
from simulated_persons.drawing.trials import Recordings, simulated
from simulated_persons.observation import add_noise
from simulated_persons.opensim_plant.trials import simulated_by_opensim
from simulated_persons.plan import OPENSIM, OWN, SALTED, YIELDS, Plan, draw_plans, redrawn

LARGEST_ATTEMPTS = 6  # draws of one case
LARGEST_REPLACEMENTS = 3  # cases that may take the place of one
KEEPING_ATTEMPTS = 3  # draws in which a movement may turn out to be impossible to keep
# Draws for an effect that shows; families that hardly ever do are kept as they are then.
SHOWN_ATTEMPTS = 3
# Largest difference of a mean envelope between repeats of a task [fraction of MVC]. Some persons
# have two ways to do a task, 0.15 to 0.3 apart: a change of way is no effect.
STEADY_EMG = 0.15
TWO_WAYS = "repeats of a task use other muscles"
FAINT = "the effect hardly shows"


@dataclass(frozen=True, eq=False)
class Attempt:
    """A case that is being drawn.

    Attributes
    ----------
    plan : as it is drawn this time
    asked : how the person was to meet the effect at first
    failures : why earlier draws were dropped, in order
    replaced : cases that were given up before, in this one's place
    """

    plan: Plan
    asked: str
    failures: tuple[str, ...] = ()
    replaced: int = 0


@dataclass(frozen=True, eq=False)
class Drawn:
    """A case with its recordings, noise-free ones (repeat 0) included."""

    attempt: Attempt
    recordings: Recordings

    @property
    def plan(self) -> Plan:
        """The case as it was drawn in the end."""
        return self.attempt.plan


@dataclass(frozen=True, eq=False)
class GivenUp:
    """A case that no draw made; `by`: the one in its place, None if there is none."""

    attempt: Attempt
    by: str | None


def drawn_cases(
    study: Study, plans: Sequence[Plan], largest_attempts: int = LARGEST_ATTEMPTS
) -> Iterator[Drawn | GivenUp]:
    """Recordings of all cases, and the cases that were given up.

    A case that cannot be recorded is drawn again, with other amplitudes and another person. Where
    no person manages to keep a movement against an effect, the person gives way. After
    `largest_attempts` another case of its kind takes its place.
    """
    for plan in plans:
        if plan.plant == SALTED:
            yield Drawn(Attempt(plan, plan.person), _with_noise(plan, salted(study, plan)))
    waiting = [Attempt(plan, plan.person) for plan in plans if plan.plant != SALTED]
    while waiting:
        found = _simulated(study, [attempt.plan for attempt in waiting])
        again, failures = [], Counter[str]()
        for attempt in waiting:
            recordings = found[attempt.plan.id]
            failure = _failure(attempt, recordings)
            if not failure:
                assert not isinstance(recordings, str)
                yield Drawn(attempt, _with_noise(attempt.plan, recordings))
                continue
            failures[failure] += 1
            attempt = replace(attempt, failures=(*attempt.failures, failure))
            if len(attempt.failures) < largest_attempts:
                again.append(_again(attempt))
                continue
            other = _instead(attempt, tuple(study.anatomies))
            yield GivenUp(attempt, None if other is None else other.plan.id)
            again += [] if other is None else [other]
        reasons = "; ".join(f"{reason}: {n}" for reason, n in failures.items()) or "none"
        print(f"{len(waiting)} cases drawn, to be drawn again: {reasons}", flush=True)
        waiting = again


def _simulated(study: Study, plans: Sequence[Plan]) -> dict[str, Recordings | str]:
    """Noise-free recordings of cases by the plant of each."""
    own = [plan for plan in plans if plan.plant == OWN]
    other = [plan for plan in plans if plan.plant == OPENSIM]
    return simulated(study, own) | simulated_by_opensim(study, other)


def _failure(attempt: Attempt, recordings: Recordings | str) -> str:
    """Why a draw is dropped; empty if it is not."""
    if isinstance(recordings, str):
        return recordings
    if not _steady(recordings):
        return TWO_WAYS
    plan = attempt.plan
    wanted = bool(plan.injections) and not plan.faint and plan.may_show
    if wanted and len(attempt.failures) + 1 < SHOWN_ATTEMPTS and not shown(plan, recordings):
        return FAINT
    return ""


def _again(attempt: Attempt) -> Attempt:
    """The case drawn again; who never manages to keep the movement gives way."""
    count = len(attempt.failures)
    other = redrawn(attempt.plan, count)
    if count >= KEEPING_ATTEMPTS:
        other = replace(other, person=YIELDS)
    return replace(attempt, plan=other)


def _instead(attempt: Attempt, participants: Sequence[str]) -> Attempt | None:
    """Another case of the same kind; None after too many."""
    if attempt.replaced >= LARGEST_REPLACEMENTS:
        return None
    seed = int(np.random.default_rng([attempt.plan.seed, 3]).integers(2**31))
    [plan] = draw_plans(seed, 1, participants, attempt.plan.kind, attempt.plan.plant)
    # A name from the same generator would tell its seed of 31 bits, and so the cause.
    name = hashlib.sha256(attempt.plan.id.encode()).hexdigest()[: len(attempt.plan.id)]
    return Attempt(replace(plan, id=name), plan.person, replaced=attempt.replaced + 1)


def _steady(recordings: Recordings) -> bool:
    """Whether all repeats of a task, the noise-free one too, have much the same mean envelopes."""
    ways: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for (side, task, _), trial in recordings.items():
        ways[side, task].append(trial.emg.mean(axis=0))
    return all(np.ptp(means, axis=0).max() <= STEADY_EMG for means in ways.values())


def _with_noise(plan: Plan, recordings: Recordings) -> Recordings:
    """Repeats with what scatters in their record only; of salted ones motion alone is written."""
    rng = np.random.default_rng([plan.seed, 1])
    scale = scatter_scales(plan)
    return {
        name: add_noise(trial, rng, scale[name[1]]) if name[2] else trial
        for name, trial in recordings.items()
    }
