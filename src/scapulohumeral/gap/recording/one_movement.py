"""Whether test and reference trials recorded the same movements, with two systems at once.

Skin markers against bone pins, one set of markers against another: both sides then differ by what
acts on the record and by nothing else. Trials say so themselves: their times are the same, the arm
rises alike, and far more so than in another repeat of the task. One trial of each task does not
tell: whoever guides or simulates a movement may repeat it as closely. Rates of both systems may
differ: then records start and end together, and are compared at the times of the slower one.

Letters: L pairs of trials.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from scapulohumeral.errors import DataError
from scapulohumeral.gap.effects.frames import elevation
from scapulohumeral.gap.recording.case import Case, GapTrial
from scapulohumeral.model.rotations import Array, trial_to_pose

# Times that differ by less are the same [s]: files are rounded.
SAME_TIME_S = 1e-3
# Envelopes that differ by less are the same [fraction of MVC].
SAME_EMG = 1e-3
# Share by which the speed of elevation in one record of a movement may differ from that in the
# other. Repeats of two people differ by 0.19 or more (43 pairs, on the clock or stretched to one
# length), simulated ones that last as long by 0.34 or more; records of one movement that turn each
# segment by smooth errors of 1 deg, by 0.03 to 0.08. Skin of the upper arm hardly changes it
# (Hamming et al. 2012, J Biomech 45: 1161-1168: elevation is off by up to 4 deg).
SAME_RISE = 0.15
# A partner is at most so far from a trial, over the nearest other repeat of the task, for at least
# so many trials.
NEARER, CONFIRMED = 1.0 / 3.0, 2
# What an answer to them says.
ONE_MOVEMENT = (
    "test and reference trials count as records of the same movements, whose times and speed of "
    "elevation they share: only what acts on the record is considered. Simulations that follow one "
    "arm look the same: name them with --simulated"
)


Pairs = Sequence[tuple[GapTrial, GapTrial]]


def aligned(case: Case) -> Case:
    """The case with `one_movement` if its trials say that; else as it is. See :func:`stated`."""
    pairs = _pairs(case)
    if not pairs or not _alike(pairs) or not _confirmed(pairs, case.reference):
        return case
    return _paired(case, pairs)


def stated(case: Case) -> Case:
    """The case with `one_movement`, as somebody says who knows.

    Each test trial then stands at the place of its partner, and both have that one's window, as
    far as both were recorded; reference trials without a partner are left out.

    Raises
    ------
    DataError                        a test trial has no partner of its own
    """
    pairs = _pairs(case)
    if not pairs:
        names = ", ".join(one.name for one in case.test)
        raise DataError(
            f"{names}: not each of them has a reference trial of its task with the same times and "
            "EMG; expected that of records of one movement, at other rates the same first and last "
            "times. Resample both records onto one time base, or leave out --one-movement."
        )
    return _paired(case, pairs)


def perhaps(case: Case) -> bool:
    """Whether both sides may have recorded the same movements, though trials do not prove it."""
    pairs = _pairs(case)
    return not case.one_movement and bool(pairs) and _alike(pairs)


def _paired(case: Case, pairs: Pairs) -> Case:
    windows = [_window(one, partner) for one, partner in pairs]
    test, reference = (
        tuple(replace(one, window_s=window) for one, window in zip(side, windows, strict=True))
        for side in zip(*pairs, strict=True)
    )
    return replace(case, test=test, reference=reference, one_movement=True)


def _window(one: GapTrial, partner: GapTrial) -> tuple[float, float]:
    """Window of the partner, as far as the trial was recorded."""
    start, end = partner.window_s
    return max(start, float(one.time_s[0])), min(end, float(one.time_s[-1]))


def _pairs(case: Case) -> Pairs:
    """Each test trial with its partner; none if one lacks a partner of its own."""
    pairs = [(one, _partner(one, case.reference)) for one in case.test]
    found = [(one, partner) for one, partner in pairs if partner is not None]
    own = {id(partner) for _, partner in found}
    return found if len(own) == len(case.test) else []


def _alike(pairs: Pairs) -> bool:
    """Whether the arm rises alike in both of all pairs."""
    return rise_apart(*zip(*pairs, strict=True)) <= SAME_RISE


def _confirmed(pairs: Pairs, reference: Sequence[GapTrial]) -> bool:
    """Whether partners are nearer than other repeats, for as many trials as it takes.

    Repeats with other times are other movements by these alone.
    """
    compared = 0
    for one, partner in pairs:
        others = [o for o in reference if o.task == one.task and o is not partner]
        apart = [rise_apart([one], [o]) for o in others if _same_times(one, o)]
        if rise_apart([one], [partner]) > NEARER * min(apart, default=np.inf):
            return False
        compared += bool(others)
    return compared >= CONFIRMED


def _partner(one: GapTrial, others: Sequence[GapTrial]) -> GapTrial | None:
    """The trial of the same task that has the same times and rises most alike; None without one."""
    able = [
        other
        for other in others
        if other.task == one.task and _same_times(one, other) and _same_muscles(one, other)
    ]
    return min(able, key=lambda other: rise_apart([one], [other]), default=None)


def _same_times(one: GapTrial, other: GapTrial) -> bool:
    """Whether first and last times are the same, as two systems that start together have them.

    At one rate nearest frames are half a frame apart at most. The slower of two may miss up to one.
    """
    frame = max(float(np.median(np.diff(trial.time_s))) for trial in (one, other))
    apart = np.abs(one.time_s[[0, -1]] - other.time_s[[0, -1]])
    missed = 0.5 * frame if len(one.time_s) == len(other.time_s) else frame
    return bool(np.all(apart < missed + SAME_TIME_S))


def _same_muscles(one: GapTrial, other: GapTrial) -> bool:
    """Whether EMG does not contradict that both are one movement: one system records it."""
    if one.emg is None or other.emg is None:
        return True
    if one.emg.channels != other.emg.channels:
        return False
    times = _shared(one.emg.time_s, other.emg.time_s)
    values, others = (
        np.column_stack([np.interp(times, emg.time_s, own) for own in emg.values.T])
        for emg in (one.emg, other.emg)
    )
    return bool(np.allclose(values, others, atol=SAME_EMG))


def _shared(time_s: Array, other_s: Array) -> Array:
    """Times of the slower of two records at which both were recorded."""
    slower, faster = sorted((time_s, other_s), key=len)
    return slower[(slower >= faster[0] - SAME_TIME_S) & (slower <= faster[-1] + SAME_TIME_S)]


def rise_apart(trials: Sequence[GapTrial], partners: Sequence[GapTrial]) -> float:
    """How far speeds of elevation of trials are from those of their partners, (L,) each.

    Returns
    -------
    float                            root of the squares of differences over those of the partners
    """
    left = whole = 0.0
    for one, partner in zip(trials, partners, strict=True):
        times = _shared(one.time_s, partner.time_s)
        rise, other = _rise(one, times), _rise(partner, times)
        left += float(np.sum((rise - other) ** 2))
        whole += float(np.sum(other**2))
    return float(np.sqrt(left / max(whole, np.finfo(float).tiny)))


def _rise(trial: GapTrial, times: Array) -> Array:
    """Speed of elevation [rad/s] between some times [s]."""
    raised = elevation(trial_to_pose(trial.smooth.angles_rad))
    return np.diff(np.interp(times, trial.smooth.time_s, raised)) / np.diff(times)
