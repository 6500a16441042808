"""Calibrate strength and fibre length of muscle groups to EMG.

Two estimates: that of the paper, whose scalers lower effort, EMG error and their own distance from
one in one problem, and a refined one, whose excitations agree with EMG while effort decides the
motion alone (:mod:`scapulohumeral.stages.refinement`). The refined one is used from there on.

Letters: N nodes, C channels, G groups.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import norm

from scapulohumeral.documents import read_json
from scapulohumeral.dynamics.hill import MuscleParameters
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.emg.accuracy import channel_gain
from scapulohumeral.emg.channels import Channels, read_channels
from scapulohumeral.emg.envelope import read_envelopes
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.emg.signal_table import signal_failure
from scapulohumeral.errors import DataError, SolveError
from scapulohumeral.model.record import ModelRecord
from scapulohumeral.ocp.emg_term import EmgTerm
from scapulohumeral.ocp.objective import Trajectory
from scapulohumeral.ocp.scalers import Scalers
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.problems.calibrated_groups import muscle_groups
from scapulohumeral.problems.composite import Composite, compose, composite_target
from scapulohumeral.problems.model_files import ModelFiles, ShoulderModel, load_model
from scapulohumeral.problems.posed_problem import (
    PosedProblem,
    SolveSettings,
    Target,
    hashes,
    header,
    pose,
    read_result,
    solve_posed,
    store,
    unsolved,
)
from scapulohumeral.stages.refinement import Evidence, Refined, RefinementSettings, refine
from scapulohumeral.stages.tracking import held_load, tracking_failure

SCHEMA = "calibration/1"
CONVERGED, NOT_CONVERGED, FAILED = "converged", "not converged", "failed"
KINDS = ("force", "fibre")
CALIBRATE_AGAIN = "Calibrate again."
INTERVAL = 0.9


@dataclass(frozen=True)
class CalibrationFiles:
    """What a calibration is made from: tracking solutions and envelopes in the same order."""

    model: ModelFiles
    channels: Path
    tracked: Sequence[Path]
    envelopes: Sequence[Path]


@dataclass(frozen=True)
class CalibrationSettings:
    """How scalers are found and judged.

    Attributes
    ----------
    solve : time step and weights of both estimates, among them ``emg`` and ``parameters``, and how
        the paper's problem is solved; the refinement has a tolerance of its own
    pause_s : pauses of the composite motion
    force_bounds, fibre_bounds : bounds of the scalers [1]
    envelope : how EMG envelopes were made
    refinement : see :class:`RefinementSettings`
    identifiable : largest half width of the 90 % interval of an identifiable scaler, by kind
    """

    solve: SolveSettings
    pause_s: float
    force_bounds: tuple[float, float]
    fibre_bounds: tuple[float, float]
    envelope: EnvelopeSettings
    refinement: RefinementSettings
    identifiable: Mapping[str, float]

    def __post_init__(self) -> None:
        """Refuse envelopes whose gain is not known, before anything is solved."""
        channel_gain(self.envelope)


@dataclass(frozen=True, eq=False)
class _Study:
    """Everything that both estimates share; `missing` says why there is nothing to solve."""

    model: ShoulderModel
    channels: Channels
    scalers: Scalers
    composite: Composite
    envelopes: np.ndarray
    simulated: bool
    hand_load_kg: float
    missing: str

    def posed(self, target: Target, settings: SolveSettings) -> PosedProblem:
        """Problem of the composite motion with generic muscles and what the hand holds."""
        generic = muscle_parameters(self.model.record)
        return pose(self.model, generic, target, settings, self.hand_load_kg)

    @property
    def emg(self) -> EmgTerm:
        names = self.model.record.muscle_names
        return EmgTerm(self.channels.matrix(names), self.envelopes, self.composite.activity)


def calibrate(
    files: CalibrationFiles,
    settings: CalibrationSettings,
    solution: tuple[Path, Path],
    scalers: Path,
    solver_log: Path,
) -> None:
    """Write the paper's solution with its summary, and the scalers of both estimates.

    A calibration that fails is written too, sealed by its status; so is one whose motions have no
    tracking solution, or no EMG because it could not be simulated.
    """
    study = _read(files, settings)
    try:
        first = _paper_estimate(study, files, settings, solution, solver_log)
        refined = _refined_estimate(study, settings, first)
    except SolveError as error:
        print(error, flush=True)
        found = {"status": FAILED, "message": str(error), "groups": {}}
    else:
        found = _found(study, settings, first, refined)
    document = {
        "schema": SCHEMA,
        "participant": files.model.participant.parent.name,
        "emg_simulated": study.simulated,
        **found,
    }
    scalers.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _found(
    study: _Study, settings: CalibrationSettings, first: Trajectory, refined: Refined
) -> dict[str, Any]:
    """What both estimates found, as it is stored."""
    return {
        "status": CONVERGED if refined.converged else NOT_CONVERGED,
        "misfit": refined.misfit,
        "activation_time": float(refined.times[0]),
        "deactivation_time": float(refined.times[1]),
        "iterations": len(refined.history),
        "history": refined.history,
        "groups": describe(study.scalers, refined, first.scalers, settings),
        # Forces of all groups, then fibres.
        "covariance": refined.covariance.tolist(),
    }


def describe(
    scalers: Scalers, refined: Refined, paper: np.ndarray, settings: CalibrationSettings
) -> dict[str, Any]:
    """Value, interval and identifiability of each scaler, by group and kind."""
    sd = np.sqrt(np.diag(refined.covariance)).reshape(refined.values.shape)
    half = norm.ppf(0.5 + INTERVAL / 2) * sd
    bounds = (scalers.force_bounds, scalers.fibre_bounds)
    groups: dict[str, Any] = {}
    for column, name in enumerate(scalers.names):
        groups[name] = {}
        for row, kind in enumerate(KINDS):
            value, width = float(refined.values[row, column]), float(half[row, column])
            at_bound = min(value - bounds[row][0], bounds[row][1] - value) < 1e-3
            groups[name][kind] = {
                "value": value,
                "ci90": [value - width, value + width],
                "identifiable": bool(width <= settings.identifiable[kind] and not at_bound),
                "at_bound": bool(at_bound),
                "paper_problem": float(paper[row, column]),
            }
    return groups


def calibration_failure(path: Path) -> str:
    """Why a calibration is no result, and what to do; empty if it is one."""
    return failure_of(read_json(path, CALIBRATE_AGAIN))


def failure_of(document: Mapping[str, Any]) -> str:
    """:func:`calibration_failure` of what was read."""
    # Published scalers have no status.
    status = document.get("status", CONVERGED)
    if status == FAILED:
        return f"calibration failed: {document['message']}"
    if status == NOT_CONVERGED:
        return (
            f"calibration did not converge in {document['iterations']} iterations; look at its key "
            "history, raise calibration.refinement.iterations, then calibrate again"
        )
    return ""


def read_scalers(path: Path, scalers: Scalers) -> np.ndarray:
    """Calibrated values, shape (2, G), forces first.

    Raises
    ------
    SolveError                       a calibration that failed: its values are no result
    DataError                        no such file, no JSON, or a scaler that is missing
    """
    document = read_json(path, CALIBRATE_AGAIN)
    if failure := failure_of(document):
        raise SolveError(f"{path}: {failure}. Its scalers are no result")
    groups = document.get("groups", {})
    missing = [
        f"{n} {kind}" for n in scalers.names for kind in KINDS if kind not in groups.get(n, {})
    ]
    if missing:
        raise DataError(f"{path}, groups: no {', '.join(missing)}. {CALIBRATE_AGAIN}")
    return np.array([[groups[name][kind]["value"] for name in scalers.names] for kind in KINDS])


def read_covariance(path: Path) -> np.ndarray:
    """Covariance (2 G, 2 G) of the calibrated values, forces of all groups first.

    Raises
    ------
    DataError                        a calibration that was written without it
    """
    document = read_json(path, CALIBRATE_AGAIN)
    if "covariance" not in document:
        raise DataError(f"{path}: no key covariance. {CALIBRATE_AGAIN}")
    return np.array(document["covariance"])


def calibrated_muscles(
    record: ModelRecord, channels: Path, calibration: Path | None
) -> MuscleParameters:
    """Muscle parameters of a participant: calibrated, or generic without a calibration."""
    generic = muscle_parameters(record)
    if calibration is None:
        return generic
    scalers = muscle_groups(record, read_channels(channels))
    return scalers.apply(generic, read_scalers(calibration, scalers))


def _read(files: CalibrationFiles, settings: CalibrationSettings) -> _Study:
    motions = [read_solution(path, allow_failed=True) for path in files.tracked]
    composite = compose(motions, settings.solve.time_step_s, settings.pause_s)
    channels = read_channels(files.channels)
    model = load_model(files.model)
    table = np.zeros((len(composite.time_s), len(channels.names)))
    simulated, missing = False, [tracking_failure(motions)]
    for motion, path in zip(motions, files.envelopes, strict=True):
        if failure := signal_failure(path):
            missing.append(failure)
            simulated = True
            continue
        envelopes = read_envelopes(path, channels.names)
        simulated |= envelopes.simulated
        start, stop = composite.nodes[motion.header["trial"]]
        table[start:stop] = envelopes.at(motion.time_s)
    return _Study(
        model=model,
        channels=channels,
        scalers=replace(
            muscle_groups(model.record, channels),
            force_bounds=settings.force_bounds,
            fibre_bounds=settings.fibre_bounds,
        ),
        composite=composite,
        envelopes=table,
        simulated=simulated,
        hand_load_kg=held_load(files.model, composite.nodes),
        missing="; ".join(dict.fromkeys(filter(None, missing))),
    )


def _paper_estimate(
    study: _Study,
    files: CalibrationFiles,
    settings: CalibrationSettings,
    paths: tuple[Path, Path],
    solver_log: Path,
) -> Trajectory:
    """Solve the paper's problem, store it, and return its trajectory with the scalers.

    Raises
    ------
    SolveError                       the solve failed, or there is no motion to follow
    """
    target = composite_target(study.composite, emg=study.emg)
    posed = replace(study.posed(target, settings.solve), scalers=study.scalers)
    start = study.composite.trajectory
    if study.missing:
        result = unsolved(posed, start, study.missing, solver_log)
    else:
        result = solve_posed(posed, start, settings.solve, solver_log)
    about = header(
        posed,
        result,
        settings.solve,
        participant=files.model.participant.parent.name,
        trial="composite",
        emg_simulated=study.simulated,
        hand_load_kg=study.hand_load_kg,
        hashes=hashes(
            files.model,
            [files.channels, *files.tracked, *files.envelopes],
            "scapulohumeral.stages.calibration",
        ),
    )
    store(read_result(posed, result, about), result, paths, {})
    if not result.optimal:
        raise SolveError(f"{result.message}. Look at {solver_log}")
    return posed.layout().split(result.point.free)


def _refined_estimate(study: _Study, settings: CalibrationSettings, first: Trajectory) -> Refined:
    """Refine from the motion of the paper's problem, without EMG in the objective."""
    posed = study.posed(composite_target(study.composite), settings.solve)
    evidence = Evidence(
        channels=study.emg.channels,
        envelopes=study.envelopes,
        nodes=study.composite.nodes,
        envelope=settings.envelope,
        step_s=settings.solve.time_step_s,
    )
    none = np.ones((2, 0))
    start = Start(posed.layout().join(replace(first, scalers=none)))
    return refine(posed, study.scalers, evidence, start, settings.refinement)
