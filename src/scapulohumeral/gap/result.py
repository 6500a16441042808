"""The answer of a diagnosis: the fields of ``result.json``, schema "gap-result/1", and its checks.

Fields carry the names that they have in the file; ``result.schema.json`` is the contract with
whoever reads it. Curves are not part of the file: they are written as tables beside it.

An interval that cannot be given is None, with a line in `Diagnosis.warnings`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import pandas as pd
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from scapulohumeral.errors import DataError
from scapulohumeral.gap.labels import JOIN, NO_GAP, NONE
from scapulohumeral.gap.recording.case import Case

SCHEMA_FILE = "result.schema.json"
# Probabilities and shares are sums of many rounded numbers.
SUM_TOLERANCE = 1e-6


Interval = tuple[float, float] | None


Status = Literal["ok", "abstained", "failed"]


@dataclass(frozen=True)
class Channels:
    """Which kinds of observables all trials have."""

    kinematics: bool
    emg: bool
    contact_force: bool


@dataclass(frozen=True)
class Inputs:
    """What was diagnosed: names of trials and tasks, in the order of their arms."""

    participant: str
    test: tuple[str, ...]
    reference: tuple[str, ...]
    tasks: tuple[str, ...]
    channels: Channels


@dataclass(frozen=True)
class Size:
    """Size of the gap over its noise, beyond what noise and sessions make; see module `size`."""

    value: float
    ci95: Interval
    unit: str = "sigma"


@dataclass(frozen=True)
class Feasibility:
    """Whether any activations in [0, 1] reach the data, and in how many frames none do [%]."""

    tested: bool
    infeasible_frames_percent: float | None


@dataclass(frozen=True)
class Detectable:
    """Smallest amplitude of an effect that these trials would show in this share of persons."""

    label: str
    parameter: str
    value: float
    unit: str
    power: float


@dataclass(frozen=True)
class Gap:
    """Whether there is a gap above the floor. `floor_source`: "repeats" or "configuration"."""

    present: bool
    p_value: float
    statistic: str
    value: float
    threshold: float
    floor_source: str
    size: Size
    no_cost: Feasibility
    smallest_detectable: tuple[Detectable, ...]


@dataclass(frozen=True)
class Shown:
    """A region where the gap shows: channel and phase interval [%]; `effect` in `unit`.

    `repeated`: whether both halves of the test trials have it; None with too few trials for halves.
    """

    channel: str
    phase_percent: tuple[float, float]
    peak_percent: float
    sign: int
    effect_sigma: float
    effect: float
    unit: str
    p_value: float
    share: float
    repeated: bool | None


@dataclass(frozen=True)
class Entered:
    """A region where the gap enters: `kind` is "dof" or "channel"; `repeated` as in `Shown`."""

    kind: str
    name: str
    phase_percent: tuple[float, float]
    effect: float
    unit: str
    p_value: float
    share: float
    repeated: bool | None


@dataclass(frozen=True)
class Regions:
    """Both maps; the shares of each add up to one."""

    shows: tuple[Shown, ...] = ()
    enters: tuple[Entered, ...] = ()


@dataclass(frozen=True)
class Amplitude:
    """Fitted value of a parameter of an effect."""

    name: str
    value: float
    ci95: Interval
    unit: str
    at_bound: bool


@dataclass(frozen=True)
class Candidate:
    """One possible cause.

    `label` is ``side/family[/member]``, two effects joined by " + " in alphabetical order, as
    `parameters` are; `level` says how deep it could be resolved ("member", "family", or "side" at
    best); `class_id` is an id of `Diagnosis.classes`, or None for a candidate of which no class was
    computed.
    """

    label: str
    level: str
    p: float
    class_id: int | None
    unexplained_share: float
    task_agreement_p: float | None
    parameters: tuple[Amplitude, ...]


def explained_by_any(candidates: Sequence[Candidate]) -> bool:
    """Whether any leaves less than all: else the gap is no larger than smooth causes leave."""
    return any(candidate.unexplained_share < 1.0 for candidate in candidates)


@dataclass(frozen=True)
class EffectClass:
    """Effects that these trials cannot tell apart: together `p`, in words `text`."""

    id: int
    labels: tuple[str, ...]
    p: float
    p_correct_within: float
    text: str


@dataclass(frozen=True)
class Share:
    """Share of the reducible gap that disappears, on `n_trials` trials."""

    value: float
    ci95: Interval
    n_trials: int


@dataclass(frozen=True)
class GroupShrinkage:
    """The same in units, for a group of channels; `split` is a field of `Shrinkage`."""

    group: str
    split: str
    before: float
    after: float
    floor: float
    unit: str


@dataclass(frozen=True)
class Shrinkage:
    """How far the gap shrinks with the effect added.

    `new_task` is what one more task is expected to show; None without a second task.
    """

    in_sample: Share | None
    held_out_trial: Share | None
    new_task: Share | None
    groups: tuple[GroupShrinkage, ...]


@dataclass(frozen=True)
class NextTrial:
    """The task that, recorded again, best tells `splits` apart: rightly with `p_correct`."""

    task: str
    splits: tuple[str, ...]
    p_correct: float


@dataclass(frozen=True)
class Robustness:
    """In how many cells (signature error, noise, tasks left out) the verdict is the same."""

    cells: int
    agree: int


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """A finished diagnosis.

    `told`, whether data tell what may have been the cause from what may not, and `curves`, see
    `curve_files`, are not in ``result.json``.
    """

    status: Status
    status_reason: str
    mode: str
    inputs: Inputs
    gap: Gap | None = None
    regions: Regions = Regions()
    candidates: tuple[Candidate, ...] = ()
    none_p: float | None = None
    no_gap_p: float | None = None
    set90: tuple[str, ...] = ()
    classes: tuple[EffectClass, ...] = ()
    shrinkage: Shrinkage | None = None
    next_trial: NextTrial | None = None
    untestable: tuple[str, ...] = ()
    hint: str | None = None
    robustness: Robustness | None = None
    warnings: tuple[str, ...] = ()
    hashes: Mapping[str, str | None] = field(default_factory=dict)
    curves: Mapping[str, pd.DataFrame] = field(default_factory=dict)
    told: bool = True


def describe_inputs(case: Case) -> Inputs:
    """The block `inputs` of a case."""
    return Inputs(
        participant=case.participant.id,
        test=tuple(trial.name for trial in case.test),
        reference=tuple(trial.name for trial in case.reference),
        tasks=case.tasks,
        channels=Channels(True, bool(case.channels), case.has_contact),
    )


def failed_diagnosis(case: Case, reason: str) -> Diagnosis:
    """A diagnosis without a verdict, because a solve failed for this reason."""
    return Diagnosis("failed", reason, case.mode, describe_inputs(case))


def to_json(diagnosis: Diagnosis) -> str:
    """Text of ``result.json``.

    Raises
    ------
    DataError                        the diagnosis breaks a rule of the format; see `check`
    """
    document = _plain({"schema": "gap-result/1", **_fields(diagnosis)})
    del document["curves"], document["told"]
    check(document)
    return json.dumps(document, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def read_result(path: Path) -> dict[str, Any]:
    """A stored ``result.json`` as plain data, checked.

    Raises
    ------
    DataError                        no such file, no JSON, or it breaks a rule of the format
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataError(f"{path}: {error}. Run the diagnosis again.") from error
    check(document)
    return document


