"""Names of answers: ``side/family[/member]``, pairs of them, none of these, no gap."""

from __future__ import annotations

from collections.abc import Iterable


def family(label: str) -> str:
    """``side/family`` of a label; pairs, none and no_gap stay as they are."""
    return label if JOIN in label else "/".join(label.split("/")[:2])


def matches(label: str, truth: str) -> bool:
    """Whether a label names the truth; a member that is left out, or all, is no contradiction."""
    if family(label) != family(truth):
        return False
    members = [name.split("/")[2] for name in (label, truth) if name.count("/") >= 2]
    return len(members) < 2 or members[0] == members[1] or "all" in members


def matches_any(label: str, truths: Iterable[str]) -> bool:
    """Whether a label names any of several truths."""
    return any(matches(label, truth) for truth in truths)


NONE, NO_GAP = "none", "no_gap"
# The movement was done differently: no cause that acts on body or record.
MOVED = "control/movement_strategy"
# Weight in the hand, by which the worth of trials is told.
LOAD = "body/hand_load"
# A segment frame turned by as much in all tasks.
FRAMES = "input/frame_misalignment"
# Between the two effects of a pair.
JOIN = " + "
# Tests for a gap: shapes of effects on the record, single channels, shapes of all effects.
ON_RECORD, MAX_T, GLR = "on_record", "max_t", "glr"
# Folder of the tables behind the figures, beside the answer.
CURVES = "curves"
