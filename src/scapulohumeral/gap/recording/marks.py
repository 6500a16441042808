"""Which joint angles of a case nobody has measured, as the records of converted trials say."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from scapulohumeral.gap.recording.case import GapTrial
from scapulohumeral.laboratory.trial import Channel
from scapulohumeral.model.rotations import ANGLE_NAMES

ELBOW, AXIAL_ROTATION = "EL_x", "GH_yy"
# A joint that turns by less over all of a movement was not measured [deg].
STILL_DEG = 0.01
# Standard deviations of angles that nobody measured [deg]: an elbow may be straight or bent, and a
# humerus turned about its own axis from in front of the body to behind it.
UNMEASURED_SD_DEG = {ELBOW: 35.0, AXIAL_ROTATION: 35.0}
# A segment is not measured if a rule stands for one of these angles: the others of its joint may be
# rules of another segment's.
TELLING_ANGLE = {"clavicle": "SC_z", "scapula": "GH_z"}


def unmeasured_segments(trials: Iterable[GapTrial]) -> dict[str, float]:
    """Segments of the girdle that a rule stands for: standard deviations of their turns [deg]."""
    found: dict[str, float] = {}
    for trial in trials:
        for segment, angle in TELLING_ANGLE.items():
            rule = trial.rules.get(angle)
            if rule is not None and rule.uncertainty_deg:
                # Uncertainties are two standard deviations.
                found[segment] = max(found.get(segment, 0.0), 0.5 * rule.uncertainty_deg)
    return found


def unmeasured_angles(trials: Iterable[GapTrial]) -> dict[str, float]:
    """Elbow and axial rotation of the humerus, where they are a rule or a constant in any of the
    trials that are compared: their standard deviations [deg].
    """
    given = list(trials)
    return {
        angle: deviation
        for angle, deviation in UNMEASURED_SD_DEG.items()
        if any(angle in trial.rules or _span_deg(trial, angle) < STILL_DEG for trial in given)
    }


def unmeasured(trials: Sequence[GapTrial]) -> tuple[str, ...]:
    """A sentence per rule, and per constant angle of a joint that turns, in place of a measurement.

    An elbow, or an axial rotation of the humerus, that is a constant in one trial counts as not
    measured in any.
    """
    found: dict[Channel, dict[str, None]] = defaultdict(dict)
    having: dict[Channel, set[str]] = defaultdict(set)
    for trial in trials:
        for angle, channel in trial.rules.items():
            found[channel][angle] = None
            having[channel].add(str(trial.source))
    constant = {angle: _constant_in(angle, trials) for angle in ANGLE_NAMES}
    return tuple(
        f"{angle} is a constant in {', '.join(names)}, so it was not measured there"
        + (", and counts as not measured in all trials" if angle in UNMEASURED_SD_DEG else "")
        for angle, names in constant.items()
        if names
    ) + tuple(
        f"{', '.join(angles)} {channel.status}, not measured, in {len(having[channel])} of "
        f"{len(trials)} trials, off by up to about {channel.uncertainty_deg:.0f} deg: an effect on "
        f"{'it' if len(angles) == 1 else 'them'} alone cannot be tested ({channel.rule})"
        for channel, angles in found.items()
    )


def _constant_in(angle: str, trials: Sequence[GapTrial]) -> list[str]:
    """Trials in which an angle that no rule stands for is a constant, while its joint turns."""
    joint = [name for name in ANGLE_NAMES if name.split("_")[0] == angle.split("_")[0]]
    return [
        str(trial.source)
        for trial in trials
        if angle not in trial.rules
        and _span_deg(trial, angle) < STILL_DEG
        and (len(joint) == 1 or max(_span_deg(trial, name) for name in joint) >= STILL_DEG)
    ]


def _span_deg(trial: GapTrial, angle: str) -> float:
    """Largest less least value of an angle [deg]."""
    return float(np.rad2deg(np.ptp(trial.angles_rad[:, ANGLE_NAMES.index(angle)])))
