"""Results beyond tracking that the report shows: EMG, calibration, validation and prediction.

All of them are optional: a study without predictions has no files of them, and its report says so.

Letters: N nodes, C channels, M muscle elements.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.emg.channels import Channels, read_channels
from scapulohumeral.emg.envelope import Envelopes, read_envelopes
from scapulohumeral.emg.signal_table import signal_failure
from scapulohumeral.model.motion import Motion, read_motion
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.quantities.joint_loading import GlenohumeralLoad
from scapulohumeral.quantities.paper import CUFF_MUSCLES, CUFF_STABILITY_WEIGHT
from scapulohumeral.quantities.prediction_rows import solution_load
from scapulohumeral.quantities.segment_angles import thorax_angles
from scapulohumeral.report.prediction.judged import Judged, read_judged
from scapulohumeral.stages.calibration import failure_of
from scapulohumeral.stages.prediction import Condition

# The condition that all others are compared with.
HEALTHY = "healthy"


@dataclass(frozen=True)
class CoordinationFiles:
    """Files of EMG, calibration, validation and prediction; empty where the study has none.

    Attributes
    ----------
    channels : table of EMG channels
    envelopes, emg_quality : ``<participant>/<trial>_envelope.csv`` and ``_quality.json``
    calibrations : scored scalers, one per participant
    validation : table of errors; validation_solutions : of the daily tasks
    predictions, prediction_summaries : in the same order
    prediction_summary, rhythm : tables of all predictions
    spreads : tables of what uncertain scalers do to predictions
    against_recording, against_published : tables of their distances
    against_tasks : table of distances of predicted daily tasks
    geometry_audit : table of muscle geometry against OpenSim along predictions
    ladder : table of the steps from the authors' problem to the study's own
    sensitivity : table of what weights, mesh and start change
    postures : table of static postures
    held : table of predictions whose girdle is held to a motion
    tried : table of variants against the recordings
    recovery : table of calibrations to arms of other structure
    moment_arms, joint_force : published measurements (config/literature)
    geometry : muscle geometry of quaternion models ``<participant>/quaternion.npz``
    """

    channels: Sequence[Path] = ()
    envelopes: Sequence[Path] = ()
    emg_quality: Sequence[Path] = ()
    calibrations: Sequence[Path] = ()
    validation: Sequence[Path] = ()
    validation_solutions: Sequence[Path] = ()
    predictions: Sequence[Path] = ()
    prediction_summaries: Sequence[Path] = ()
    prediction_summary: Sequence[Path] = ()
    rhythm: Sequence[Path] = ()
    spreads: Sequence[Path] = ()
    against_recording: Sequence[Path] = ()
    against_published: Sequence[Path] = ()
    against_tasks: Sequence[Path] = ()
    geometry_audit: Sequence[Path] = ()
    ladder: Sequence[Path] = ()
    sensitivity: Sequence[Path] = ()
    postures: Sequence[Path] = ()
    held: Sequence[Path] = ()
    tried: Sequence[Path] = ()
    recovery: Sequence[Path] = ()
    moment_arms: Sequence[Path] = ()
    joint_force: Sequence[Path] = ()
    geometry: Sequence[Path] = ()


@dataclass(frozen=True, eq=False)
class EmgTrial:
    """Envelopes (T, C) of one trial and the outcome of its quality checks.

    Without envelopes the EMG could not be simulated; `quality` says why in its key failure.
    """

    participant: str
    trial: str
    envelopes: Envelopes | None
    quality: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class Prediction:
    """One predicted motion: solution, summary with certificate, and the model it is of."""

    solution: Solution
    summary: Mapping[str, Any]
    record: ModelRecord

    @property
    def participant(self) -> str:
        """Name of the participant."""
        return self.solution.header["participant"]

    @cached_property
    def condition(self) -> Condition:
        """The shoulder that was predicted."""
        return Condition(**self.solution.header["condition"])

    @property
    def failed(self) -> bool:
        """Whether the solver stopped without a solution."""
        return not self.solution.optimal

    @property
    def limited(self) -> frozenset[str]:
        """Muscles that have lost some of their active force."""
        condition = self.condition
        return frozenset(condition.muscles if condition.capacity < 1.0 else ())

    @property
    def problem(self) -> tuple[Any, ...]:
        """What tells its problem from others; equal for predictions from several starts."""
        condition = self.condition
        return (
            condition.parameters,
            condition.w_gh,
            self.limited,
            condition.capacity,
            condition.girdle_stiffness_Nm_per_rad,
        )

    @property
    def planes(self) -> dict[str, slice]:
        """Nodes of each elevation."""
        planes = self.solution.header["planes"]
        return {plane: slice(*limits) for plane, limits in planes.items()}

    @cached_property
    def angles(self) -> np.ndarray:
        """Angles in the thorax, shape (N, 10) [deg]."""
        return thorax_angles(self.solution.pose)

    @cached_property
    def load(self) -> GlenohumeralLoad:
        """Load of the glenoid."""
        return solution_load(self.solution, self.record)


@dataclass(frozen=True, eq=False)
class Cases:
    """Solved predictions of one participant by their part in the study; failed ones are in none.

    Attributes
    ----------
    predictions : all solved ones
    published : published predictions by name
    whole : name of the condition with the full force of the muscles that others are compared with
    """

    participant: str
    predictions: tuple[Prediction, ...]
    published: Mapping[str, Motion]
    whole: str = HEALTHY

    @property
    def headline(self) -> tuple[Prediction, ...]:
        """First solved prediction of each problem; further ones reach it from another start."""
        first: dict[tuple[Any, ...], Prediction] = {}
        # That which others are compared with stands for its problem, wherever it was asked for.
        for prediction in sorted(self.predictions, key=lambda p: p.condition.name != self.whole):
            first.setdefault(prediction.problem, prediction)
        return tuple(first.values())

    @property
    def healthy(self) -> Prediction | None:
        """Muscles as the study has them for the participant, with their full force."""
        return self._first(lambda p: p.condition.name == self.whole)

    @property
    def generic(self) -> Prediction | None:
        """Generic muscles with their full force, beside calibrated ones."""
        healthy = self.healthy
        if healthy is not None and healthy.condition.parameters == "generic":
            return None
        return self._first(lambda p: p.condition.parameters == "generic" and not p.limited)

    @property
    def sweep(self) -> tuple[Prediction, ...]:
        """Cuff without force, by weight of joint stability."""
        found = [p for p in self._cuff if p.condition.capacity == 0.0]
        return tuple(sorted(found, key=lambda p: p.condition.w_gh))

    @property
    def cuff(self) -> Prediction | None:
        """Cuff without force at the paper's weight of joint stability."""
        found = [p for p in self.sweep if p.condition.w_gh == CUFF_STABILITY_WEIGHT]
        return found[0] if found else None

    @property
    def cuff_at_healthy_weight(self) -> Prediction | None:
        """Cuff without force at the weight of the healthy prediction."""
        found = [p for p in self.graded if p.condition.capacity == 0.0]
        return found[0] if found else None

    @property
    def graded(self) -> tuple[Prediction, ...]:
        """Healthy shoulder and partial loss of the cuff at the same weight, most capacity first."""
        healthy = self.healthy
        if healthy is None:
            return ()
        partial = [p for p in self._cuff if p.condition.w_gh == healthy.condition.w_gh]
        return (healthy, *sorted(partial, key=lambda p: -p.condition.capacity))

    @property
    def isolated(self) -> tuple[Prediction, ...]:
        """Loss of other muscles than the paper's two."""
        return tuple(p for p in self._lost if p.limited != CUFF_MUSCLES)

    @property
    def _cuff(self) -> list[Prediction]:
        return [p for p in self._lost if p.limited == CUFF_MUSCLES]

    @property
    def _lost(self) -> list[Prediction]:
        """Losses of force in the shoulder that they are compared with, generic or calibrated."""
        of_healthy = {"generic", "calibrated"}
        if self.healthy is not None:
            of_healthy = {self.healthy.condition.parameters}
        return [p for p in self._as_modelled if p.limited and p.condition.parameters in of_healthy]

    @property
    def _as_modelled(self) -> list[Prediction]:
        """Headline predictions with joints as in the model: others are compared with nothing."""
        return [p for p in self.headline if p.condition.girdle_stiffness_Nm_per_rad is None]

    def _first(self, chosen: Any) -> Prediction | None:
        return next((p for p in self._as_modelled if chosen(p)), None)


