"""Answers to persons who are just as the diagnosis assumes."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.by_derivatives.assumed_persons import (
    MOVEMENT,
    NOTHING,
    PAIR,
    SHOWN,
    SINGLE,
    UNKNOWN,
    AssumedPerson,
    draw_person,
)
from scapulohumeral.gap.benchmark.by_derivatives.judging import (
    Inflation,
    evidence_of,
    inflation_of,
    judged,
    leaves_something,
    length,
    probability_of,
    with_difference,
)
from scapulohumeral.gap.benchmark.metrics import of_families
from scapulohumeral.gap.detection.presence import tested
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.judgement import Judged
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE, family
from scapulohumeral.gap.verdict.detectability import smallest_detectable
from scapulohumeral.gap.verdict.posterior import Posterior, posterior, set90
from scapulohumeral.gap.weighing import Weighing

log = logging.getLogger(__name__)

# Most that are believed in show nothing: this share of such persons is answered, each standing for
# those that were not. Pairs that do not show are asked of by no bar.
ANSWERED = {PAIR: 0.0}
USUALLY_ANSWERED = 0.25
# Persons of each kind among so many: singles are what most bars are about.
KINDS = {NOTHING: 1, MOVEMENT: 1, UNKNOWN: 2, PAIR: 2, SINGLE: 6}
# Evidence as it stands, nothing else, but for the misfit that it is divided by.
EXACT = Weighing(
    evidence=1.0,
    held_out=0.0,
    unknown=1.0,
    misled=0.0,
    foreign=0.0,
    moved=0.0,
    moving=0.0,
    fading=0.0,
    silent=0.0,
    silent_motion=0.0,
    silent_alone=0.0,
    silent_power=0.0,
    least=0.0,
)


@dataclass(frozen=True)
class AssumedRow:
    """How one person is answered.

    Attributes
    ----------
    case, number : whose trials, and which person
    kind, truth : what was injected
    weight : how many persons this one stands for
    moved_deg : size of another movement that was supposed [deg]
    cause, movement : how large each shows [standard errors]; of a pair the smaller one
    shown : whether what was injected shows by the rule of keys
    multiple : amplitude of a single effect over the smallest detectable one; 0 if none is promised
    length : of the difference, in units of what differs without a cause
    present, p_value : whether it is a gap, by the first tests
    decided : whether a cause is named
    first, p : the most probable family of answers and its probability
    right : whether it is right; class_right : whether the class of the first holds what is right
    right_p, none_p, no_gap_p : probability of what is right, of none of these, of no gap
    covered, labels : whether the 90 % set holds what is right, and how many labels it has
    left : whether the first cause is said to leave something
    off : relative error of the amplitude of a single effect that comes first, fitted scale
    exact_first, exact_p, exact_right : the most probable family by the evidence as it stands,
        nothing weighed; right if it is what was injected, whether that shows or not
    exact_right_p : probability of what was injected by it
    """

    case: str
    number: int
    kind: str
    truth: str
    weight: float
    moved_deg: float
    cause: float
    movement: float
    shown: bool
    multiple: float
    length: float
    present: bool
    p_value: float
    decided: bool
    first: str
    p: float
    right: bool
    class_right: bool
    right_p: float
    none_p: float
    no_gap_p: float
    covered: bool
    labels: int
    left: bool
    off: float
    exact_first: str
    exact_p: float
    exact_right: bool
    exact_right_p: float


def designs(cases: Path, most: int) -> list[Path]:
    """The first cases, by name, that most bars are asked of: with EMG and reference trials.

    Parameters
    ----------
    cases : folder of case folders; most : how many at most

    Raises
    ------
    DataError                        there is none
    """
    folders = sorted(path for path in cases.iterdir() if path.is_dir())
    found = [
        one
        for one in folders
        if (one / "reference").is_dir() and any((one / "test").glob("*_emg.csv"))
    ]
    if not found:
        raise DataError(f"{cases}: no case with EMG and reference trials; draw more cases.")
    return found[:most]


def assumed_answers(
    cases: Sequence[Path], persons: int, seed: int, config_file: Path, cache: Path
) -> pd.DataFrame:
    """An :class:`AssumedRow` for each person.

    Parameters
    ----------
    cases : folders of cases, whose trials say what is recorded and how it scatters; what was
        recorded counts for nothing else
    persons : with the trials of each
    seed : of all persons
    config_file, cache : as for the diagnosis

    Raises
    ------
    SolveError                       a nominal movement cannot be solved
    """
    rows = []
    for place, folder in enumerate(cases):
        evidence, case = evidence_of(folder, config_file, cache)
        inflation = inflation_of(evidence, case)
        promised = _promised(evidence, inflation)
        kinds = _kinds(evidence, persons)
        log.info("%s: %d persons", folder.name, len(kinds))
        for number, kind in enumerate(kinds):
            person = _answered(evidence, kind, [seed, place, number])
            own = with_difference(evidence, person.delta)
            rows.append(_row(folder.name, number, person, own, inflation, promised))
    return pd.DataFrame([asdict(row) for row in rows])


def _kinds(evidence: Evidence, persons: int) -> list[str]:
    """Kinds of all persons; nobody moves otherwise where no person moved."""
    every = [
        k for k, n in KINDS.items() for _ in range(n) if k != MOVEMENT or evidence.of_one_person
    ]
    return [every[i % len(every)] for i in range(persons)]


def _answered(evidence: Evidence, kind: str, seed: Sequence[int]) -> AssumedPerson:
    """A person of a kind who is answered, see :data:`ANSWERED`."""
    chance, share = np.random.default_rng([*seed, 0]), ANSWERED.get(kind, USUALLY_ANSWERED)
    attempt = 1
    while True:
        person = draw_person(evidence, kind, [*seed, attempt])
        if _asked_of(person) or chance.random() < share:
            return person
        attempt += 1


def _asked_of(person: AssumedPerson) -> bool:
    """Whether a bar asks of a person, so that he is always answered."""
    return person.shown or person.kind == NOTHING


def _promised(evidence: Evidence, inflation: Inflation) -> Mapping[str, float]:
    """Smallest detectable first parameter of each effect that is promised, on the fitted scale."""
    settings = evidence.settings
    _, (first, *_) = tested(
        evidence.cautious, evidence.shapes(), settings.alpha, inflation.factor, inflation.seed
    )
    firm = list(evidence.known.values())[-1]
    found = smallest_detectable(
        firm, evidence.cautious, first.shape_thresholds, settings.signature_error, inflation.seed
    )
    by_label = {one.label: one.effects[0].params[0] for one in firm}
    return {
        one.label: abs(by_label[one.label].internal(one.value))
        for one in found
        if one.parameter == by_label[one.label].name
    }


def _row(
    case: str,
    number: int,
    person: AssumedPerson,
    evidence: Evidence,
    inflation: Inflation,
    promised: Mapping[str, float],
) -> AssumedRow:
    """Judge one person."""
    there, found = judged(evidence, inflation)
    right, injected = _right(person), family(_injected(person))
    weighing = evidence.settings.weighing
    first, p = _first(found.p)
    # What is left of the difference tells how far all errors were larger than assumed.
    exact_weight = 1.0 / found.circumstances.misfit
    exact = posterior(found.scores, replace(EXACT, evidence=exact_weight), (0.0, 1.0))
    exact_first, exact_p = _first(exact)
    chosen = set90(found.p, weighing, found.told)
    group = found.groups[0] if found.groups else [found.best.label]
    return AssumedRow(
        case=case,
        number=number,
        kind=person.kind,
        truth=person.truth,
        weight=1.0 if _asked_of(person) else 1.0 / USUALLY_ANSWERED,
        moved_deg=person.moved_deg,
        cause=round(min(person.cause_shows, default=0.0), 2),
        movement=round(person.movement_shows, 2),
        shown=person.shown,
        multiple=round(_multiple(person, promised), 3),
        length=round(length(evidence), 2),
        present=there.present,
        p_value=round(there.p_value, 4),
        decided=there.present and not found.undecided,
        first=first,
        p=round(p, 4),
        right=first in right,
        class_right=any(family(label) in right for label in group),
        right_p=round(probability_of(found.p, right), 4),
        none_p=round(found.p.none, 4),
        no_gap_p=round(found.p.no_gap, 4),
        covered=any(family(label) in right for label in chosen),
        labels=len(chosen),
        left=leaves_something(found),
        off=round(_off(person, found), 4),
        exact_first=exact_first,
        exact_p=round(exact_p, 4),
        exact_right=exact_first == injected,
        exact_right_p=round(probability_of(exact, {injected}), 4),
    )


def _right(person: AssumedPerson) -> set[str]:
    """Families that are right: of a single effect, of both of a pair together, of none, no gap."""
    movement = {MOVED} if person.movement_shows >= SHOWN else set()
    if person.kind == MOVEMENT or not person.shown:
        silent = set() if movement else {NO_GAP}
        return {*movement, *silent, *(family(one.label) for one in person.causes)}
    causes = {NOTHING: {NO_GAP}, UNKNOWN: {NONE}}.get(person.kind, {family(person.truth)})
    return causes | movement


def _injected(person: AssumedPerson) -> str:
    """Label of what was injected, whether it shows or not."""
    return {NOTHING: NO_GAP, MOVEMENT: MOVED, UNKNOWN: NONE}.get(person.kind, person.truth)


def _multiple(person: AssumedPerson, promised: Mapping[str, float]) -> float:
    """First parameter of a single effect over what is promised of it; 0 if nothing is."""
    if person.kind != SINGLE or person.truth not in promised:
        return 0.0
    return float(abs(person.x[0][0])) / promised[person.truth]


def _off(person: AssumedPerson, found: Judged) -> float:
    """Relative error of the first parameter of a single effect that comes first; else no number."""
    if person.kind != SINGLE or found.best.label != person.truth:
        return np.nan
    true = person.x[0][0]
    return float(abs(found.best.x[0] - true) / abs(true))


def _first(p: Posterior) -> tuple[str, float]:
    """The most probable family, and its probability."""
    return next(iter(of_families(p.every).items()))
