"""What of files that are sound one by one cannot be compared with each other."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.gap.recording import holes
from scapulohumeral.gap.recording.case import AT_MAXIMUM, Case, EmgSeries, GapTrial
from scapulohumeral.gap.recording.marks import STILL_DEG
from scapulohumeral.gap.recording.movement_window import (
    SPEED_SHARE,
    humerothoracic_speed,
    movement_window,
)
from scapulohumeral.gap.recording.observables import JOINT_QUATERNIONS
from scapulohumeral.model.girdle_range import arm_elevation
from scapulohumeral.model.motion import Motion
from scapulohumeral.model.rotations import ANGLE_NAMES, relative_angle, trial_to_pose

# Degrees over radians is 57; no joint is held so differently in the same tasks.
OTHER_UNIT = 20.0
# Trials of a task that last this many times as long as another are hardly of the same movement.
OTHER_LENGTH = 3.0
# Nobody begins or ends repeats of a task with an arm raised so differently [deg].
OTHER_END_DEG = 40.0
# No person holds a joint so differently in repeats of a task [deg]: skin that slides over a scapula
# is off by half as much, and repeats of an arm turn about its own axis by less. So these are other
# axes, or a sign.
OTHER_JOINT_DEG = {"SC": 25.0, "AC": 25.0, "GH": 40.0}
# Phases that are compared for it, and for how long an arm is still.
JOINT_PHASES, STILL_PHASES = 11, 101
# Share of a movement that a trial may be still for more or less than others of its task: where it
# is exceeded, the arm was adjusted before the movement, or held on the way, in some of them.
OTHER_STILL_SHARE = 0.15
# Peaks of all channels that differ so much are hardly shares of the same maxima.
OTHER_MAXIMUM = 8.0
# Nobody exceeds a maximal contraction by half; without one, another unit is right.
MOST_OF_MVC = 1.5
# Envelopes are low-pass filtered at a few hertz; of a rectified electromyogram at 100 samples per
# second or more, the mean rate of change over the mean is that of 13 Hz or more.
ROUGH_HZ = 10.0


def check_tasks(case: Case) -> None:
    """Refuse reference trials none of which is of a task of the test trials, and misspelt tasks.

    Raises
    ------
    DataError                        names the tasks on both sides, or those that differ by letters
    """
    written: dict[str, str] = {}
    for task in dict.fromkeys(trial.task for trial in case.trials):
        other = written.setdefault(task.casefold(), task)
        if other != task:
            raise DataError(
                f"tasks '{other}' and '{task}' differ by capital letters alone; expected one name "
                "for trials of one task. Rename files, or tasks in the participant file."
            )
    references = dict.fromkeys(trial.task for trial in case.reference)
    if references and not references.keys() & set(case.tasks):
        raise DataError(
            f"tasks of the test trials: {', '.join(case.tasks)}; of the reference trials: "
            f"{', '.join(references)}; expected at least one on both sides. Rename files to "
            "TASK_rN, give trials.<stem>.task in the participant file, or leave out --reference."
        )


def check_repeats(case: Case) -> None:
    """Refuse two trials of a side that are said to be the same repeat of a task.

    Raises
    ------
    DataError                        names both files
    """
    for side in (case.test, case.reference):
        known: dict[tuple[str, int], GapTrial] = {}
        for trial in side:
            if trial.repeat is None:
                continue
            other = known.setdefault((trial.task, trial.repeat), trial)
            if other is not trial:
                raise DataError(
                    f"{trial.source}: repeat {trial.repeat} of task '{trial.task}', as is "
                    f"{other.source}; expected each once. Rename files to TASK_rN, or correct "
                    "trials.<stem> in the participant file: other movements are other tasks."
                )


def check_units(case: Case) -> None:
    """Refuse joints whose angles are in radians in one trial of a task and in degrees in another.

    An elbow may be straight in one trial and bent in another: :func:`unlike_others` says so.

    Raises
    ------
    DataError                        names files and columns
    """
    for task in dict.fromkeys(trial.task for trial in case.trials):
        trials = [trial for trial in case.trials if trial.task == task]
        for joint in ("SC", "GH"):
            if (fault := _other_unit(trials, joint)) is not None:
                raise DataError(f"{fault}, so these are radians; multiply by 180/pi.")


def _other_unit(trials: Sequence[GapTrial], joint: str) -> str | None:
    """In which trial of a task a joint's angles may have another unit, in words; or None."""
    columns = [i for i, name in enumerate(ANGLE_NAMES) if name.startswith(f"{joint}_")]
    of_trials = [(float(np.abs(t.angles_rad[:, columns]).max()), t.source) for t in trials]
    # Zero throughout is what was not measured.
    measured = [(largest, source) for largest, source in of_trials if largest > 0.0]
    if not measured:
        return None
    small, large = (f(measured, key=lambda one: one[0]) for f in (min, max))
    if small[0] > np.deg2rad(2.0 * np.pi) or large[0] <= OTHER_UNIT * small[0]:
        return None
    return (
        f"{small[1]}, columns {joint}_*: all angles are within +-{np.rad2deg(small[0]):.2f} "
        f"deg, in {large[1]} up to {np.rad2deg(large[0]):.0f} deg; expected degrees in all columns"
    )