@dataclass(frozen=True, eq=False)
class Coordination:
    """All results beyond tracking.

    Attributes
    ----------
    channels : EMG channels, None without EMG
    emg : trials with EMG
    calibrations : documents by participant, of those that converged
    uncalibrated : why the other calibrations are no result, by participant
    validation : errors by participant, task and channel; empty without daily tasks
    tasks : solutions by participant, task and parameters
    predictions : all, failed ones included; cases : the solved ones by participant
    prediction_table, rhythm : tables of results/prediction, empty without predictions
    files : where they come from
    targets : limits of config/targets.yaml
    judged : distances of predictions and their limits, None without predictions
    ladder : steps from the authors' problem to the study's own, empty if it was not climbed
    sensitivity : what weights, mesh and start change, empty if it was not computed
    postures : girdles of least effort under a still arm, empty if they were not computed
    held : prices of girdles held to a motion, empty if they were not computed
    tried : variants against the recordings, empty if they were not computed
    recovery : calibrations to arms of other structure, empty if they were not computed
    spreads : what uncertain scalers do to predictions, empty without calibrated predictions
    audit : muscle geometry against OpenSim along predictions, empty without predictions
    """

    channels: Channels | None
    emg: list[EmgTrial]
    calibrations: dict[str, dict[str, Any]]
    validation: pd.DataFrame
    tasks: dict[tuple[str, str, str], Solution]
    predictions: list[Prediction]
    cases: dict[str, Cases]
    prediction_table: pd.DataFrame
    rhythm: pd.DataFrame
    files: CoordinationFiles
    targets: Mapping[str, Any]
    judged: Judged | None = None
    ladder: pd.DataFrame = field(default_factory=pd.DataFrame)
    sensitivity: pd.DataFrame = field(default_factory=pd.DataFrame)
    postures: pd.DataFrame = field(default_factory=pd.DataFrame)
    held: pd.DataFrame = field(default_factory=pd.DataFrame)
    tried: pd.DataFrame = field(default_factory=pd.DataFrame)
    recovery: pd.DataFrame = field(default_factory=pd.DataFrame)
    uncalibrated: dict[str, str] = field(default_factory=dict)
    spreads: pd.DataFrame = field(default_factory=pd.DataFrame)
    audit: pd.DataFrame = field(default_factory=pd.DataFrame)

    @property
    def emg_word(self) -> str:
        """What to call the EMG of this study: "simulated EMG" if any of it is."""
        simulated = any(trial.quality["simulated"] for trial in self.emg)
        simulated |= any(c["emg_simulated"] for c in self.calibrations.values())
        return "simulated EMG" if simulated else "EMG"

    def envelopes(self, participant: str, trial: str) -> Envelopes | None:
        """Envelopes of one trial, None if it has no EMG."""
        found = [e for e in self.emg if (e.participant, e.trial) == (participant, trial)]
        return found[0].envelopes if found else None


