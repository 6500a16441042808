"""Simple methods that a diagnosis has to beat, on the trials of one blind case.

The prior alone always names the family that most effects of the library belong to; the rules are
what an experienced person would try first. Methods that need the model (cosine, per-sample BIC,
screening) are run by the diagnosis and read from its table ``curves/baselines.csv``; what a black
box and placebos remove of the gap is read from ``curves/controls.csv``.

Letters: F = 51 phase points, C EMG channels.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scapulohumeral.gap.curve_files import read_pairs
from scapulohumeral.gap.labels import NO_GAP, family
from scapulohumeral.gap.recording.case import Case, GapTrial, make_case
from scapulohumeral.gap.recording.participant_file import read_participant_file
from scapulohumeral.gap.recording.trials import read_trials, trial_files
from scapulohumeral.model.rotations import (
    Array,
    quaternion_conjugate,
    quaternion_multiply,
    segment_orientations,
    trial_to_pose,
)

MOST_COMMON = "body/strength_loss"
POINTS = 51
SEEN_SIGMA = 3.0
# Standard deviations between repeats below which a channel counts as noise-free [deg], [1].
LEAST_SD = (0.7, 0.01)
SAME_FACTOR = 0.15
STEADY_SHARE = 0.5
LEAD_S = 0.03


def baseline_families(folder: Path, answer_folder: Path) -> dict[str, str]:
    """Family ``side/family`` that each method names for a case.

    Parameters
    ----------
    folder : case folder with ``test`` and maybe ``reference``
    answer_folder : what the diagnosis wrote; its table of baselines is optional, with the columns
        method and label
    """
    named = {"prior_only": MOST_COMMON, "rule_based": rule_based(read_trial_folders(folder))}
    run = read_pairs(answer_folder, "baselines")
    return named | {method: family(label) for method, label in run.items()}


def control_shares(answer_folder: Path) -> tuple[float | None, float | None]:
    """Shares on held-out trials: of the black box, and the largest of the placebos."""
    written = read_pairs(answer_folder, "controls")
    shares = {name: float(share) for name, share in written.items()}
    box = shares.pop("black box", None)
    return box, max(shares.values(), default=None)


def read_trial_folders(folder: Path) -> Case:
    """The trials of a case folder."""
    own = read_participant_file(folder / "participant.yaml", "published")
    sides = []
    for name in ("test", "reference"):
        files, _ = trial_files(sorted((folder / name).glob("*.csv")))
        sides.append(read_trials(files, own.trials)[0])
    return make_case(own.participant, sides[0], sides[1])


def rule_based(case: Case) -> str:
    """Family by a few rules on mean differences; the most common one without reference trials."""
    if not case.reference:
        return MOST_COMMON
    turn, turn_sigma = _changes(case, _poses, _turns, LEAST_SD[0])
    moved = turn_sigma.max() >= SEEN_SIGMA
    if not case.channels:
        return _moved_only(turn) if moved else NO_GAP
    ratio, change_sigma = _changes(case, _envelopes, _ratios, LEAST_SD[1])
    heard = change_sigma >= SEEN_SIGMA
    if not heard.any():
        return _moved_only(turn) if moved else NO_GAP
    if not moved or (heard.sum() == 1 and change_sigma.max() > turn_sigma.max()):
        return _heard_only(case, ratio, int(heard.sum()))
    if np.median(ratio) > 1.0 and heard.mean() > STEADY_SHARE:
        return "body/hand_load"
    return MOST_COMMON


def _moved_only(turn: Array) -> str:
    """Kinematics alone: growing differences of the scapula are skin, steady ones a frame."""
    size = np.abs(turn)
    start, peak = size[: POINTS // 5].mean(axis=0), size.max(axis=0)
    channel = int(np.argmax(size.mean(axis=0)))
    steady = start[channel] > STEADY_SHARE * peak[channel]
    return "input/frame_misalignment" if steady else "measurement/scapula_sta"


def _heard_only(case: Case, ratio: Array, count: int) -> str:
    """EMG alone: one channel or one factor is a gain, a shift in time a delay."""
    if count > 1 and abs(_lead(case)) > LEAD_S:
        return "measurement/emd"
    if count == 1 or np.std(np.log(ratio)) < SAME_FACTOR:
        return "measurement/emg_gain"
    return MOST_COMMON


def _changes(case: Case, read, compare, least: float) -> tuple[Array, Array]:
    """Change between sides, averaged over tasks, and its size over its standard error."""
    changes, sizes = [], []
    for task in case.tasks:
        sides = [
            np.array([read(trial, case.channels) for trial in trials if trial.task == task])
            for trials in (case.test, case.reference)
        ]
        if not all(len(side) for side in sides):
            continue
        spread = np.sqrt(np.mean([side.var(axis=0, ddof=1).mean(axis=0) for side in sides], axis=0))
        spread = np.maximum(spread[: sides[0].shape[2]], least)
        error = spread * np.sqrt(sum(1.0 / len(side) for side in sides))
        means = [side.mean(axis=0) for side in sides]
        changes.append(compare(*means))
        sizes.append(np.sqrt(np.mean(((means[0] - means[1]) / error) ** 2, axis=0)))
    return np.mean(changes, axis=0), np.max(sizes, axis=0)


def _turns(test: Array, reference: Array) -> Array:
    return test - reference


def _ratios(test: Array, reference: Array) -> Array:
    """Factor between mean envelopes, (C,)."""
    return np.maximum(test.mean(axis=0), 1e-3) / np.maximum(reference.mean(axis=0), 1e-3)


def _poses(trial: GapTrial, channels: Sequence[str]) -> Array:
    """Rotation vectors of clavicle, scapula, humerus from the thorax, and elbow (F, 10) [deg].

    Vectors of rotations from one fixed posture: their differences are near those of the postures.
    """
    pose = trial_to_pose(_at_phase(trial, trial.time_s, trial.angles_rad))
    upright = np.array([np.cos(0.3), 0.0, np.sin(0.3), 0.0])
    columns = []
    for part in segment_orientations(pose).values():
        turn = quaternion_multiply(part, quaternion_conjugate(upright))
        columns.append(2.0 * turn[:, 1:] * np.where(turn[:, :1] < 0, -1.0, 1.0))
    return np.rad2deg(np.hstack([*columns, pose[:, 12:]]))


def _envelopes(trial: GapTrial, channels: Sequence[str]) -> Array:
    """Envelopes (F, C) of the channels that all trials have."""
    assert trial.emg is not None
    return _at_phase(trial, trial.emg.time_s, trial.emg.of(channels))


def _lead(case: Case) -> float:
    """Time [s] by which the envelopes of the test trials lead those of the reference."""
    step = np.mean([np.diff(trial.window_s) for trial in case.test]) / (POINTS - 1)
    shifts = np.arange(-POINTS // 4, POINTS // 4 + 1)
    sides = [
        np.mean([_envelopes(t, case.channels) for t in trials if t.task == case.tasks[0]], axis=0)
        for trials in (case.test, case.reference)
    ]
    middle = slice(POINTS // 4 + 1, -(POINTS // 4 + 1))
    misfit = [np.sum((np.roll(sides[0], s, axis=0) - sides[1])[middle] ** 2) for s in shifts]
    return float(step * shifts[int(np.argmin(misfit))])


def _at_phase(trial: GapTrial, time_s: Array, values: Array) -> Array:
    """Values (F, K) over the movement."""
    at = np.linspace(*trial.window_s, POINTS)
    return np.stack([np.interp(at, time_s, column) for column in values.T], axis=1)