def _called(trial: GapTrial, case: Case) -> str:
    """Name of a trial, with its side where a trial of the other side has the same."""
    if trial.name not in {t.name for t in case.test} & {t.name for t in case.reference}:
        return trial.name
    return f"{trial.name} ({'test' if any(trial is one for one in case.test) else 'reference'})"


def unlike_others(case: Case) -> list[str]:
    """What looks unlike the other trials, but may be so; a sentence each.

    A fragment of a movement is laid on the same phase as whole ones.
    """
    notes = []
    for task in case.tasks:
        trials = [trial for trial in case.trials if trial.task == task]
        notes += _unlike_lengths(trials, task, case)
        notes += _unlike_ends(trials, task, case)
        notes += _unlike_joints(trials, task, case)
        notes += _unlike_holds(trials, task, case)
        if (fault := _other_unit(trials, "EL")) is not None:
            notes.append(f"{fault}: look whether these are radians, or the arm was straight")
    windows = {trial.name: trial.window_s for trial in case.reference}
    for trial in () if case.one_movement else case.test:
        same = windows.get(trial.name) == trial.window_s
        if same and trial.window_s != movement_window(trial.smooth):
            notes.append(
                f"{trial.name}: test and reference trial of this name have one window, "
                f"{trial.window_s[0]:g} to {trial.window_s[1]:g} s; if it is not that of both, put "
                "a participant.yaml into the folder of each side"
            )
    for trial in case.compared:
        notes += holes.in_words(_called(trial, case), trial.time_s, trial.window_s)
        known = {*case.participant.emg_channels} & {*(trial.emg.channels if trial.emg else ())}
        still = [] if trial.emg is None else sorted(known - {*trial.emg.changing})
        if still:
            notes.append(
                f"{_called(trial, case)}: {', '.join(still)} never changes, so it is compared in "
                "no trial; look whether the electrode was on"
            )
    notes += _numbered(case.tasks)
    tests, references = _peaks(case.test), _peaks(case.reference)
    if common := sorted(tests.keys() & references.keys()):
        high, low = (np.array([one[name] for name in common]) for one in (tests, references))
        unlike = (high > OTHER_MAXIMUM * low) | (low > OTHER_MAXIMUM * high)
        if np.all(unlike):
            notes.append(
                f"EMG reaches {high.max():.2g} in the tests and {low.max():.2g} in the references, "
                "and all channels differ as much: other units, or other maxima"
            )
        else:
            notes += [
                f"{common[i]} reaches {high[i]:.2g} in the tests and {low[i]:.2g} in the "
                "references; look whether the electrode was on in both"
                for i in np.flatnonzero(unlike).tolist()
            ]
    return notes


def _medians_of_sides(
    values: np.ndarray, trials: Sequence[GapTrial], case: Case
) -> tuple[np.ndarray, np.ndarray] | None:
    """Medians of test and of reference trials, of values by trial; None without one of both.

    Where sides differ, each trial is as far from the median of all as those of the other side.
    """
    is_test = np.array([any(trial is one for one in case.test) for trial in trials])
    if case.one_movement or is_test.all() or not is_test.any():
        return None
    return np.median(values[is_test], axis=0), np.median(values[~is_test], axis=0)


def _unlike_lengths(trials: Sequence[GapTrial], task: str, case: Case) -> list[str]:
    """Trials of a task, or else one of its sides, that last much longer or shorter."""
    lengths = np.array([trial.window_s[1] - trial.window_s[0] for trial in trials])
    usual = float(np.median(lengths))
    notes = [
        f"{_called(trial, case)}: the movement lasts {length:.2f} s, those of task {task} "
        f"{usual:.2f} s in the median; look whether it is whole (window_s)"
        for trial, length in zip(trials, lengths, strict=True)
        if not usual / OTHER_LENGTH <= length <= usual * OTHER_LENGTH
    ]
    sides = _medians_of_sides(lengths, trials, case)
    if sides and not notes and max(sides) > OTHER_LENGTH * min(sides):
        notes.append(
            f"test trials of task {task} last {sides[0]:.2f} s in the median, reference trials "
            f"{sides[1]:.2f} s; look whether all are whole (window_s)"
        )
    return notes


