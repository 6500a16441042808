"""Track a recorded motion: from files of a participant to a stored solution.

Letters: N nodes.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.errors import DataError
from scapulohumeral.model.motion import Motion, resampled
from scapulohumeral.model.participant import Trial, participant_of
from scapulohumeral.model.participant_file import common_load
from scapulohumeral.ocp.solution import Solution
from scapulohumeral.problems.model_files import ModelFiles, load_model
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
)


def solve_tracking(
    trial: str,
    files: ModelFiles,
    settings: SolveSettings,
    solution: Path,
    summary: Path,
    solver_log: Path,
) -> None:
    """Track one recorded trial; write the solution and its summary.

    A solve that fails is written too, sealed by its status.

    Raises
    ------
    DataError, ConfigError           files of the participant that cannot be used
    SolveError                       no start: the muscles cannot hold the recorded motion
    """
    recording = read_trial(files, trial)
    posed = pose_tracking(recording, files, settings)
    result = solve_posed(posed, posed.cold_start(), settings, solver_log)
    about = header(
        posed,
        result,
        settings,
        participant=files.participant.parent.name,
        trial=trial,
        hand_load_kg=recording.hand_load_kg,
        hashes=hashes(files, [recording.file], "scapulohumeral.stages.tracking"),
    )
    store(read_result(posed, result, about), result, (solution, summary), {})


def tracking_failure(motions: Iterable[Solution]) -> str:
    """Which tracked motions are no result; empty if all are one."""
    failed = [motion.header["trial"] for motion in motions if not motion.optimal]
    return f"tracking of {', '.join(failed)} failed" if failed else ""


def read_trial(files: ModelFiles, trial: str) -> Trial:
    """One recorded trial of a participant."""
    return participant_of(files.participant).trial(trial)


def held_load(files: ModelFiles, trials: Iterable[str]) -> float:
    """What a participant's hand holds in trials that are followed in one motion [kg].

    Raises
    ------
    ConfigError                      the trials differ in it
    """
    person = participant_of(files.participant)
    loads = {trial: person.trial(trial).hand_load_kg for trial in trials}
    return common_load(files.participant, loads)


def pose_tracking(recording: Trial, files: ModelFiles, settings: SolveSettings) -> PosedProblem:
    """The tracking problem of one recorded trial with generic muscle parameters."""
    model = load_model(files)
    return pose(
        model,
        muscle_parameters(model.record),
        tracking_target(recording, settings.time_step_s),
        settings,
        recording.hand_load_kg,
    )


def tracking_target(recording: Trial, step: float) -> Target:
    """A recorded motion on the mesh."""
    time_s, angles = resample(recording.motion, step, recording.file)
    return Target(time_s, angles, np.ones(len(time_s)))


def resample(motion: Motion, step: float, source: Path) -> tuple[np.ndarray, np.ndarray]:
    """Recorded joint angles on the mesh: times (N,) [s] and angles (N, 10) [rad].

    The mesh starts with the recording and ends with the last whole interval inside it.

    Raises
    ------
    DataError
        If the recording is shorter than ten intervals.
    """
    duration = motion.time_s[-1] - motion.time_s[0]
    intervals = int(duration / step + 1e-9)
    if intervals < 10:
        raise DataError(
            f"{source}: the recording lasts {duration:.2f} s, which is {intervals} intervals of "
            f"{step} s; expected 10 or more. Choose a smaller solve.time_step_s"
        )
    time_s = motion.time_s[0] + step * np.arange(intervals + 1)
    return time_s, resampled(motion, time_s)
