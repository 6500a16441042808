"""All hypotheses judged: probabilities, what can be told apart, whether the first is proven."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.curve_files import DirectionsRow, HypothesesRow, RobustnessRow
from scapulohumeral.gap.detection.presence import Presence
from scapulohumeral.gap.explained import Explained, explain
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, others_of
from scapulohumeral.gap.isolation.held_out import log_predictive, log_predictive_of_others
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import TaskAmplitude, fit, task_agreement
from scapulohumeral.gap.isolation.misfit import misfit
from scapulohumeral.gap.isolation.movement import movement_fit
from scapulohumeral.gap.isolation.search import Explanations
from scapulohumeral.gap.isolation.suppositions import log_odds_of_moving
from scapulohumeral.gap.labels import FRAMES, JOIN, MOVED, NO_GAP, NONE, family
from scapulohumeral.gap.left_over import LeftOver, left_over
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.result import Robustness
from scapulohumeral.gap.verdict import isolability, posterior
from scapulohumeral.gap.verdict.posterior import UNPROVEN, Circumstances, Posterior, Score
from scapulohumeral.gap.weighing import Weighing

# Labels so many units of weighed evidence below the first are not asked to predict held-out tasks:
# no other task could make up for it.
HOPELESS = 12.0
# Effects among which variants choose.
COMPARED_VARIANTS = 15
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


@dataclass(frozen=True, eq=False)
class Judged:
    """All hypotheses judged.

    Attributes
    ----------
    fits : of all hypotheses, another movement included
    scores : behind the probabilities, of "none" and "no_gap" as well
    best : the most probable fit; likely : fits that are not negligible and explain something
    p : probabilities
    apart : how well these can be told apart; groups : labels that cannot
    agreement, by_task : whether all tasks ask for the amplitude of the best, and what they ask for
    explained, left : how far the best shrinks the gap, and what it leaves; None without a gap
    undecided : why no cause is named; empty if one is
    untold : why motion alone cannot name the first; empty if it can, or there is more
    or_posture : whether the first is named as one of two, itself or a posture held differently
    told : whether data tell what may have been the cause from what may not
    temperature : by which all evidence was divided on the whole
    circumstances : of the case
    """

    fits: Sequence[Fit]
    scores: dict[str, Score]
    best: Fit
    p: Posterior
    likely: list[Fit]
    apart: np.ndarray
    groups: list[list[str]]
    agreement: float | None
    by_task: list[TaskAmplitude]
    explained: Explained | None
    left: LeftOver | None
    undecided: str
    untold: str
    or_posture: bool
    told: bool
    temperature: float
    circumstances: Circumstances


def judge(
    evidence: Evidence,
    found: Explanations,
    is_there: Presence,
    weighing: Weighing,
    inflation: float,
    seed: int,
    able: bool,
) -> Judged:
    """Hypotheses with their probabilities, and what speaks against naming the first.

    `inflation` and `seed` are those of the tests for a gap; `able` says whether most causes would
    have shown.
    """
    present = is_there.present
    others = evidence.others()
    fits = _answers(evidence, found, others)
    scores = _scores(evidence, found, fits, others, weighing)
    case = _circumstances(evidence, is_there, fits, able)
    p = posterior.probabilities(scores, weighing, case)
    best = next(f for f in fits if f.label == p.first)
    weighing = posterior.heard(weighing, case)
    c, error = evidence.residuals[best.moved_deg], evidence.settings.signature_error
    agreement, by_task = _agreement(best, c, error, case.misfit)
    explained = explain(best, evidence, case.misfit, seed) if present else None
    left, against, untold = None, "", ""
    if present:
        left = left_over(best, evidence, inflation, seed)
        untold = _untold(evidence, p)
        gain = _predicted_gain(scores, best.label, case.misfit)
        against = _unproven(
            best.label, explained, gain, agreement, _may_leave_out(evidence)
        ) or _unknown(evidence, scores, weighing)
        if against or untold or _is_part(best, left):
            p = p.doubted(best.label, _movements(evidence, p, best.label) if untold else ())
    likely = isolability.likely(fits, p)
    or_posture = untold == NO_POSTURE_TOLD and _is_either(p, best.label, likely)
    together = (best.label, MOVED) if or_posture else ()
    likely = isolability.explaining(likely, best.label, scores, weighing, c)
    apart = isolability.separability(likely, c, error, weighing.temperature, together)
    return Judged(
        fits=fits,
        scores=scores,
        best=best,
        p=p,
        likely=likely,
        apart=apart,
        groups=isolability.classes(likely, apart, together),
        agreement=agreement,
        by_task=by_task,
        explained=explained,
        left=left,
        undecided=against or ("" if or_posture else untold),
        untold=untold,
        or_posture=or_posture,
        told=case.heard and not untold,
        temperature=weighing.temperature,
        circumstances=case,
    )


def _answers(evidence: Evidence, found: Explanations, others: Mapping[str, float]) -> list[Fit]:
    """All causes, and another movement where it is one."""
    if MOVED not in others:
        return [*found.integrated]
    return [*found.integrated, movement_fit(evidence.residuals, others[MOVED])]


def _circumstances(
    evidence: Evidence, is_there: Presence, fits: Sequence[Fit], able: bool
) -> Circumstances:
    """What of a case decides how its evidence counts."""
    return Circumstances(
        present=is_there.present,
        referenced=evidence.referenced,
        told=motion_is_told(evidence),
        able=able,
        p_value=is_there.p_value,
        misfit=misfit(fits, evidence.residuals, evidence.settings.signature_error),
    )


def _is_part(best: Fit, left: LeftOver) -> bool:
    """Whether a cause is one of two, or looks like one that no library holds.

    Another movement leaves whatever else is wrong, and is right even so.
    """
    return left.presence.present and best.label != MOVED


def _scores(
    evidence: Evidence,
    found: Explanations,
    fits: Sequence[Fit],
    others: dict[str, float],
    weighing: Weighing,
) -> dict[str, Score]:
    """What is known of each label, of "none" and of "no_gap"."""
    settings = evidence.settings
    prior = {
        **evidence.prior,
        NONE: settings.prior_none,
        NO_GAP: settings.prior_no_gap,
        MOVED: settings.prior_moved,
    }
    logs = {**{f.label: f.log_evidence for f in fits}, **others}
    ways = {f.label: f.directions for f in found.integrated}
    moves = log_odds_of_moving(found.every, evidence.suppositions)
    scores = {
        label: Score(
            log_prior=float(np.log(prior[label])),
            log_evidence=log,
            log_predictive=None,
            moves=moves.get(label, 0.0),
            directions=ways.get(label, ()),
        )
        for label, log in logs.items()
    }
    if len(evidence.residual.tasks) < 2:
        return scores
    weights = {f.label: scores[f.label].log_weight(weighing) for f in found.integrated}
    hopeful = {label for label, w in weights.items() if w > max(weights.values()) - HOPELESS}
    asked = log_predictive(
        [f for f in found.every if f.label in hopeful],
        evidence.residuals,
        evidence.suppositions,
        settings.signature_error,
    )
    # What was not asked falls behind its evidence as far as any cause did that was.
    behind = min(predictive - logs[label] for label, predictive in asked.items())
    predictive = {
        **{label: log + behind for label, log in logs.items()},
        **asked,
        **log_predictive_of_others(evidence.residuals, evidence.unknown_inputs.columns),
    }
    return {
        label: replace(score, log_predictive=predictive[label]) for label, score in scores.items()
    }


def _agreement(
    best: Fit, c: Residual, error: float, misfit: float
) -> tuple[float | None, list[TaskAmplitude]]:
    """Whether all tasks ask for one amplitude; another movement may differ between them."""
    if best.label == MOVED:
        return None, []
    return task_agreement(best.hypothesis, c, error, misfit)


def _predicted_gain(scores: Mapping[str, Score], label: str, excess: float) -> float:
    """By how much a cause predicts tasks left out better than nothing does, as log density.

    Zero where there is one task only. `excess` is the misfit.
    """
    own, nothing = (scores[name].log_predictive for name in (label, NO_GAP))
    return 0.0 if own is None or nothing is None else (own - nothing) / excess


def _may_leave_out(evidence: Evidence) -> bool:
    """Whether there is a trial or a task that a cause need not be fitted to."""
    return bool(evidence.folds) or len(evidence.residual.tasks) > 1


def _unproven(
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


def _untold(evidence: Evidence, p: Posterior) -> str:
    """Why motion alone cannot name the first cause; empty if it can, or there is more."""
    if not evidence.of_one_person or motion_is_told(evidence):
        return ""
    acting = {e.label for e in evidence.effects if e.changes_body}
    first = set(p.first.split(JOIN))
    if p.first == MOVED or acting & first:
        return NOT_TOLD
    return NO_POSTURE_TOLD if FRAMES in map(family, first) else ""


def _is_either(p: Posterior, label: str, likely: Sequence[Fit]) -> bool:
    """Whether one of two is more probable than not: a label, or the movement done differently.

    Both have to be among the likely fits.
    """
    both = {label, MOVED}
    return both <= {f.label for f in likely} and sum(p.labels[one] for one in both) > UNPROVEN


def _movements(evidence: Evidence, p: Posterior, doubted: str) -> list[str]:
    """Labels that may each be another movement instead of a doubted label: this alone, and what
    acts on the body, against which people may have moved otherwise."""
    acting = {MOVED} | {e.label for e in evidence.effects if e.changes_body}
    without = set(doubted.split(JOIN))
    parts = {label: set(label.split(JOIN)) for label in p.labels}
    return [label for label, own in parts.items() if acting & own and not without & own]


def _unknown(evidence: Evidence, scores: Mapping[str, Score], weighing: Weighing) -> str:
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


def hypotheses_rows(judged: Judged) -> list[HypothesesRow]:
    """What the probabilities were made of, for whoever calibrates them."""
    return [
        HypothesesRow(
            label=label,
            log_prior=score.log_prior,
            log_evidence=score.log_evidence,
            log_predictive=score.log_predictive,
            moves=score.moves,
        )
        for label, score in judged.scores.items()
    ]


def directions_rows(judged: Judged) -> list[DirectionsRow]:
    """What data tell of the parameters of each label, for whoever calibrates them."""
    return [
        DirectionsRow(label, *direction)
        for label, score in judged.scores.items()
        for direction in score.directions
    ]


def robustness(evidence: Evidence, judged: Judged) -> tuple[Robustness, list[RobustnessRow]]:
    """Whether the winning family stays, with other errors and without single tasks.

    The likeliest effects are fitted anew where they were linearised last, which costs no solve, and
    judged again with the evidence that this adds or takes.
    """
    error = evidence.settings.signature_error
    base = evidence.residuals
    cells = {}
    for factor in (0.5, 2.0):
        cells[f"signature error x {factor}"] = (base, factor * error)
        scaled = {s: replace(c, covariance=factor * c.covariance) for s, c in base.items()}
        cells[f"covariance x {factor}"] = (scaled, error)
    tasks = evidence.residual.tasks
    for task in tasks if len(tasks) > 1 else ():
        rest = [other for other in tasks if other != task]
        cells[f"without {task}"] = ({s: c.part(rest) for s, c in base.items()}, error)
    alone = [f for f in judged.fits if len(f.hypothesis.effects) == 1]
    rivals = sorted(alone, key=lambda f: -judged.p.labels[f.label])[:COMPARED_VARIANTS]
    families = {family(effect.label) for effect in judged.best.hypothesis.effects}
    before = _log_evidence(rivals, evidence, base, error)
    rows = []
    for name, (variant, relative) in cells.items():
        now = _log_evidence(rivals, evidence, variant, relative)
        scores = {
            label: judged.scores[label].with_more(now[label] - before[label]) for label in now
        }
        found = posterior.probabilities(scores, evidence.settings.weighing, judged.circumstances)
        rows.append(RobustnessRow(name, found.first, family(found.first) in families))
    return Robustness(len(rows), sum(row.agrees for row in rows)), rows


def _log_evidence(
    rivals: Sequence[Fit], evidence: Evidence, variant: Mapping[float, Residual], relative: float
) -> dict[str, float]:
    """Log evidence of some effects, and of no effect, in a variant.

    Each effect is taken under its most probable supposition: what others add to the fit to
    everything, they are taken to add here.
    """
    rows = evidence.residual.rows(variant[0.0].tasks)
    found = others_of(variant, evidence.unknown_inputs.columns[rows])
    for first in rivals:
        if first.label != MOVED:
            again = fit(first.hypothesis.part(rows), variant[first.moved_deg], relative)
            found[first.label] = again.log_evidence
    return found