def schema() -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) of ``result.json``."""
    return json.loads(resources.files(__package__).joinpath(SCHEMA_FILE).read_text("utf-8"))


def check(document: Mapping[str, Any]) -> None:
    """Refuse a document that breaks the schema or the rules that a schema cannot state.

    Raises
    ------
    DataError                        names the place in the document and what was expected
    """
    fault = best_match(Draft202012Validator(schema()).iter_errors(document))
    if fault is not None:
        place = ".".join(str(part) for part in fault.absolute_path) or "top level"
        raise DataError(f"result.json, {place}: {fault.message}. Correct the code that fills it.")
    faults = [*_number_faults(document)]
    if document["status"] != "failed":
        faults += [*_probability_faults(document), *_interval_faults(document)]
    if faults:
        raise DataError(f"result.json, {'; '.join(faults)}. Correct the code that fills it.")


def _probability_faults(document: Mapping[str, Any]) -> Iterator[str]:
    candidates = document["candidates"]
    p = [candidate["p"] for candidate in candidates]
    total = sum(p) + document["none_p"] + document["no_gap_p"]
    if abs(total - 1.0) > SUM_TOLERANCE:
        yield f"candidates.p, none_p and no_gap_p: sum {total}; expected 1"
    if p != sorted(p, reverse=True):
        yield "candidates: not sorted by p; expected the most probable first"
    for view, regions in document["regions"].items():
        total = sum(region["share"] for region in regions)
        if regions and abs(total - 1.0) > SUM_TOLERANCE:
            yield f"regions.{view}: shares add up to {total}; expected 1"
    labels = {candidate["label"] for candidate in candidates}
    unknown = set(document["set90"]) - labels - {NONE, NO_GAP}
    if unknown:
        yield f"set90: {', '.join(sorted(unknown))} is no candidate"
    for label in labels:
        if label.split(JOIN) != sorted(label.split(JOIN)):
            yield f"candidates: '{label}'; expected its effects in alphabetical order"
    ids = {entry["id"] for entry in document["classes"]}
    for candidate in candidates:
        if candidate["class_id"] is not None and candidate["class_id"] not in ids:
            yield f"candidates: class_id {candidate['class_id']} is no class"


def _interval_faults(document: Mapping[str, Any]) -> Iterator[str]:
    for place, name, value in _leaves(document):
        if name == "ci95" and value is None and not document["warnings"]:
            yield f"{place}: null without a line in warnings; expected the reason there"
        elif name == "ci95" and value is not None and value[0] > value[1]:
            yield f"{place}: {value}; expected the lower end first"


def _number_faults(document: Mapping[str, Any]) -> Iterator[str]:
    for place, _, value in _leaves(document):
        for number in value if isinstance(value, list) else [value]:
            if isinstance(number, float) and not math.isfinite(number):
                yield f"{place}: {number}; expected a finite number or null"


def _leaves(node: Any, place: str = "", name: str = "") -> Iterator[tuple[str, str, Any]]:
    """Place, key and value of everything that is no object and no list of objects."""
    if isinstance(node, Mapping):
        for key, value in node.items():
            yield from _leaves(value, f"{place}.{key}" if place else key, key)
    elif isinstance(node, list) and node and isinstance(node[0], Mapping):
        for i, value in enumerate(node):
            yield from _leaves(value, f"{place}[{i}]", name)
    else:
        yield place, name, node


def _fields(value: Any) -> dict[str, Any]:
    return {entry.name: getattr(value, entry.name) for entry in fields(value)}


def _plain(value: Any) -> Any:
    """Dataclasses, mappings, sequences and numpy numbers as what JSON knows; tables stay."""
    if is_dataclass(value):
        return _plain(_fields(value))
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(item) for item in value]
    return value.item() if hasattr(value, "item") else value
