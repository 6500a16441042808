"""The inference of a diagnosis: is there a gap, where, which effect, how far does it shrink.

Reference mode explains the difference between test and reference trials of the same task, in which
errors of the model cancel to first order. Without reference trials the difference between record
and prediction is explained, with the spread of the model's own error as noise.

Letters: T tasks, N nodes, K channels, D coefficients.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from scapulohumeral.gap.assembly import assemble
from scapulohumeral.gap.curve_files import (
    BaselinesRow,
    ControlsRow,
    ErrorsRow,
    RobustnessRow,
    table_of,
)
from scapulohumeral.gap.detection import null_bank as null_bank
from scapulohumeral.gap.detection.feasibility import no_cost
from scapulohumeral.gap.detection.presence import DifferenceMap, Presence, difference_map, presence
from scapulohumeral.gap.detection.regions import EnteringCurve, entered_regions, shown_regions
from scapulohumeral.gap.detection.size import NO_INTERVAL, gap_size, sides
from scapulohumeral.gap.effects.library import untestable
from scapulohumeral.gap.explained import controls, shrinkage
from scapulohumeral.gap.isolation import candidates, detectability, doubts, isolability, posterior
from scapulohumeral.gap.isolation.baselines import baseline_labels
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.hypothesis import Fit
from scapulohumeral.gap.isolation.laplace import fit, no_gap_evidence, task_agreement
from scapulohumeral.gap.isolation.search import fit_all
from scapulohumeral.gap.labels import NO_GAP, NONE
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.output.tables import (
    amplitude_table,
    enters_table,
    factors_table,
    isolability_table,
    overlay_table,
    shows_table,
    signature_table,
)
from scapulohumeral.gap.recording.case import Case
from scapulohumeral.gap.residual.differences import Records, read_records
from scapulohumeral.gap.residual.residual import Residual
from scapulohumeral.gap.residual.unknown_input import unknown_input_evidence, unknown_input_left
from scapulohumeral.gap.result import (
    Diagnosis,
    Gap,
    Regions,
    Robustness,
    Shrinkage,
    Status,
    describe_inputs,
)
from scapulohumeral.gap.settings import GapSettings

log = logging.getLogger(__name__)

# Effect-free plants wish for recorded scapulae: a bank of predictions from them would hold the very
# gap between recorded and predicted ones that is to be diagnosed.
NO_BANK_OF_PREDICTIONS = (
    "compared with scapula and clavicle predicted from the humerus: the null bank holds tracked "
    "movements only, so thresholds come from the noise alone"
)
# Verdicts that hold in fewer of the variants than this are not decided.
STABLE = 0.5
# Share of the gap that may be lost on a new task without a remark.
OVERFITTED = 0.3
# Effects among which variants choose.
COMPARED_VARIANTS = 15


def diagnose(case: Case, model: ParticipantModel, settings: GapSettings) -> Diagnosis:
    """Diagnose a case.

    Parameters
    ----------
    case : trials; model : nominal model of the participant
    settings : see `settings.read_settings`

    Raises
    ------
    SolveError                       a nominal movement cannot be solved
    """
    warnings: list[str] = []
    if case.participant.emg_channels and not case.channels:
        warnings.append("EMG is left out: no channel of the participant is in every trial")
    records = read_records(case, model, settings, warnings)
    mode = "reference" if records.reference else "no_reference"
    bank, reason = None, NO_BANK_OF_PREDICTIONS
    if settings.view == "tracking":
        bank, reason = null_bank.read_bank(null_bank.bank_file(settings), settings)
    kind = mode, bool(case.channels), case.has_contact
    inflation, remark = null_bank.inflation(bank, *kind, settings.alpha)
    warnings += [*filter(None, [reason]), remark]
    settings = _for_emg_unit(settings, case, warnings)
    evidence = assemble(case, records, model, settings, warnings)
    found = difference_map(evidence.residual, settings.alpha / 2.0, inflation, case.seed)
    slopes = [f.hypothesis.slope for f in evidence.screened]
    is_there = presence(evidence.residual, found, slopes, settings.alpha, inflation, case.seed)
    log.info("%s %.2f, threshold %.2f", is_there.statistic, is_there.value, is_there.threshold)
    fits: Sequence[Fit] = evidence.screened
    if is_there.present:
        fits = fit_all(evidence, model, case.threads, warnings)
    judged = _judged(evidence, fits, is_there.present, inflation)
    answer = _answer(case, records, evidence, (is_there, found), judged, warnings)
    rows = baseline_labels(evidence.residual, evidence.screened, evidence.prior)
    return replace(
        answer,
        hashes={"null_bank": None if bank is None else bank.hash},
        curves={**answer.curves, "baselines": table_of(BaselinesRow, rows)},
    )


def _for_emg_unit(settings: GapSettings, case: Case, warnings: list[str]) -> GapSettings:
    """Settings that know less about EMG gains if each recording has a maximum of its own."""
    if not case.channels or case.participant.emg_is_of_mvc:
        return settings
    warnings.append("EMG is a fraction of each recording's own maximum: its gains count for little")
    return replace(settings, session=replace(settings.session, emg_gain=settings.model.emg_gain))


@dataclass(frozen=True, eq=False)
class _Judged:
    """All hypotheses judged.

    Attributes
    ----------
    fits : of all hypotheses; squares : of the difference
    best : the most probable fit; likely : fits that are not negligible
    p : probabilities
    apart : how well these can be told apart; groups : labels that cannot
    agreement, by_task : whether all tasks ask for the amplitude of the best, and what they ask for
    """

    fits: Sequence[Fit]
    squares: doubts.Squares
    best: Fit
    p: posterior.Posterior
    likely: list[Fit]
    apart: np.ndarray
    groups: list[list[str]]
    agreement: float | None
    by_task: list[tuple[str, float, float]]


def _judged(evidence: Evidence, fits: Sequence[Fit], present: bool, inflation: float) -> _Judged:
    c, error = evidence.residual, evidence.settings.signature_error
    squares = _squares(c, inflation)
    p = _posterior(evidence, fits, present, squares)
    likely = isolability.likely(fits, p)
    apart = isolability.separability(likely, c, error, evidence.settings.temperature)
    best = max(fits, key=lambda f: p.labels[f.label])
    agreement, by_task = task_agreement(best.hypothesis, c, error)
    groups = isolability.classes(likely, apart)
    return _Judged(fits, squares, best, p, likely, apart, groups, agreement, by_task)


def _squares(c: Residual, inflation: float) -> doubts.Squares:
    white = c.whiten(c.delta)
    return doubts.Squares(
        whole=float(white @ white),
        expected=float(len(white)),
        excess=inflation,
    )


def _answer(
    case: Case,
    records: Records,
    evidence: Evidence,
    where: tuple[Presence, DifferenceMap],
    judged: _Judged,
    warnings: list[str],
) -> Diagnosis:
    c, error = evidence.residual, evidence.settings.signature_error
    is_there, found = where
    present = is_there.present
    fits, best, p, groups = judged.fits, judged.best, judged.p, judged.groups
    agreement = {best.label: judged.agreement}
    temperature = evidence.settings.temperature
    reducible = judged.squares.whole, unknown_input_left(c, evidence.unknown_inputs.columns)
    causes = candidates.candidates(fits, p, groups, agreement, reducible, temperature)
    robust, variants = _robustness(evidence, judged, present)
    gap = _gap(evidence, is_there, fits, records, case.seed)
    halves = _halves(evidence)
    regions, entering = _regions(case, evidence, found, halves, present)
    status, why = _status(robust, present)
    cost: Shrinkage | None = None
    without_cause: list[ControlsRow] = []
    if present:
        cost = shrinkage(best, c, evidence.trials, error, case.seed)
        without_cause = controls(c, evidence.trials, evidence.unknown_inputs, error, case.seed)
    if gap.size.ci95 is None:
        warnings.append(NO_INTERVAL)
    warnings += _remarks(records, present and not found.standing_out, cost)
    splitting = {e.label: e.splitting for e in evidence.effects}
    return Diagnosis(
        status=status,
        status_reason=why,
        mode=case.mode,
        inputs=describe_inputs(case),
        gap=gap,
        regions=regions,
        candidates=causes,
        none_p=p.none,
        no_gap_p=p.no_gap,
        set90=posterior.credible_set(p),
        classes=candidates.effect_classes(groups, p, splitting),
        shrinkage=cost,
        next_trial=(
            isolability.next_trial(judged.likely, groups[0], c, error, temperature)
            if present and groups
            else None
        ),
        hint=candidates.hint(causes, p, regions.enters) if present else None,
        untestable=untestable(evidence.effects),
        robustness=robust,
        warnings=tuple(warnings),
        curves={
            "shows": shows_table(c, found, halves if present else ()),
            "enters": enters_table(entering),
            **_tables_of_causes(evidence, judged),
            **_only_with_a_gap(variants, without_cause),
        },
    )


def _tables_of_causes(evidence: Evidence, judged: _Judged) -> dict[str, pd.DataFrame]:
    c, best = evidence.residual, judged.best
    return {
        "overlay": overlay_table(c, best, evidence.referenced),
        "signature": signature_table(c, best),
        "isolability": isolability_table(judged.likely, judged.apart),
        "amplitude": amplitude_table(best, judged.by_task),
        "factors": factors_table(c, judged.fits, evidence.settings.signature_error),
        "errors": table_of(ErrorsRow, _errors(evidence, best)),
    }


def _remarks(records: Records, spread_thinly: bool, cost: Shrinkage | None) -> list[str]:
    """What lowers the confidence in an answer, one sentence each."""
    remarks = []
    if spread_thinly:
        remarks.append(
            "no channel stands out by itself: regions are those above 5 % point by point"
        )
    if not records.reference:
        remarks.append("no reference trials: errors of the model itself lower all confidence")
    if cost is not None:
        remarks += _remarks_on_shrinkage(cost)
    return remarks


def _remarks_on_shrinkage(cost: Shrinkage) -> list[str]:
    shares = (cost.in_sample, cost.held_out_trial, cost.new_task)
    remarks = []
    if any(share and share.ci95 is None for share in shares):
        remarks.append("shrinkage: fewer than four parts, so some shares have no interval")
    if cost.in_sample is None:
        remarks.append(
            "shrinkage: over all channels together the gap hardly exceeds the floor, so there is "
            "nothing to remove"
        )
    elif cost.new_task is not None and cost.in_sample.value - cost.new_task.value > OVERFITTED:
        remarks.append(
            "shrinkage: much less is removed on a new task than on the tasks fitted to; the cause "
            "may be wrong or fitted to noise"
        )
    return remarks


def _errors(evidence: Evidence, best: Fit) -> list[ErrorsRow]:
    """What was found most probable of the person and of the errors that are assumed."""
    return [
        ErrorsRow(error="stiffness", value=best.hypothesis.stiffness),
        ErrorsRow(error="session_share", value=evidence.session_share),
        ErrorsRow(error="signature_error", value=evidence.settings.signature_error),
    ]


def _only_with_a_gap(
    variants: Sequence[RobustnessRow], without_cause: Sequence[ControlsRow]
) -> dict[str, pd.DataFrame]:
    """Tables of what is computed only if there is a gap; those without rows are left out."""
    tables = {
        "robustness": table_of(RobustnessRow, variants),
        "controls": table_of(ControlsRow, without_cause),
    }
    return {name: table for name, table in tables.items() if len(table)}


def _posterior(
    evidence: Evidence, fits: Sequence[Fit], present: bool, squares: doubts.Squares
) -> posterior.Posterior:
    c, settings = evidence.residual, evidence.settings
    found = posterior.posterior(
        fits,
        {
            NONE: unknown_input_evidence(c, evidence.unknown_inputs.columns),
            NO_GAP: no_gap_evidence(c),
        },
        {**evidence.prior, NONE: settings.prior_none, NO_GAP: settings.prior_no_gap},
        settings.temperature,
        posterior.no_gap_range(present, evidence.referenced),
        squares if present else None,
    )
    return posterior.perhaps_misled(found, evidence.prior) if present else found


def _regions(
    case: Case,
    evidence: Evidence,
    found: DifferenceMap,
    halves: Sequence[np.ndarray],
    present: bool,
) -> tuple[Regions, list[EnteringCurve]]:
    """Both maps, and the curves of the second; regions only if there is a gap."""
    c, alpha = evidence.residual, evidence.settings.alpha
    enters, entering = entered_regions(c, evidence.unknown_inputs, halves, alpha, case.seed)
    if not present:
        return Regions(), entering
    return Regions(shown_regions(found, c, halves), enters), entering


def _halves(evidence: Evidence) -> list[np.ndarray]:
    """Differences (D,) of two halves of the test trials; fewer if a task has but one trial."""
    halves = []
    for part in (0, 1):
        chosen = [
            [t.residual.delta for t in evidence.trials if t.task == task][part::2]
            for task in evidence.residual.tasks
        ]
        if all(chosen):
            halves.append(np.concatenate([np.mean(deltas, axis=0) for deltas in chosen]))
    return halves


def _gap(
    evidence: Evidence, is_there: Presence, fits: Sequence[Fit], records: Records, seed: int
) -> Gap:
    c = evidence.residual
    emg = (
        [
            np.mean([one.emg for one in records.test[task] if one.emg is not None], axis=0)
            for task in c.tasks
        ]
        if records.sensors.channels
        else []
    )
    families = len({(e.side, e.family) for e in evidence.effects})
    return Gap(
        present=is_there.present,
        p_value=is_there.p_value,
        statistic=is_there.statistic,
        value=is_there.value,
        threshold=is_there.threshold,
        floor_source=evidence.noise.source,
        size=gap_size(c, sides(c, records), seed),
        no_cost=no_cost(evidence.signatures, emg, records.sensors),
        smallest_detectable=detectability.smallest_detectable(fits, c, families),
    )


def _robustness(
    evidence: Evidence, judged: _Judged, present: bool
) -> tuple[Robustness | None, list[RobustnessRow]]:
    """Whether the winning family stays, with other errors and without single tasks.

    Every effect is fitted anew where it was linearised last, which costs no solve.
    """
    if not present:
        return None, []
    c, error = evidence.residual, evidence.settings.signature_error
    weighing = evidence.prior, evidence.settings.temperature
    cells = {f"signature error x {factor}": (c, factor * error) for factor in (0.5, 1.0, 2.0)}
    for factor in (0.5, 2.0):
        cells[f"noise x {factor}"] = (replace(c, covariance=factor * c.covariance), error)
    for task in c.tasks if len(c.tasks) > 1 else ():
        cells[f"without {task}"] = (c.part([other for other in c.tasks if other != task]), error)
    alone = [f for f in judged.fits if len(f.hypothesis.effects) == 1]
    less_probable = posterior.most_probable(alone, *weighing, judged.squares, COMPARED_VARIANTS)
    family = [(e.side, e.family) for e in judged.best.hypothesis.effects]
    rows = []
    for name, (variant, relative) in cells.items():
        kept = c.rows(variant.tasks)
        again = [fit(rival.hypothesis.part(kept), variant, relative) for rival in less_probable]
        squares = _squares(variant, judged.squares.excess)
        [first] = posterior.most_probable(again, *weighing, squares, 1)
        [winner] = first.hypothesis.effects
        agrees = (winner.side, winner.family) in family
        rows.append(RobustnessRow(cell=name, verdict=winner.label, agrees=agrees))
    return Robustness(len(rows), sum(row.agrees for row in rows)), rows


def _status(robust: Robustness | None, present: bool) -> tuple[Status, str]:
    if present and robust is not None and robust.agree < STABLE * robust.cells:
        return "abstained", (
            f"the most probable cause holds in {robust.agree} of {robust.cells} variants only"
        )
    return "ok", ""
