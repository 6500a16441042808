"""Daily tasks that no calibration has seen: excitations of both kinds of muscles against EMG.

Muscles are generic or calibrated (paper, section on muscle parameter adjustment).

Letters: N nodes, C channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from scapulohumeral.emg.channels import read_channels
from scapulohumeral.emg.envelope import read_envelopes
from scapulohumeral.emg.signal_table import signal_failure
from scapulohumeral.errors import DataError
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solving.solver import Start
from scapulohumeral.problems.model_files import ModelFiles, load_model
from scapulohumeral.problems.posed_problem import (
    SolveSettings,
    hashes,
    header,
    pose,
    read_result,
    solve_posed,
    store,
    unsolved,
)
from scapulohumeral.stages.calibration import calibrated_muscles, calibration_failure
from scapulohumeral.stages.tracking import read_trial, tracking_failure, tracking_target

PARAMETERS = ("generic", "calibrated")


@dataclass(frozen=True)
class ValidationFiles:
    """What one daily task is solved from.

    Attributes
    ----------
    model : of the participant; channels : of EMG; calibration : scalers, or None: generic muscles
    tracked : tracking solution of the task
    """

    model: ModelFiles
    channels: Path
    calibration: Path | None
    tracked: Path


def solve_validation(
    trial: str,
    files: ValidationFiles,
    settings: SolveSettings,
    solution: tuple[Path, Path],
    solver_log: Path,
) -> None:
    """Track one daily task with joint stability; write solution and summary.

    It starts from the task tracked without joint stability: a cold start, whose joint force may
    point anywhere, ends in a poorer optimum of reaching to a shelf (par2).

    A solve that fails is written too, sealed by its status; so is one whose muscles could not be
    calibrated, or whose task could not be tracked.
    """
    model = load_model(files.model)
    tracked = read_solution(files.tracked, allow_failed=True)
    failure = calibration_failure(files.calibration) if files.calibration else ""
    failure = failure or tracking_failure([tracked])
    # Generic muscles complete a problem that is sealed; nothing is solved with them.
    scalers = None if failure else files.calibration
    muscles = calibrated_muscles(model.record, files.channels, scalers)
    recording = read_trial(files.model, trial)
    target = tracking_target(recording, settings.time_step_s)
    posed = pose(model, muscles, target, settings, recording.hand_load_kg)
    if failure:
        result = unsolved(posed, posed.cold_start(), failure, solver_log)
    else:
        result = solve_posed(posed, Start(tracked.free), settings, solver_log)
    others = [files.channels, recording.file, files.tracked]
    others += [files.calibration] if files.calibration else []
    about = header(
        posed,
        result,
        settings,
        participant=files.model.participant.parent.name,
        trial=trial,
        parameters="calibrated" if files.calibration else "generic",
        hand_load_kg=recording.hand_load_kg,
        hashes=hashes(files.model, others, "scapulohumeral.stages.validation"),
    )
    store(read_result(posed, result, about), result, solution, {})


def compare_with_emg(solution: Path, channels: Path, envelope: Path) -> pd.DataFrame:
    """Root mean square of excitation minus EMG per channel, columns channel, rmse.

    A failed solve has no excitations, and EMG that could not be simulated no envelopes: errors are
    not numbers then.
    """
    table = read_channels(channels)
    solved = read_solution(solution, allow_failed=True)
    matrix = table.matrix(solved.muscles.tolist())
    if not solved.optimal or signal_failure(envelope):
        rmse = np.full(len(table.names), np.nan)
    else:
        measured = read_envelopes(envelope, table.names).at(solved.time_s)
        error = solved.excitation @ matrix.T - measured
        rmse = np.sqrt(np.mean(error**2, axis=0))
    return pd.DataFrame({"channel": table.names, "rmse": rmse})


def summarise_validation(
    solutions: Sequence[Path], channels: Path, envelopes: Sequence[Path], summary: Path
) -> None:
    """Write a row per participant, task and channel: rmse_generic, rmse_calibrated, reduction.

    Column recording names the first task that follows the same recording. A recording that is
    solved with several loads in the hand has several rows, and counts once (see
    :func:`one_per_recording`).

    Parameters
    ----------
    solutions : of both kinds of muscles, each with the envelope of its trial beside it

    Raises
    ------
    DataError                        a solution of other muscles
    """
    recorded: dict[tuple[str, bytes], str] = {}
    parts = []
    for solution, envelope in zip(solutions, envelopes, strict=True):
        solved = read_solution(solution, allow_failed=True)
        about = solved.header
        if about["parameters"] not in PARAMETERS:
            raise DataError(f"{solution}: muscles {about['parameters']!r}; expected {PARAMETERS}")
        part = compare_with_emg(solution, channels, envelope)
        part["parameters"] = about["parameters"]
        motion = about["participant"], solved.reference_rad.tobytes()
        part.insert(0, "recording", recorded.setdefault(motion, about["trial"]))
        part.insert(0, "task", about["trial"])
        part.insert(0, "participant", about["participant"])
        parts.append(part)
    long = pd.concat(parts)
    keys = ["participant", "task", "recording", "channel"]
    wide = long.set_index([*keys, "parameters"])["rmse"].unstack()
    # In the order of the solutions; a solve that is missing or failed leaves gaps.
    order = pd.MultiIndex.from_frame(long[keys].drop_duplicates())
    wide = wide.reindex(index=order, columns=list(PARAMETERS)).add_prefix("rmse_")
    wide["reduction"] = 1.0 - wide["rmse_calibrated"] / wide["rmse_generic"]
    wide.reset_index().to_csv(summary, index=False, float_format="%.6g")


def one_per_recording(table: pd.DataFrame) -> pd.DataFrame:
    """Rows of :func:`summarise_validation` of the first task of each recording."""
    return table[table["task"] == table["recording"]]
