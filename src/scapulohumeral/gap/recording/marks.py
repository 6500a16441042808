"""Which joint angles of a case nobody has measured, as the records of converted trials say."""

from __future__ import annotations

from collections import defaultdict

from scapulohumeral.gap.recording.case import Case
from scapulohumeral.laboratory.record import read_channels
from scapulohumeral.laboratory.trial import MEASURED, Channel


def unmeasured(case: Case) -> tuple[str, ...]:
    """A sentence per rule or constant that stands for joint angles.

    Parameters
    ----------
    case : trials with a record beside them are those that ``scapulohumeral convert`` has made

    Raises
    ------
    DataError                        a record cannot be read
    """
    found: dict[Channel, dict[str, None]] = defaultdict(dict)
    trials: dict[Channel, set[str]] = defaultdict(set)
    for trial in (*case.test, *case.reference):
        for angle, channel in read_channels(trial.source).items():
            if channel.status != MEASURED:
                found[channel][angle] = None
                trials[channel].add(str(trial.source))
    count = len(case.test) + len(case.reference)
    return tuple(
        f"{', '.join(angles)} {channel.status}, not measured, in {len(trials[channel])} of {count} "
        f"trials, off by up to about {channel.uncertainty_deg:.0f} deg: an effect on "
        f"{'it' if len(angles) == 1 else 'them'} alone cannot be tested ({channel.rule})"
        for channel, angles in found.items()
    )
