"""What the report is made from: result files of one study, read once.

Letters: N nodes, M muscles.
"""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from scapulohumeral.errors import DataError
from scapulohumeral.model.participant import Motion, participant_of, read_motion, read_participant
from scapulohumeral.model.participant_file import list_participants
from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.provenance import CONFIG_FOLDER, last_commit
from scapulohumeral.report.assumptions import Assumption, find_assumptions
from scapulohumeral.report.coordination import Coordination, CoordinationFiles, read_coordination

PUBLISHED = CONFIG_FOLDER / "participants"
TARGETS = CONFIG_FOLDER / "targets.yaml"
FORMULATIONS = ("quaternion", "euler")


@dataclass(frozen=True)
class ReportFiles:
    """Files of one study.

    Attributes
    ----------
    summary : table of all tracking solves
    solutions, summaries : of each of them
    models : model records; thoraxes : fitted ellipsoids; participants : participant.yaml files
    geometry_quality : tables ``<participant>/<formulation>_quality.csv``
    equations : folders, one per formulation
    benchmarks : Snakemake's ``<rule>/<job>.jsonl``
    sources : files that state assumptions
    config : the configuration, of which sections ``solve``, ``weights`` and ``emg`` are told
    coordination : files of EMG, calibration, validation and prediction, as far as there are any
    diagnoses : answers ``result.json`` of gap diagnoses; blind_scores : score cards, or none
    real_cases : table of diagnoses whose cause is known, or none
    speed : records ``side_by_side.json``, ``peers.json``, ``kills.json``, as far as there are any
    targets : limits that results are judged by
    """

    summary: Path
    solutions: Sequence[Path]
    summaries: Sequence[Path]
    models: Sequence[Path]
    thoraxes: Sequence[Path]
    participants: Sequence[Path]
    geometry_quality: Sequence[Path]
    equations: Sequence[Path]
    benchmarks: Sequence[Path]
    sources: Sequence[Path]
    config: Mapping[str, Any]
    coordination: CoordinationFiles = CoordinationFiles()
    diagnoses: Sequence[Path] = ()
    blind_scores: Sequence[Path] = ()
    real_cases: Sequence[Path] = ()
    speed: Sequence[Path] = ()
    targets: Path = TARGETS


@dataclass(frozen=True, eq=False)
class Run:
    """One tracking solve: its summary and its trajectories, converged or not."""

    summary: dict[str, Any]
    solution: Solution

    @property
    def participant(self) -> str:
        """Name of the participant."""
        return self.summary["participant"]

    @property
    def trial(self) -> str:
        """Name of the recorded motion."""
        return self.summary["trial"]

    @property
    def formulation(self) -> str:
        """Coordinates of the spherical joints."""
        return self.summary["formulation"]

    @property
    def failed(self) -> bool:
        """Whether the solver stopped without a solution."""
        return self.summary["status"] != "optimal"

    @property
    def name(self) -> str:
        """Participant, plane and formulation."""
        return f"{self.participant} {self.trial} {self.formulation}"


@dataclass(frozen=True, eq=False)
class TrialRuns:
    """All about one recorded motion: its solves by formulation, and the published simulation."""

    participant: str
    trial: str
    runs: dict[str, Run]
    published: Motion | None
    groups: np.ndarray

    @property
    def any_run(self) -> Run:
        """One of the solves: all have the same mesh and recording."""
        return next(iter(self.runs.values()))


@dataclass(frozen=True, eq=False)
class Study:
    """Everything that the report shows.

    Attributes
    ----------
    summary : one row per solve
    runs : in the order of the files; trials : the same by recorded motion
    models, thoraxes : records by participant
    quality : muscle geometry, one row per participant, formulation and muscle
    equations : headers by formulation; equation_folders : where they are
    benchmarks : one row per measured job: rule, job, seconds, memory_MB
    assumptions : marked in the source files
    coordination : EMG, calibration, validation and prediction
    diagnoses, blind_scores : documents of the gap diagnosis; score cards with their name, `file`
    real_cases : one row per diagnosis of known cause; empty if none was made
    speed : records of runs beside the study, by name
    config : settings of the configuration
    targets : limits that results are judged by; fixed_in : the commit that last changed them
    """

    summary: pd.DataFrame
    runs: list[Run]
    trials: list[TrialRuns]
    models: dict[str, ModelRecord]
    thoraxes: dict[str, dict[str, Any]]
    quality: pd.DataFrame
    equations: dict[str, dict[str, Any]]
    benchmarks: pd.DataFrame
    assumptions: list[Assumption]
    coordination: Coordination
    equation_folders: Sequence[Path]
    diagnoses: list[dict[str, Any]]
    blind_scores: list[dict[str, Any]]
    real_cases: pd.DataFrame
    speed: dict[str, dict[str, Any]]
    config: Mapping[str, Any]
    targets: Mapping[str, Any]
    fixed_in: str

    @property
    def of_published(self) -> bool:
        """Whether any participant is one of the paper's, whose data and values are public."""
        return not set(list_participants(PUBLISHED)).isdisjoint(self.models)

    def solved(self, formulation: str) -> list[Run]:
        """Converged solves of a formulation."""
        return [r for r in self.runs if r.formulation == formulation and not r.failed]

    @property
    def failed(self) -> list[Run]:
        """Solves without a solution."""
        return [r for r in self.runs if r.failed]

    def trial(self, participant: str, name: str) -> TrialRuns | None:
        """One recorded motion, or None if it is no part of the study."""
        matches = [t for t in self.trials if (t.participant, t.trial) == (participant, name)]
        return matches[0] if matches else None


