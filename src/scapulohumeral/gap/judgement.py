"""All hypotheses judged: probabilities, what can be told apart, whether the first is proven."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scapulohumeral.gap.curve_files import DirectionsRow, HypothesesRow
from scapulohumeral.gap.detection.presence import Presence
from scapulohumeral.gap.explained import Explained, explain
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.held_out import log_predictive, log_predictive_of_others
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import TaskAmplitude, task_agreement
from scapulohumeral.gap.isolation.misfit import misfit
from scapulohumeral.gap.isolation.movement import movement_fit
from scapulohumeral.gap.isolation.search import Explanations
from scapulohumeral.gap.isolation.suppositions import log_odds_of_moving
from scapulohumeral.gap.labels import MOVED, NO_GAP, NONE
from scapulohumeral.gap.left_over import LeftOver, left_over
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.verdict import isolability, posterior, proof
from scapulohumeral.gap.verdict.posterior import Circumstances, Posterior, Score
from scapulohumeral.gap.weighing import Weighing

# Labels so many units of weighed evidence below the first are not asked to predict held-out tasks:
# no other task could make up for it.
HOPELESS = 12.0


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
        untold = proof.untold(evidence, p)
        gain = proof.predicted_gain(scores, best.label, case.misfit)
        against = proof.unproven(
            best.label, explained, gain, agreement, proof.can_leave_out(evidence)
        ) or proof.unknown(evidence, scores, weighing)
        if against or untold or _is_part(best, left):
            p = p.doubted(best.label, proof.movements(evidence, p, best.label) if untold else ())
    likely = isolability.likely(fits, p)
    or_posture = untold == proof.NO_POSTURE_TOLD and proof.is_either(p, best.label, likely)
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
        told=proof.motion_is_told(evidence),
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
