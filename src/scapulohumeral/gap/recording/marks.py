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
    """A sentence per rule or constant that stands for joint angles."""
    found: dict[Channel, dict[str, None]] = defaultdict(dict)
    having: dict[Channel, set[str]] = defaultdict(set)
    for trial in trials:
        for angle, channel in trial.rules.items():
            found[channel][angle] = None
            having[channel].add(str(trial.source))
    return tuple(
        f"{', '.join(angles)} {channel.status}, not measured, in {len(having[channel])} of "
        f"{len(trials)} trials, off by up to about {channel.uncertainty_deg:.0f} deg: an effect on "
        f"{'it' if len(angles) == 1 else 'them'} alone cannot be tested ({channel.rule})"
        for channel, angles in found.items()
    )