def _ends_deg(trial: GapTrial) -> np.ndarray:
    """Elevation of the arm where a movement begins and ends, (2,) [deg]."""
    return np.rad2deg(arm_elevation(trial.moved(2)[1]))


def _still_share(trial: GapTrial) -> float:
    """Share of a movement for which the arm is still."""
    speed = humerothoracic_speed(Motion(*trial.moved(STILL_PHASES)))
    return float(np.mean(speed < SPEED_SHARE * speed.max()))


def _unlike_ends(trials: Sequence[GapTrial], task: str, case: Case) -> list[str]:
    """Trials of a task, or else one of its sides, that begin or end with the arm elsewhere."""
    ends = np.array([_ends_deg(trial) for trial in trials])
    usual = np.median(ends, axis=0)
    notes = [
        f"{_called(trial, case)}: the movement {verb}s with the arm raised by {own[end]:.0f} deg, "
        f"those of task {task} with {usual[end]:.0f} deg in the median; look whether it is whole "
        "(window_s)"
        for trial, own in zip(trials, ends, strict=True)
        for end, verb in enumerate(("begin", "end"))
        if abs(own[end] - usual[end]) > OTHER_END_DEG
    ]
    sides = _medians_of_sides(ends, trials, case)
    if sides and not notes:
        notes = [
            f"test trials of task {task} {verb} with the arm raised by {test:.0f} deg in the "
            f"median, reference trials with {reference:.0f} deg; look whether all are whole "
            "(window_s)"
            for verb, test, reference in zip(("begin", "end"), *sides, strict=True)
            if abs(test - reference) > OTHER_END_DEG
        ]
    return notes


def _unlike_holds(trials: Sequence[GapTrial], task: str, case: Case) -> list[str]:
    """Trials of a task, or else one of its sides, whose arm is still for another share of it."""
    shares = np.array([_still_share(trial) for trial in trials])
    usual = float(np.median(shares))
    notes = [
        f"{_called(trial, case)}: the arm is still for {100.0 * share:.0f} % of the movement, in "
        f"those of task {task} for {100.0 * usual:.0f} % in the median; look whether the window "
        "begins before it (window_s)"
        for trial, share in zip(trials, shares, strict=True)
        if abs(share - usual) > OTHER_STILL_SHARE
    ]
    sides = _medians_of_sides(shares, trials, case)
    if sides and not notes and abs(sides[0] - sides[1]) > OTHER_STILL_SHARE:
        notes.append(
            f"the arm is still for {100.0 * sides[0]:.0f} % of the movement in test trials of task "
            f"{task} (median), for {100.0 * sides[1]:.0f} % in reference trials; look whether "
            "windows begin before it (window_s)"
        )
    return notes


def _unlike_joints(trials: Sequence[GapTrial], task: str, case: Case) -> list[str]:
    """Trials of a task in which a joint is held elsewhere, or never turns."""
    notes = []
    poses = np.stack([trial_to_pose(trial.moved(JOINT_PHASES)[1]) for trial in trials])
    for (joint, limit), part in zip(OTHER_JOINT_DEG.items(), JOINT_QUATERNIONS, strict=True):
        turns = poses[:, :, part]
        still = np.rad2deg(relative_angle(turns[:, :1], turns)).max(axis=1) < STILL_DEG
        if np.any(still):
            names = ", ".join(_called(trials[i], case) for i in np.flatnonzero(still).tolist())
            notes.append(f"{names}: {joint} never turns; look whether it was measured")
        apart = np.rad2deg(relative_angle(turns[:, None], turns[None])).mean(axis=2)
        usual = int(apart.sum(axis=1).argmin())
        notes += [
            f"{_called(trials[i], case)}, columns {joint}_*: {apart[i, usual]:.0f} deg from "
            f"{_called(trials[usual], case)} of task {task}, in the mean over the movement; look "
            "whether axes and signs are the same"
            for i in np.flatnonzero(apart[:, usual] > limit).tolist()
        ]
    return notes