def read_coordination(
    files: CoordinationFiles,
    models: Mapping[str, ModelRecord],
    published: Mapping[str, Mapping[str, Path]],
    targets: Mapping[str, Any],
) -> Coordination:
    """Read all files.

    Parameters
    ----------
    files : any of them may be missing
    models : model records; published : files of published predictions; both by participant
    targets : limits of config/targets.yaml
    """
    channels = read_channels(files.channels[0]) if files.channels else None
    predictions = _read_predictions(files, models)
    documents = [json.loads(p.read_text(encoding="utf-8")) for p in files.calibrations]
    failures = {document["participant"]: failure_of(document) for document in documents}
    return Coordination(
        channels=channels,
        emg=_read_emg(files, channels),
        calibrations={
            name: document
            for name, document in zip(failures, documents, strict=True)
            if not failures[name]
        },
        uncalibrated={name: failure for name, failure in failures.items() if failure},
        validation=_read_table(files.validation),
        tasks=_read_tasks(files.validation_solutions),
        predictions=predictions,
        cases={
            name: _cases(name, predictions, published.get(name, {}))
            for name in dict.fromkeys(p.participant for p in predictions)
        },
        prediction_table=_read_table(files.prediction_summary),
        rhythm=_read_table(files.rhythm),
        files=files,
        targets=targets,
        judged=_read_judged(files, tuple(models), targets),
        ladder=_read_table(files.ladder),
        sensitivity=_read_table(files.sensitivity),
        postures=_read_table(files.postures),
        held=_read_table(files.held),
        tried=_read_table(files.tried),
        recovery=_read_table(files.recovery),
        spreads=_read_table(files.spreads),
        audit=_read_table(files.geometry_audit),
    )


def _read_judged(
    files: CoordinationFiles, participants: tuple[str, ...], targets: Mapping[str, Any]
) -> Judged | None:
    if not files.against_recording:
        return None
    return read_judged(
        targets,
        files.against_recording[0],
        files.against_published[0],
        participants,
        files.against_tasks,
        files.rhythm,
    )


def _read_table(paths: Sequence[Path]) -> pd.DataFrame:
    return pd.concat([pd.read_csv(path) for path in paths]) if paths else pd.DataFrame()


def _read_emg(files: CoordinationFiles, channels: Channels | None) -> list[EmgTrial]:
    if channels is None:
        return []
    return [
        EmgTrial(
            participant=envelope.parent.name,
            trial=envelope.stem.removesuffix("_envelope"),
            envelopes=(
                None if signal_failure(envelope) else read_envelopes(envelope, channels.names)
            ),
            quality=json.loads(quality.read_text(encoding="utf-8")),
        )
        for envelope, quality in zip(files.envelopes, files.emg_quality, strict=True)
    ]


def _read_tasks(paths: Sequence[Path]) -> dict[tuple[str, str, str], Solution]:
    solutions = [read_solution(path, allow_failed=True) for path in paths]
    return {
        (s.header["participant"], s.header["trial"], s.header["parameters"]): s for s in solutions
    }


def _read_predictions(
    files: CoordinationFiles, models: Mapping[str, ModelRecord]
) -> list[Prediction]:
    predictions = []
    for path, summary in zip(files.predictions, files.prediction_summaries, strict=True):
        solution = read_solution(path, allow_failed=True)
        record = models[solution.header["participant"]]
        document = json.loads(summary.read_text(encoding="utf-8"))
        predictions.append(Prediction(solution, document, record))
    return predictions


def _cases(
    participant: str, predictions: Sequence[Prediction], published: Mapping[str, Path]
) -> Cases:
    own = [p for p in predictions if p.participant == participant]
    # One that was asked for and failed is replaced by no other.
    asked = [p.condition.name for p in own if not p.limited]
    whole = HEALTHY if HEALTHY in asked or not asked else asked[0]
    motions = {name: read_motion(path) for name, path in published.items()}
    return Cases(participant, tuple(p for p in own if not p.failed), motions, whole)