def read_study(files: ReportFiles) -> Study:
    """Read all files.

    Raises
    ------
    DataError                        no solve, or a solution and a summary that do not belong
                                     together
    """
    runs = read_runs(files.summaries, files.solutions)
    models = {record.participant: record for record in map(read_record, files.models)}
    people = {path.parent.name: path.parents[1] for path in files.participants}
    published = {n: read_participant(folder, n).predictions for n, folder in people.items()}
    targets = yaml.safe_load(files.targets.read_text(encoding="utf-8"))
    headers = [_read_json(folder / "header.json") for folder in files.equations]
    return Study(
        summary=pd.read_csv(files.summary),
        runs=runs,
        trials=by_trial(runs, models, files.participants),
        models=models,
        thoraxes={record["participant"]: record for record in map(_read_json, files.thoraxes)},
        quality=_read_quality(files.geometry_quality),
        equations={header["formulation"]: header for header in headers},
        benchmarks=_read_benchmarks(files.benchmarks),
        assumptions=find_assumptions(files.sources),
        coordination=read_coordination(files.coordination, models, published, targets),
        equation_folders=files.equations,
        diagnoses=[_read_json(path) for path in files.diagnoses],
        blind_scores=[{**_read_json(path), "file": path.name} for path in files.blind_scores],
        real_cases=pd.concat([pd.DataFrame(), *map(read_known_cases, files.real_cases)]),
        speed={path.stem: _read_json(path) for path in files.speed},
        config=files.config,
        targets=targets,
        fixed_in=last_commit(files.targets),
    )


def read_known_cases(path: Path) -> pd.DataFrame:
    """A table of cases of known cause; its empty texts stay texts."""
    texts = {"said": "", "status_reason": ""}
    return pd.read_csv(path, dtype=dict.fromkeys(texts, object)).fillna(texts)


def _read_json(path: Path) -> dict[str, Any]:
    return json.loads(path.read_text(encoding="utf-8"))


def read_runs(summaries: Sequence[Path], solutions: Sequence[Path]) -> list[Run]:
    """Tracking solves, converged or not, from files in the same order.

    Raises
    ------
    DataError                        no file, or two that do not belong together
    """
    if not solutions:
        raise DataError("report: no tracking solve. Name a participant and a plane to simulate.")
    runs = []
    for summary, solution in zip(summaries, solutions, strict=True):
        run = Run(_read_json(summary), read_solution(solution, allow_failed=True))
        for key in ("participant", "trial", "formulation", "objective"):
            if run.summary[key] != run.solution.header[key]:
                raise DataError(
                    f"{summary}: {key} is {run.summary[key]}, but {run.solution.header[key]} in "
                    f"{solution}. Delete both files and solve again."
                )
        runs.append(run)
    return runs


def by_trial(
    runs: Sequence[Run], models: Mapping[str, ModelRecord], participants: Sequence[Path]
) -> list[TrialRuns]:
    """Solves sorted by recorded motion.

    Parameters
    ----------
    runs : in any order
    models : model records by participant; participants : their participant.yaml files
    """
    people = {p.parent.name: participant_of(p) for p in participants}
    found: dict[tuple[str, str], dict[str, Run]] = defaultdict(dict)
    for run in runs:
        found[run.participant, run.trial][run.formulation] = run
    trials = []
    for (participant, trial), by_formulation in found.items():
        published = people[participant].trial(trial).published_file
        ordered = {f: by_formulation[f] for f in FORMULATIONS if f in by_formulation}
        groups = models[participant].muscle_groups
        motion = read_motion(published) if published else None
        trials.append(TrialRuns(participant, trial, ordered, motion, np.array(groups)))
    return trials


def _read_quality(paths: Sequence[Path]) -> pd.DataFrame:
    tables = [
        pd.read_csv(path).assign(
            participant=path.parent.name, formulation=path.stem.removesuffix("_quality")
        )
        for path in paths
    ]
    return pd.concat(tables, ignore_index=True)


def _read_benchmarks(paths: Sequence[Path]) -> pd.DataFrame:
    rows = [
        {"rule": path.parent.name, "job": path.stem, **json.loads(line)}
        for path in paths
        for line in path.read_text(encoding="utf-8").splitlines()
    ]
    table = pd.DataFrame(rows, columns=["rule", "job", "s", "max_rss"])
    # Jobs shorter than Snakemake's first sample have no memory: it writes the text "NA".
    table["max_rss"] = pd.to_numeric(table["max_rss"], errors="coerce")
    return table.rename(columns={"s": "seconds", "max_rss": "memory_MB"})