def unlike_envelopes(case: Case) -> list[str]:
    """Why EMG that is compared may be no envelopes over one maximum, a sentence each."""
    if not case.channels:
        return []
    # Trials of both sides may have the same name.
    series = [(trial.name, trial.emg) for trial in case.compared if trial.emg is not None]
    notes = []
    peaks = np.array([one.of(case.channels).max(axis=0) for _, one in series])
    if case.participant.emg_is_of_mvc and np.all(np.abs(peaks - 1.0) <= AT_MAXIMUM):
        notes.append(
            "EMG of all channels peaks at 1 in each trial, and the participant file says "
            "fraction_of_mvc: if each trial was divided by its own maximum, divide by that of "
            "maximal contractions, or write emg.unit: fraction_of_max"
        )
    highest = float(peaks.max())
    if case.participant.emg_is_of_mvc and highest > MOST_OF_MVC:
        notes.append(
            f"EMG reaches {highest:.3g} times the maximal contraction; if these are percent, "
            "divide by 100; if there was no maximal contraction, write emg.unit: fraction_of_max"
        )
    if not case.participant.emg_is_of_mvc and highest > 1.0 + AT_MAXIMUM:
        notes.append(
            f"EMG reaches {highest:.3g}, and the participant file says fractions of a largest "
            "value, which is 1; if these are percent, divide by 100"
        )
    rough = dict.fromkeys(name for name, one in series if _is_rough(one, case.channels))
    if rough:
        notes.append(
            f"EMG of {', '.join(rough)} changes from sample to sample like one that was not "
            "smoothed; send envelopes (rectified, low-pass filtered at a few Hz)"
        )
    return notes


def _is_rough(series: EmgSeries, channels: Sequence[str]) -> bool:
    """Whether most channels change faster than envelopes do, for their level."""
    values = series.of(channels)
    change = np.mean(np.abs(np.diff(values, axis=0)), axis=0)
    level = np.maximum(np.mean(np.abs(values), axis=0), np.finfo(float).tiny)
    rate = 1.0 / float(np.median(np.diff(series.time_s)))
    return bool(np.median(rate * change / level) > 2.0 * np.pi * ROUGH_HZ)


def _peaks(side: Sequence[GapTrial]) -> dict[str, float]:
    """Largest value of each channel that all trials of a side with EMG have."""
    series = [trial.emg for trial in side if trial.emg is not None]
    if not series:
        return {}
    common = set.intersection(*(set(one.channels) for one in series))
    return {
        name: max(float(one.values[:, one.channels.index(name)].max()) for one in series)
        for name in common
    }


def _numbered(tasks: Sequence[str]) -> list[str]:
    """Tasks that look like repeats of one, by names that differ by a number at the end."""
    alike: dict[str, list[str]] = {}
    for task in tasks:
        alike.setdefault(re.sub(r"[ _-]*[rR]?\d+$", "", task), []).append(task)
    return [
        f"{', '.join(names)} count as tasks of their own; if they are repeats of one, name their "
        f"files {stem or 'TASK'}_r1, {stem or 'TASK'}_r2, ... or say the task in `trials` of the "
        "participant file"
        for stem, names in alike.items()
        if len(names) > 1
    ]


def not_compared(case: Case) -> list[str]:
    """What was recorded in some trials but is not compared, one sentence each."""
    known, trials = case.participant.emg_channels, case.compared
    emg = [() if trial.emg is None else trial.emg.channels for trial in trials]
    recorded = {f"EMG channel {name}": [name in channels for channels in emg] for name in known}
    recorded["joint force"] = [trial.contact is not None for trial in trials]
    notes = []
    if any(emg) and not known:
        notes.append(
            f"EMG of {sum(map(bool, emg))} trials is not compared: the participant file has no "
            "emg.channels, which say what muscles lie under each electrode"
        )
    absent = [name for name in known if not any(name in channels for channels in emg)]
    if absent:
        notes.append(
            f"EMG channels {', '.join(absent)} of the participant file are in no trial that is "
            "compared, nor in its companion STEM_emg.csv"
        )
    unused = dict.fromkeys(t.task for t in case.reference if t.task not in case.tasks)
    if unused:
        notes.append(f"reference trials of task {', '.join(unused)} are not used: no test trial")
    for what, has in recorded.items():
        lacking = [
            _called(trial, case) for trial, there in zip(trials, has, strict=True) if not there
        ]
        if any(has) and lacking:
            notes.append(f"{what} is not compared: not recorded in {', '.join(lacking)}")
    return notes
