"""The inference of a diagnosis: is there a gap, where, which effect, how far does it shrink.

Reference mode explains the difference between test and reference trials of the same task, in which
errors of the model cancel to first order. Without reference trials the difference between record
and prediction is explained, with the spread of the model's own error as noise.

Letters: T tasks, N nodes, K channels, D coefficients.
"""

from __future__ import annotations

import logging
from dataclasses import replace

from scapulohumeral.gap.answer import Findings, answer
from scapulohumeral.gap.assembly import assemble
from scapulohumeral.gap.curve_files import (
    BaselinesRow,
    table_of,
)
from scapulohumeral.gap.detection import null_bank
from scapulohumeral.gap.detection.permutation import strongest
from scapulohumeral.gap.detection.presence import Presence, tested
from scapulohumeral.gap.detection.single_trials import (
    OneTrial,
    alone,
    alone_in_words,
    as_sure_as_two,
    contradicted,
    in_words,
    rests_on_one,
)
from scapulohumeral.gap.isolation.empirical_bayes import Evidence
from scapulohumeral.gap.isolation.search import fit_all, screened_only
from scapulohumeral.gap.judgement import judge
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.recording.case import Case
from scapulohumeral.gap.recording.one_movement import ONE_MOVEMENT, perhaps
from scapulohumeral.gap.residual.differences import read_records
from scapulohumeral.gap.result import (
    Diagnosis,
)
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.verdict.baselines import baseline_labels
from scapulohumeral.gap.verdict.detectability import silence_tells, smallest_detectable

log = logging.getLogger(__name__)

# Effect-free plants wish for recorded scapulae: a bank of predictions from them would hold the very
# gap between recorded and predicted ones that is to be diagnosed.
NO_BANK_OF_PREDICTIONS = (
    "compared with scapula and clavicle predicted from the humerus: the null bank holds tracked "
    "movements only, so thresholds come from the noise alone"
)
OF_SIMULATIONS = (
    "trials are simulations, as was asked for: they are taken to differ by next to nothing without "
    "a cause, and no error of measurement is considered"
)
NO_BANK_OF_ONE_MOVEMENT = (
    "records of the same movements: the null bank holds repeats, so thresholds come from the noise "
    "alone"
)
PERHAPS_ONE_MOVEMENT = (
    "test and reference trials have the same times and speed of elevation: if two systems recorded "
    "the same movements, say so with --one-movement"
)


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
    weighing = settings.weighing
    if not (settings.of_simulations or case.one_movement) and perhaps(case):
        warnings.append(PERHAPS_ONE_MOVEMENT)
    records = read_records(case, model, settings, warnings)
    mode = "reference" if records.reference else "no_reference"
    bank, reason = _bank(case, settings)
    kind = mode, bool(case.channels), case.has_contact
    inflation, remark = null_bank.inflation(bank, *kind, settings.alpha)
    warnings += [*filter(None, [reason]), remark]
    if case.one_movement:
        warnings.append(ONE_MOVEMENT)
        settings = settings.for_one_movement()
    settings = _for_emg_unit(settings, case, warnings)
    evidence = assemble(case, records, model, settings, warnings)
    shapes, alpha = evidence.shapes(), settings.alpha
    found, findings = tested(evidence.cautious, shapes, alpha, inflation, case.seed)
    is_there = strongest(findings, evidence.records, evidence.cautious, shapes, alpha, case.seed)
    # A simulation does not go otherwise once.
    if is_there.present and not settings.of_simulations:
        by_noise = next(f.p_value for f in findings if f.statistic == is_there.statistic)
        is_there = _without_one_trial(is_there, by_noise, case, evidence, inflation, warnings)
    log.info("%s %.2f, threshold %.2f", is_there.statistic, is_there.value, is_there.threshold)
    explanations = screened_only(evidence)
    if is_there.present:
        explanations = fit_all(evidence, model, case.threads, warnings)
    # Who yields to an effect is found sooner than who keeps the movement.
    firm = list(evidence.known.values())[-1]
    error, shown = evidence.settings.signature_error, is_there.shape_thresholds
    if _lone(evidence):
        # One trial has to tell as much as two: less is not promised.
        surer = tested(evidence.cautious, shapes, alpha**2, inflation, case.seed)[1]
        shown = surer[0].shape_thresholds
    seen = smallest_detectable(firm, evidence.cautious, shown, error, case.seed)
    able = silence_tells((one.label for one in firm), (one.label for one in seen))
    judged = judge(evidence, explanations, is_there, weighing, inflation, case.seed, able)
    told = answer(Findings(case, evidence, is_there, found, seen, judged), warnings)
    rows = baseline_labels(evidence.residual, evidence.screened, evidence.prior)
    return replace(
        told,
        hashes={"null_bank": None if bank is None else bank.hash},
        curves={**told.curves, "baselines": table_of(BaselinesRow, rows)},
    )


def _bank(case: Case, settings: GapSettings) -> tuple[null_bank.NullBank | None, str]:
    """The null bank, if it is of such cases, and else why not."""
    if settings.of_simulations:
        return None, OF_SIMULATIONS
    if case.one_movement:
        return None, NO_BANK_OF_ONE_MOVEMENT
    if settings.view != "tracking":
        return None, NO_BANK_OF_PREDICTIONS
    return null_bank.read_bank(null_bank.bank_file(settings), settings)


def _without_one_trial(
    found: Presence,
    by_noise: float,
    case: Case,
    evidence: Evidence,
    inflation: float,
    warnings: list[str],
) -> Presence:
    """A finding that does not rest on one trial, or else none; `warnings` names the trial.

    `by_noise` is the p value that the finding had before trials changed places.
    """
    settings = evidence.settings
    difference = evidence.signatures, evidence.cautious, evidence.shapes()
    odd = rests_on_one(evidence.records, *difference, settings, inflation, case.seed)
    if odd is not None:
        warnings.append(in_words(odd, odd.trial.name(case)))
        return contradicted(found, odd, settings.alpha)
    lone = _lone(evidence)
    warnings += [alone_in_words(one, one.name(case)) for one in lone]
    return as_sure_as_two(found, by_noise, settings.alpha) if lone else found


def _lone(evidence: Evidence) -> tuple[OneTrial, ...]:
    """Trials that cannot be left out; a simulation does not go otherwise once."""
    if evidence.settings.of_simulations:
        return ()
    return alone(evidence.records)


def _for_emg_unit(settings: GapSettings, case: Case, warnings: list[str]) -> GapSettings:
    """Settings that know less about EMG gains if each recording has a maximum of its own."""
    if not case.channels or case.participant.emg_is_of_mvc:
        return settings
    if case.emg_has_one_maximum:
        whose = "test and reference trials" if case.reference else "all trials"
        said = case.participant.emg_unit == "fraction_of_shared_max"
        verb = "is" if said else "looks like"
        warnings.append(f"EMG {verb} a fraction of maxima that {whose} share")
        return settings
    warnings.append("EMG is a fraction of each recording's own maximum: its gains count for little")
    own = settings.session.emg_own_maximum
    return replace(settings, session=replace(settings.session, emg_gain=own))
