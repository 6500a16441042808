"""What speaks against naming the first cause: proof that is missing, or that motion cannot give."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from scapulohumeral.gap.explained import Explained
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.labels import FRAMES, JOIN, MOVED, NO_GAP, family
from scapulohumeral.gap.verdict import posterior
from scapulohumeral.gap.verdict.posterior import UNPROVEN, Posterior, Score
from scapulohumeral.gap.weighing import Weighing

# Log density that a cause adds on tasks left out, from which on it is proven: twenty to one, which
# is "strong" by Kass and Raftery 1995 (J Am Stat Assoc 90: 773-795).
STRONG = 3.0
# Level at which tasks contradict each other about an amplitude.
DISAGREEING = 0.01
# Kinds of channels by which an effect on the body is told from another movement.
TELLING = ("emg", "contact_force")
NOTHING_HELD_OUT = "no cause can be proven: there is no trial or task to leave out of the fit"
NOTHING_TO_REMOVE = (
    "no cause can be proven: over all channels together the gap of what is left out of the fit "
    "hardly exceeds the floor, so that there is no share to remove, and no task left out speaks "
    "for the cause"
)
BETTER_UNKNOWN = (
    "smooth unknown inputs explain the difference better than any cause known here: what acts may "
    "not be among them"
)
NO_POSTURE_TOLD = (
    "motion alone cannot tell a turned segment frame from a posture held differently by as much in "
    "all tasks. Record EMG or joint force, or a pose that another device measures"
)
NOT_TOLD = (
    "motion alone cannot tell another movement from what acts on the body: people keep a movement "
    "against it, or choose another. Record EMG or joint force"
)


def predicted_gain(scores: Mapping[str, Score], label: str, excess: float) -> float:
    """By how much a cause predicts tasks left out better than nothing does, as log density.

    Zero where there is one task only. `excess` is the misfit.
    """
    own, nothing = (scores[name].log_predictive for name in (label, NO_GAP))
    return 0.0 if own is None or nothing is None else (own - nothing) / excess


def can_leave_out(evidence: Evidence) -> bool:
    """Whether there is a trial or a task that a cause need not be fitted to."""
    return bool(evidence.folds) or len(evidence.residual.tasks) > 1


def unproven(
    label: str,
    explained: Explained | None,
    gain: float,
    agreement: float | None,
    may_leave_out: bool,
) -> str:
    """Why the first cause is not named, by data that it was not fitted to; empty if it is.

    Another movement needs no proof: it may be another one in each trial. Where the gap is in few
    channels, all of them together hardly exceed the floor, so that there is no share to remove:
    then the density of tasks left out is the proof.
    """
    if explained is None or label == MOVED:
        return ""
    removed, where = explained.of_tasks, "task"
    of_trials = explained.shrinkage.held_out_trial
    if removed is None and of_trials is not None:
        removed, where = of_trials.value, "trial"
    if removed is None and gain <= STRONG:
        return NOTHING_TO_REMOVE if may_leave_out else NOTHING_HELD_OUT
    if removed is not None and removed <= 0.0:
        return (
            f"on a {where} left out of the fit, the most probable cause was seen to remove nothing "
            "of the gap"
        )
    if agreement is not None and agreement < DISAGREEING:
        return f"tasks ask for different amplitudes of the most probable cause (p {agreement:.1g})"
    return ""


def untold(evidence: Evidence, p: Posterior) -> str:
    """Why motion alone cannot name the first cause; empty if it can, or there is more."""
    if not evidence.of_one_person or motion_is_told(evidence):
        return ""
    acting = {e.label for e in evidence.effects if e.changes_body}
    first = set(p.first.split(JOIN))
    if p.first == MOVED or acting & first:
        return NOT_TOLD
    return NO_POSTURE_TOLD if FRAMES in map(family, first) else ""


def is_either(p: Posterior, label: str, likely: Sequence[Fit]) -> bool:
    """Whether one of two is more probable than not: a label, or the movement done differently.

    Both have to be among the likely fits.
    """
    both = {label, MOVED}
    return both <= {f.label for f in likely} and sum(p.labels[one] for one in both) > UNPROVEN


def movements(evidence: Evidence, p: Posterior, doubted: str) -> list[str]:
    """Labels that may each be another movement instead of a doubted label: this alone, and what
    acts on the body, against which people may have moved otherwise."""
    acting = {MOVED} | {e.label for e in evidence.effects if e.changes_body}
    without = set(doubted.split(JOIN))
    parts = {label: set(label.split(JOIN)) for label in p.labels}
    return [label for label, own in parts.items() if acting & own and not without & own]


def unknown(evidence: Evidence, scores: Mapping[str, Score], weighing: Weighing) -> str:
    """Why a cause is not named that may be none of these; empty if evidence is for a cause.

    A person answers to a known cause in other ways than predicted, skin slides in other ways, and
    smooth unknown inputs follow that: between records of one person, what is left of the gap
    speaks in their place.
    """
    of_records = evidence.of_one_person or evidence.settings.of_one_movement
    if of_records or not posterior.unknown_is_likelier(scores, weighing):
        return ""
    return BETTER_UNKNOWN


def motion_is_told(evidence: Evidence) -> bool:
    """Whether something beside motion is compared, which tells what a movement was done with.

    What two records of one movement differ by, motion tells.
    """
    beside = {kind.name for kind in evidence.residual.kinds} & set(TELLING)
    return evidence.settings.of_one_movement or bool(beside)
