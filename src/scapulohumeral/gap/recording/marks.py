"""Which joint angles of a case nobody has measured, as the records of converted trials say."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np

from scapulohumeral.gap.recording.case import GapTrial
from scapulohumeral.laboratory.trial import Channel
from scapulohumeral.model.rotations import ANGLE_NAMES

ELBOW = "EL_x"
# A joint that turns by less over all of a movement was not measured [deg].
STILL_DEG = 0.01
# Standard deviation of an elbow that nobody measured [deg]: it may be straight or bent.
ELBOW_SD_DEG = 35.0
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


def is_elbow_unmeasured(trials: Iterable[GapTrial]) -> bool:
    """Whether the elbow is a constant in any of the trials that are compared, or a rule."""
    column = ANGLE_NAMES.index(ELBOW)
    return any(
        ELBOW in trial.rules or np.rad2deg(np.ptp(trial.angles_rad[:, column])) < STILL_DEG
        for trial in trials
    )


def unmeasured(trials: Sequence[GapTrial]) -> tuple[str, ...]:
    """A sentence per rule, and per constant angle of a joint that turns, in place of a measurement.

    An elbow that is a constant in one trial counts as not measured in any.
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
        + (": the elbow counts as not measured in all trials" if angle == ELBOW else "")
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
    own = ANGLE_NAMES.index(angle)
    joint = [i for i, name in enumerate(ANGLE_NAMES) if name.split("_")[0] == angle.split("_")[0]]
    found = []
    for trial in trials:
        spans = np.rad2deg(np.ptp(trial.angles_rad, axis=0))
        turns = len(joint) == 1 or np.any(spans[joint] >= STILL_DEG)
        if spans[own] < STILL_DEG and turns and angle not in trial.rules:
            found.append(str(trial.source))
    return found
