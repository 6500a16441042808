"""From what was found of a case to the fields of its answer, one function per block."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pandas as pd

from scapulohumeral.gap.curve_files import (
    MISFIT,
    SCATTER_OF,
    ControlsRow,
    DirectionsRow,
    ErrorsRow,
    HypothesesRow,
    LeftOutRow,
    RobustnessRow,
    table_of,
)
from scapulohumeral.gap.detection.feasibility import no_cost
from scapulohumeral.gap.detection.presence import DifferenceMap, Presence
from scapulohumeral.gap.detection.regions import EnteringCurve, entered_regions, shown_regions
from scapulohumeral.gap.detection.single_trials import few_in_words
from scapulohumeral.gap.detection.size import NO_INTERVAL, gap_size, sides
from scapulohumeral.gap.effects.library import untestable
from scapulohumeral.gap.effects.movement_strategy import MOVEMENT_STRATEGY
from scapulohumeral.gap.explained import Explained
from scapulohumeral.gap.isolation.channel_gains import person_change
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.judgement import Judged, directions_rows, hypotheses_rows
from scapulohumeral.gap.left_over import left_in_words
from scapulohumeral.gap.output.tables import (
    amplitude_table,
    enters_table,
    factors_table,
    isolability_table,
    overlay_table,
    shows_table,
    signature_table,
)
from scapulohumeral.gap.output.units import as_predicted
from scapulohumeral.gap.recording.case import Case
from scapulohumeral.gap.residual.differences import Records
from scapulohumeral.gap.residual.unknown_input import unknown_input_left
from scapulohumeral.gap.result import (
    Candidate,
    Detectable,
    Diagnosis,
    Feasibility,
    Gap,
    NextTrial,
    Regions,
    Robustness,
    Status,
    describe_inputs,
)
from scapulohumeral.gap.robustness import robustness
from scapulohumeral.gap.verdict import candidates, isolability, posterior
from scapulohumeral.gap.verdict.exchanged_sides import in_reference_instead, in_words
from scapulohumeral.gap.verdict.proof import motion_is_told

# Verdicts that hold in fewer of the variants than this are not decided.
STABLE = 0.5
# A gap that shows in a shape of few channels may drown in all of them.
NO_EXCESS = (
    "size of the gap: over all channels together it is no larger than what noise and sessions "
    "make; it shows in the shape of few of them"
)
NOT_EVEN_BY_POINTS = "not even point by point, so that there are no regions"
# Share of the gap that may be lost on a new task without a remark.
OVERFITTED = 0.3


@dataclass(frozen=True, eq=False)
class Findings:
    """What was found of one case, before it is put into words.

    Attributes
    ----------
    case, evidence : what was measured, compared and linearised
    presence, map : whether there is a gap, and where it shows
    detectable : what would have shown
    judged : hypotheses and their probabilities
    """

    case: Case
    evidence: Evidence
    presence: Presence
    map: DifferenceMap
    detectable: tuple[Detectable, ...]
    judged: Judged

    @property
    def present(self) -> bool:
        """Whether there is a gap."""
        return self.presence.present

    @cached_property
    def changes(self) -> dict[str, np.ndarray]:
        """Changes (D,) that all hypotheses say this person shows, by label."""
        error, residuals = self.evidence.settings.signature_error, self.evidence.residuals
        return {f.label: person_change(f, residuals[f.moved_deg], error) for f in self.judged.fits}


def answer(found: Findings, warnings: list[str]) -> Diagnosis:
    """The answer to a case; `warnings` gets what lowers the confidence in it."""
    evidence, judged = found.evidence, found.judged
    robust, variants = (None, []) if not found.present else robustness(evidence, judged)
    status, why = _status(robust, found)
    # A cause that is not named is at most as probable as not.
    p = judged.p.doubted(judged.best.label) if why else judged.p
    found = replace(found, judged=replace(judged, p=p))
    causes = _causes(found)
    gap = _gap(found)
    regions, entering = _regions(found)
    explained = judged.explained
    warnings += [*_remarks_on_gap(evidence.records, gap), *_remarks(found, bool(regions.shows))]
    doubt = candidates.Doubt.of(judged.untold, why)
    splitting = {e.label: e.splitting for e in (*evidence.effects, MOVEMENT_STRATEGY)}
    halves = found.evidence.halves if found.present else ()
    done = Diagnosis(
        status=status,
        status_reason=why,
        mode="reference" if evidence.referenced else "no_reference",
        inputs=describe_inputs(found.case),
        gap=gap,
        regions=regions,
        candidates=causes,
        none_p=p.none,
        no_gap_p=p.no_gap,
        set90=posterior.set90(p, evidence.settings.weighing, found.judged.told),
        classes=candidates.effect_classes(judged.groups, p, splitting, found.present, doubt),
        shrinkage=None if explained is None else explained.shrinkage,
        next_trial=_next_trial(found),
        hint=candidates.hint(causes, p, regions.enters) if found.present else None,
        untestable=() if evidence.settings.of_simulations else untestable(evidence.effects),
        robustness=robust,
        warnings=tuple(warnings),
        told=found.judged.told,
        curves={
            "shows": shows_table(evidence.cautious, found.map, halves),
            "enters": enters_table(entering),
            **_tables_of_causes(found),
            **_only_with_a_gap(variants, explained),
        },
    )
    return done if found.case.participant.emg_is_of_mvc else as_predicted(done)


def _causes(found: Findings) -> tuple[Candidate, ...]:
    """All hypotheses as candidates, the most probable first."""
    evidence, judged = found.evidence, found.judged
    columns, residuals = evidence.unknown_inputs.columns, evidence.residuals
    least = {moved: unknown_input_left(c, columns) for moved, c in residuals.items()}
    left = {
        f.label: candidates.share_left(
            residuals[f.moved_deg], found.changes[f.label], least[f.moved_deg]
        )
        for f in judged.fits
    }
    return candidates.candidates(
        judged.fits,
        judged.p,
        judged.groups,
        {judged.best.label: judged.agreement},
        left,
        judged.temperature,
    )


def _next_trial(found: Findings) -> NextTrial | None:
    """The trial that would best split the first class; None without a gap, or if none would.

    Where motion alone cannot tell, more of it does not either.
    """
    judged, settings = found.judged, found.evidence.settings
    first = judged.groups[0] if judged.groups else ()
    if not found.present or judged.best.label not in first or judged.untold:
        return None
    return isolability.next_trial(
        judged.likely,
        first,
        found.evidence.residuals[judged.best.moved_deg],
        settings.signature_error,
        judged.temperature,
    )


def _regions(found: Findings) -> tuple[Regions, list[EnteringCurve]]:
    """Both maps, and the curves of the second; regions only if there is a gap."""
    c, alpha = found.evidence.cautious, found.evidence.settings.alpha
    enters, entering = entered_regions(
        c, found.evidence.unknown_inputs, found.evidence.halves, alpha, found.case.seed
    )
    if not found.present:
        return Regions(), entering
    return Regions(shown_regions(found.map, c, found.evidence.halves), enters), entering


def _gap(found: Findings) -> Gap:
    """Whether there is a gap, how large it is, and what would have been seen."""
    evidence, is_there = found.evidence, found.presence
    size = gap_size(evidence.cautious, sides(evidence.residual, evidence.records), found.case.seed)
    return Gap(
        present=is_there.present,
        p_value=is_there.p_value,
        statistic=is_there.statistic,
        value=is_there.value,
        threshold=is_there.threshold,
        floor_source=evidence.noise.source,
        size=replace(size, ci95=None) if is_there.present and not size.value else size,
        no_cost=_no_cost(found),
        smallest_detectable=found.detectable,
    )


def _no_cost(found: Findings) -> Feasibility:
    """Whether any activations could have done what was recorded.

    Asked only where the record is compared with the model: beside reference trials, nominal
    solutions are of their motion, and EMG of the test trials is of another. EMG has to have a
    level, which shares of other maxima than that of a voluntary contraction have not.
    """
    evidence, records = found.evidence, found.evidence.records
    level = records.sensors.channels and found.case.participant.emg_is_of_mvc
    if evidence.referenced or not level:
        return Feasibility(False, None)
    emg = [
        np.mean([one.emg for one in records.test[task] if one.emg is not None], axis=0)
        for task in evidence.residual.tasks
    ]
    return no_cost(evidence.signatures, emg, records.sensors)


def _tables_of_causes(found: Findings) -> dict[str, pd.DataFrame]:
    evidence, judged = found.evidence, found.judged
    best = judged.best
    change, error = found.changes[best.label], evidence.settings.signature_error
    return {
        "overlay": overlay_table(evidence.cautious, change, evidence.referenced),
        "signature": signature_table(evidence.cautious, change),
        "isolability": isolability_table(judged.likely, judged.apart),
        "amplitude": amplitude_table(best, judged.by_task, judged.temperature),
        "factors": factors_table(evidence.residuals, judged.fits, error),
        "hypotheses": table_of(HypothesesRow, hypotheses_rows(judged)),
        "directions": table_of(DirectionsRow, directions_rows(judged)),
        "errors": table_of(ErrorsRow, _errors(evidence, judged)),
    }


def _errors(evidence: Evidence, judged: Judged) -> list[ErrorsRow]:
    """What was found most probable of the person and of the errors that are assumed."""
    best = judged.best
    return [
        ErrorsRow(error="stiffness", value=best.hypothesis.stiffness),
        ErrorsRow(error="other_movement_deg", value=best.moved_deg),
        ErrorsRow(error="marker_share", value=evidence.session_shares.markers),
        ErrorsRow(error="electrode_share", value=evidence.session_shares.electrodes),
        ErrorsRow(error="signature_error", value=evidence.settings.signature_error),
        *(
            ErrorsRow(error=f"{SCATTER_OF}{one.kind}_{one.task}", value=factor)
            for one, factor in evidence.scatter.items()
        ),
        ErrorsRow(error=MISFIT, value=judged.circumstances.misfit),
    ]


def _only_with_a_gap(
    variants: Sequence[RobustnessRow], done: Explained | None
) -> dict[str, pd.DataFrame]:
    """Tables of what is computed only if there is a gap.

    Those without rows are left out, but for the tasks left out, of which there may be none.
    """
    if done is None:
        return {}
    tables = {
        "robustness": table_of(RobustnessRow, variants),
        "controls": table_of(ControlsRow, done.controls),
    }
    filled = {name: table for name, table in tables.items() if len(table)}
    return {"left_out": table_of(LeftOutRow, done.left_out), **filled}


def _remarks_on_gap(records: Records, gap: Gap) -> list[str]:
    """What the size of a gap, or that there is none, says little about."""
    remarks = []
    if gap.present and not gap.size.value:
        remarks.append(NO_EXCESS)
    elif gap.size.ci95 is None:
        remarks.append(NO_INTERVAL)
    if not gap.present:
        remarks += few_in_words(records, gap.smallest_detectable)
    return remarks


def _remarks(found: Findings, shown: bool) -> list[str]:
    """What lowers the confidence in an answer, one sentence each.

    `shown` says whether the gap shows in any channel at any phase.
    """
    remarks = []
    left = found.judged.left
    if left is not None and left.presence.present:
        remarks.append(left_in_words(found.judged.best.label, left))
    if found.present and not found.map.standing_out:
        which = "regions are those above 5 % point by point" if shown else NOT_EVEN_BY_POINTS
        remarks.append(f"{_in_one_task(found)}: {which}")
    if found.present and (other_side := in_reference_instead(found.evidence)):
        remarks.append(in_words(other_side))
    untold = found.judged.untold
    if untold and untold != found.judged.undecided:
        remarks.append(untold)
    if not motion_is_told(found.evidence):
        remarks.append(
            "motion alone: people keep a movement against what acts on the body, which then does "
            "not show; EMG or joint force would tell"
        )
    elif found.judged.circumstances.unable:
        remarks.append(
            "these trials would have shown fewer than half of the kinds of causes: that no gap "
            "shows excludes none of them; record more repeats, tasks or muscles"
        )
    if not found.evidence.referenced:
        remarks.append("no reference trials: errors of the model itself lower all confidence")
    if found.judged.explained is not None:
        remarks += _remarks_on_shrinkage(found.judged.explained)
    return remarks


def _in_one_task(found: Findings) -> str:
    """What stands out of the map although the mean over tasks does not."""
    alone = found.map.in_one_task
    if alone is None:
        return "no channel stands out by itself"
    task, node, channel = alone
    c, z = found.evidence.cautious, found.map.by_task
    phase = 100.0 * node / (z.shape[1] - 1)
    return (
        f"{c.channels[channel]} stands out in task {c.tasks[task]} alone, by "
        f"{abs(z[alone]):.1f} standard errors at {phase:.0f} % of the movement, and no channel "
        "over all tasks together"
    )


def _remarks_on_shrinkage(done: Explained) -> list[str]:
    cost, of_tasks = done.shrinkage, done.of_tasks
    shares = (cost.in_sample, cost.held_out_trial, cost.new_task)
    remarks = []
    if any(share and share.ci95 is None for share in shares):
        remarks.append("shrinkage: fewer than four parts, so some shares have no interval")
    if cost.in_sample is None:
        remarks.append(
            "shrinkage: over all channels together the gap hardly exceeds the floor, so there is "
            "nothing to remove"
        )
    elif of_tasks is not None and cost.in_sample.value - of_tasks > OVERFITTED:
        remarks.append(
            "shrinkage: much less went on tasks left out of the fit than on those fitted to; the "
            "cause may be wrong or fitted to noise"
        )
    return remarks


def _status(robust: Robustness | None, found: Findings) -> tuple[Status, str]:
    if found.judged.undecided:
        return "abstained", found.judged.undecided
    if found.present and robust is not None and robust.agree < STABLE * robust.cells:
        return "abstained", (
            f"the most probable cause holds in {robust.agree} of {robust.cells} variants only"
        )
    return "ok", ""
