"""One diagnosis as data: a participant, test trials, reference trials.

A case is the whole input of the inference. Names, files and their order are kept for reading only:
trials are put into the order of their arms, and tasks count as a grouping of trials, so that no
name can influence the verdict.

Letters: T frames of a trial, S samples of a companion series at its own rate, C EMG channels.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.laboratory.trial import Channel
from scapulohumeral.model.girdle_range import arm_elevation
from scapulohumeral.model.motion import Motion, resampled
from scapulohumeral.model.rotations import Array

DEFAULT_SEED = 1
DEFAULT_THREADS = 2
# Envelopes within this of 1 reach their maximum, resampled or rounded [1], and those below this do
# not.
AT_MAXIMUM, BELOW_MAXIMUM = 0.01, 0.95
ORDERING_POINTS = 101


@dataclass(frozen=True, eq=False)
class EmgSeries:
    """Envelopes of electromyograms at their own rate.

    Attributes
    ----------
    time_s : (S,)
    channels : C column names, ``EMG_...``, in alphabetical order
    values : (S, C), share of maximal voluntary contraction (or of `GapParticipant.emg_unit`)
    """

    time_s: Array
    channels: tuple[str, ...]
    values: Array

    @property
    def changing(self) -> tuple[str, ...]:
        """Channels that are not one value throughout."""
        moves = np.ptp(self.values, axis=0) > 0.0
        return tuple(name for name, moved in zip(self.channels, moves, strict=True) if moved)

    def of(self, channels: Sequence[str]) -> Array:
        """Values of some channels, in their order, shape (S, number of channels)."""
        return self.values[:, [self.channels.index(name) for name in channels]]


@dataclass(frozen=True, eq=False)
class ContactSeries:
    """Force of the humerus on the glenoid: `time_s` (S,); `force_N` (S, 3), scapula axes."""

    time_s: Array
    force_N: Array


@dataclass(frozen=True, eq=False)
class GapTrial:
    """One recorded trial, as recorded.

    Attributes
    ----------
    name : stem of the file; not to be used for anything but text
    task, repeat : which movement, and which repeat of it; None if nothing says it
    time_s, angles_rad : (T,) and (T, 10), in the order of ``rotations.ANGLE_NAMES``
    smooth : the same, low-pass filtered, with frames in its holes
    emg, contact : companions, None if not measured
    window_s : start and end of the movement, on the clock of `time_s`
    source : file that was read
    rules : joint angle -> what it rests on, of those that nobody measured
    """

    name: str
    task: str
    repeat: int | None
    time_s: Array
    angles_rad: Array
    smooth: Motion
    emg: EmgSeries | None
    contact: ContactSeries | None
    window_s: tuple[float, float]
    source: Path
    rules: Mapping[str, Channel] = field(default_factory=dict)

    def moved(self, nodes: int) -> tuple[Array, Array]:
        """The smooth motion at equal steps of its movement: times (N,), angles (N, 10) [rad]."""
        times = np.linspace(*self.window_s, nodes)
        return times, resampled(self.smooth, times)


@dataclass(frozen=True)
class ScaledModel:
    """How the base model becomes the participant's.

    Attributes
    ----------
    scale : segment -> size over base model along x, y, z of the segment
    total_mass_kg : thorax and one arm together, distributed as in the base model
    segment_mass_kg : segment -> mass that replaces the distributed one; may be empty
    masses : "published" as above, or "anthropometric": arm masses from body mass
    body_mass_kg, height_m, sex : None if unknown
    """

    scale: Mapping[str, tuple[float, ...]]
    total_mass_kg: float
    segment_mass_kg: Mapping[str, float]
    masses: Literal["published", "anthropometric"]
    body_mass_kg: float | None = None
    height_m: float | None = None
    sex: str | None = None


@dataclass(frozen=True)
class GapParticipant:
    """Whose trials these are.

    Attributes
    ----------
    id : name, for text only
    side : "right"
    model : how the base model is scaled
    gravity_mps2 : in thorax axes
    emg_channels : EMG column -> muscle groups of the model that it records; empty without EMG
    emg_unit : "fraction_of_mvc"; "fraction_of_shared_max", of the largest value of all trials,
        which tells no level; or "fraction_of_max", of maxima that need not be the same, either
    neighbours : pairs of EMG columns between which cross-talk is considered
    """

    id: str
    side: str
    model: ScaledModel
    gravity_mps2: tuple[float, ...]
    emg_channels: Mapping[str, tuple[str, ...]]
    emg_unit: str
    neighbours: tuple[tuple[str, str], ...]

    @property
    def emg_is_of_mvc(self) -> bool:
        """Whether EMG has a level, not only a shape: a share of maximal voluntary contraction."""
        return self.emg_unit == "fraction_of_mvc"


@dataclass(frozen=True, eq=False)
class Case:
    """What is diagnosed. Make it with `make_case`, which orders trials by their arms.

    `notes` are remarks of the reader (columns ignored, repeats counted once) for the log.
    `one_movement`: whether trial i of both sides recorded one movement, see
    `one_movement.aligned`.
    """

    participant: GapParticipant
    test: tuple[GapTrial, ...]
    reference: tuple[GapTrial, ...]
    seed: int = DEFAULT_SEED
    threads: int = DEFAULT_THREADS
    notes: tuple[str, ...] = ()
    one_movement: bool = False

    @property
    def mode(self) -> str:
        """Either "reference" or, without reference trials, "no_reference"."""
        return "reference" if self.reference else "no_reference"

    @property
    def trials(self) -> tuple[GapTrial, ...]:
        """Trials of both sides."""
        return (*self.test, *self.reference)

    @property
    def tasks(self) -> tuple[str, ...]:
        """Tasks of the test trials, in the order in which the trials come."""
        return tuple(dict.fromkeys(trial.task for trial in self.test))

    @property
    def compared(self) -> tuple[GapTrial, ...]:
        """Trials of the tasks that both sides have; all without reference trials."""
        if not self.reference:
            return self.test
        both = {trial.task for trial in self.reference}.intersection(self.tasks)
        return tuple(trial for trial in self.trials if trial.task in both)

    @property
    def channels(self) -> tuple[str, ...]:
        """EMG channels of every trial compared that the participant maps to muscles, sorted.

        One that never changes in some trial was off there, and would seem to tell without any
        scatter that its muscle did nothing.
        """
        recorded = [set(trial.emg.changing) if trial.emg else set() for trial in self.compared]
        return tuple(sorted(set(self.participant.emg_channels).intersection(*recorded)))

    @property
    def emg_has_one_maximum(self) -> bool:
        """Whether the same maxima divided EMG of both sides, as its unit says or its values show.

        Values do where in every channel the largest value of all trials is 1, and in half of them
        at least that of one side is not: it was not divided by its own. In a few it is not either
        where the trial that held it was left out.
        """
        if self.channels and self.participant.emg_unit == "fraction_of_shared_max":
            return True
        if not self.channels or not self.reference:
            return False
        sides = [self._largest_emg(trials) for trials in (self.test, self.reference)]
        reached = np.maximum(*sides)
        below = np.minimum(*sides) < BELOW_MAXIMUM
        return bool(np.all(abs(reached - 1.0) <= AT_MAXIMUM) and np.mean(below) >= 0.5)

    def _largest_emg(self, trials: Sequence[GapTrial]) -> Array:
        """Largest value of each of :attr:`channels` in those of some trials that have them all."""
        every = set(self.channels)
        series = [trial.emg for trial in trials if trial.emg is not None]
        each = [emg.of(self.channels) for emg in series if every <= set(emg.channels)]
        return np.concatenate(each).max(axis=0)

    @property
    def has_contact(self) -> bool:
        """Whether every trial compared has a measured contact force."""
        return all(trial.contact is not None for trial in self.compared)


def make_case(
    participant: GapParticipant,
    test: Sequence[GapTrial],
    reference: Sequence[GapTrial],
    seed: int = DEFAULT_SEED,
    threads: int = DEFAULT_THREADS,
    notes: Sequence[str] = (),
) -> Case:
    """A case with its trials in the order of their arms; identical recordings count once.

    Whatever is drawn at random is drawn in this order, which rounding, sampling rate and clock of
    a file hardly change.

    Raises
    ------
    DataError                        no test trial, or one recording as both test and reference
    """
    if not test:
        raise DataError("no test trial; name at least one trial file after `gap diagnose`.")
    by_hash = [{trial_hash(trial): trial for trial in trials} for trials in (test, reference)]
    for key in by_hash[0].keys() & by_hash[1].keys():
        raise DataError(
            f"{by_hash[0][key].source} and {by_hash[1][key].source}: the same recording as test "
            "and as reference trial; expected different ones. Leave it out on one side."
        )
    once = [
        f"{trial.source}: the same recording as {kept[trial_hash(trial)].source}; counted once"
        for trials, kept in zip((test, reference), by_hash, strict=True)
        for trial in trials
        if kept[trial_hash(trial)] is not trial
    ]
    ordered = [
        tuple(kept[key] for key in sorted(kept, key=lambda key: (_height(kept[key]), key)))
        for kept in by_hash
    ]
    return Case(participant, ordered[0], ordered[1], seed, threads, (*notes, *once))


def _height(trial: GapTrial) -> float:
    """Mean elevation of the arm over the movement [rad]."""
    return float(np.mean(arm_elevation(trial.moved(ORDERING_POINTS)[1])))


def trial_hash(trial: GapTrial) -> str:
    """SHA-256 over the numbers of a trial, without its names."""
    digest = hashlib.sha256()
    arrays = [trial.time_s, trial.angles_rad, np.array(trial.window_s)]
    if trial.emg is not None:
        arrays += [trial.emg.time_s, trial.emg.values]
        digest.update(" ".join(trial.emg.channels).encode())
    if trial.contact is not None:
        arrays += [trial.contact.time_s, trial.contact.force_N]
    if trial.rules:
        digest.update(repr(sorted(trial.rules.items())).encode())
    for array in arrays:
        digest.update(str(array.shape).encode())
        digest.update(np.ascontiguousarray(array, dtype="<f8").tobytes())
    return digest.hexdigest()


def participant_hash(participant: GapParticipant) -> str:
    """SHA-256 over what the participant's model and EMG set-up are, without the name."""
    model = participant.model
    described = (
        sorted(model.scale.items()),
        sorted(model.segment_mass_kg.items()),
        (model.total_mass_kg, model.masses, model.body_mass_kg, model.height_m, model.sex),
        participant.side,
        participant.gravity_mps2,
        sorted(participant.emg_channels.items()),
        participant.emg_unit,
        sorted(participant.neighbours),
    )
    return hashlib.sha256(repr(described).encode()).hexdigest()


def case_hash(case: Case) -> str:
    """SHA-256 over everything that may influence the verdict.

    Tasks enter as a grouping: the number of the first trial of the same task, in the order of
    content. Names of trials, tasks, files and participant do not enter.
    """
    digest = hashlib.sha256(participant_hash(case.participant).encode())
    groups: dict[str, int] = {}
    for kind, trials in (("test", case.test), ("reference", case.reference)):
        for trial in trials:
            group = groups.setdefault(trial.task, len(groups))
            digest.update(f"{kind} {group} {trial_hash(trial)} ".encode())
    digest.update(f"seed {case.seed}{' one movement' * case.one_movement}".encode())
    return digest.hexdigest()
