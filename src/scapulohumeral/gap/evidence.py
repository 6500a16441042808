"""What a case is decided from: records, nominal solutions, differences, and effects screened.

Letters: T tasks, N nodes, K channels, D coefficients.
"""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag
from scipy.special import logsumexp

from scapulohumeral.errors import SolveError
from scapulohumeral.gap import decide
from scapulohumeral.gap.attribute import (
    Fit,
    Hypothesis,
    black_box_evidence,
    fit,
    no_gap_evidence,
)
from scapulohumeral.gap.case import Case, GapTrial
from scapulohumeral.gap.effects.base import Effect, Observed, Setup
from scapulohumeral.gap.floor import Comparison, Noise, compress, total_covariance, trial_noise
from scapulohumeral.gap.forward import nominal_body
from scapulohumeral.gap.library import library
from scapulohumeral.gap.locate import Disturbances, disturbances
from scapulohumeral.gap.observe import (
    KINEMATIC_CHANNELS,
    channel_names,
    difference,
    electrode_matrix,
    mean,
    phase_functions,
    recorded,
)
from scapulohumeral.gap.pairs import paired
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.shrinkage import TrialDifference
from scapulohumeral.gap.signatures import FIRMNESS, Recorder, Response, respond
from scapulohumeral.gap.workers import side_by_side

log = logging.getLogger(__name__)

SHOULDER_JOINTS = 3
# Shares of what sessions are assumed to change, and of the signature error: the most probable ones
# are taken. Some people repeat themselves better than others, and laboratories their preparations;
# and the model resembles some people more than others.
SESSION_SHARES = (1.0, 0.5, 0.25)
ERROR_SHARES = (1.0, 1.0 / 3.0)


@dataclass(frozen=True, eq=False)
class Records:
    """Recorded trials of the tasks that are compared.

    Attributes
    ----------
    test, reference : task -> trials; no reference in no-reference mode
    anchors : task -> mean record to which changes are relative
    recorder : what is recorded; channels : (K,) names
    """

    test: Mapping[str, Sequence[Observed]]
    reference: Mapping[str, Sequence[Observed]]
    anchors: Mapping[str, Observed]
    recorder: Recorder
    channels: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Evidence:
    """What the decision is made from.

    Attributes
    ----------
    comparison : difference to explain; trials : of single test trials
    noise : between repeats
    effects, prior : the library and the prior of its labels, alone and in pairs
    hypotheses : the effects linearised at the nominal solutions
    recorder : what is recorded
    responses : nominal solutions
    boxes : smooth disturbances
    referenced : whether the difference is that to reference trials, else to the prediction
    firmness : most probable one with which the person keeps a movement against effects
    session_share : most probable share of what sessions are assumed to change
    settings : those of the diagnosis, with the most probable signature error
    screened : all effects fitted to derivatives at the nominal solutions
    """

    comparison: Comparison
    trials: tuple[TrialDifference, ...]
    noise: Noise
    effects: tuple[Effect, ...]
    prior: dict[str, float]
    hypotheses: tuple[Hypothesis, ...]
    recorder: Recorder
    responses: tuple[Response, ...]
    boxes: Disturbances
    referenced: bool
    firmness: float
    session_share: float
    settings: GapSettings
    screened: tuple[Fit, ...]


def read_records(
    case: Case, model: ParticipantModel, settings: GapSettings, warnings: list[str]
) -> Records:
    """Records of the tasks that have trials on both sides, or of all without reference trials.

    `warnings` gets one sentence per task that is left out.
    """

    def observed(trials: Iterable[GapTrial]) -> dict[str, list[Observed]]:
        tasks: dict[str, list[Observed]] = {}
        for trial in trials:
            one = recorded(trial, case.channels, case.has_contact, settings.nodes)
            tasks.setdefault(trial.task, []).append(one)
        return tasks

    test, reference = observed(case.test), observed(case.reference)
    common = [task for task in test if task in reference]
    if case.reference and not common:
        warnings.append("no task has both test and reference trials: compared with the model alone")
    elif case.reference and len(common) < len(test):
        left = ", ".join(sorted(set(test) - set(common)))
        warnings.append(f"tasks without reference trials are left out: {left}")
    tasks = common or list(test)
    base = reference if common else test
    groups = nominal_body(model, settings.nodes).groups
    electrodes = electrode_matrix(
        [case.participant.emg_channels[name] for name in case.channels], groups
    )
    return Records(
        test={task: test[task] for task in tasks},
        reference={task: reference[task] for task in tasks} if common else {},
        anchors={task: mean(base[task]) for task in tasks},
        recorder=Recorder(case.channels, electrodes, case.has_contact),
        channels=channel_names(case.channels, case.has_contact),
    )


def effects_of(case: Case, model: ParticipantModel, settings: GapSettings) -> tuple[Effect, ...]:
    """All effects of the library that a case can have."""
    body = nominal_body(model, settings.nodes)
    moving = body.groups[body.crossing[:, :SHOULDER_JOINTS].any(axis=1)]
    setup = Setup(
        tuple(sorted(set(moving.tolist()))),
        case.channels,
        case.participant.neighbours,
        case.has_contact,
    )
    return library(setup)


def gather(
    case: Case,
    records: Records,
    model: ParticipantModel,
    settings: GapSettings,
    warnings: list[str],
) -> Evidence:
    """Solve and differentiate the nominal movements, and compare records with them.

    Raises
    ------
    SolveError                       a nominal movement cannot be solved
    """
    effects = effects_of(case, model, settings)
    local = settings
    if not records.reference:
        # Errors of electrodes and of the model's EMG levels are one unknown here.
        session = replace(settings.session, emg_gain=settings.model.emg_gain)
        local = replace(settings, session=session)
    jobs = [
        (task, anchor, model, effects, records.recorder, local)
        for task, anchor in records.anchors.items()
    ]
    found = side_by_side(_respond_or_reason, jobs, case.threads)
    responses = tuple(one for one in found if isinstance(one, Response))
    records = _solved_part(records, found, warnings)
    if not records.reference:
        responses = tuple(response.of_residual() for response in responses)
    functions = phase_functions(settings.nodes, settings.phase_functions)
    noise = repeat_noise(records, functions, settings)
    if not noise.degrees:
        warnings.append("no task was repeated: noise levels are those of the configuration")
    groups = nominal_body(model, settings.nodes).groups
    whole, trials = _differences(records, responses, noise, functions)
    reserved = settings.prior_no_gap + settings.prior_none
    single = decide.priors(effects, reserved)
    evidence = Evidence(
        comparison=whole,
        trials=trials,
        noise=noise,
        effects=effects,
        prior={**single, **decide.pair_priors(single, reserved)},
        hypotheses=(),
        recorder=records.recorder,
        responses=responses,
        boxes=disturbances(responses, functions, records.channels, settings.noise.emg),
        referenced=bool(records.reference),
        firmness=1.0,
        session_share=1.0,
        settings=settings,
        screened=(),
    )
    known = {
        firmness: _linearised(effects, functions, responses, (records.recorder, groups), firmness)
        for firmness in (FIRMNESS if records.reference else FIRMNESS[:1])
    }
    best = _most_probable(evidence, known)
    singles = (replace(t, comparison=_supposed(best, t.comparison)) for t in best.trials)
    return replace(best, trials=tuple(singles))


def _most_probable(evidence: Evidence, known: Mapping[float, tuple[Hypothesis, ...]]) -> Evidence:
    """Evidence with what is most probable of the person, the sessions and the signature error.

    Parameters
    ----------
    evidence : without effects; known : effects by firmness. Without reference trials that is the
        loosest: the prediction follows the recording, however firmly that was kept

    Notes
    -----
    All sessions are tried for the loosest; for firmer ones only if these are more probable with the
    one that was found for it.
    """
    # Without reference trials the model's own error counts far more than what sessions change.
    shares = SESSION_SHARES if evidence.referenced else SESSION_SHARES[:1]
    every = [(share, error) for share in shares for error in ERROR_SHARES]

    def tried(firmness: float, errors: tuple[float, float]) -> _Tried:
        kept = replace(evidence, firmness=firmness, hypotheses=known[firmness])
        supposed = _supposing(kept, *errors)
        found = _Tried(_density(supposed), errors, supposed)
        log.info("firmness %g, session and error %s: %.1f", firmness, errors, found.density)
        return found

    loosest, *firmer = known
    best = max((tried(loosest, errors) for errors in every), key=_Tried.rank)
    for firmness in firmer:
        alike = [errors for errors in every if errors[0] == best.errors[0]]
        first = max((tried(firmness, errors) for errors in alike), key=_Tried.rank)
        if first.density > best.density:
            others = [tried(firmness, errors) for errors in every if errors not in alike]
            best = max((first, *others), key=_Tried.rank)
    return best.evidence


@dataclass(frozen=True, eq=False)
class _Tried:
    """Evidence with shares (session, error) of what is assumed, and its log density."""

    density: float
    errors: tuple[float, float]
    evidence: Evidence

    def rank(self) -> float:
        """By which the most probable one is found."""
        return self.density


def _supposing(evidence: Evidence, session: float, error: float) -> Evidence:
    """Evidence with shares of what sessions change and of the signature error, screened."""
    relative = error * evidence.settings.signature_error
    evidence = replace(
        evidence,
        session_share=session,
        settings=replace(evidence.settings, signature_error=relative),
    )
    c = _supposed(evidence, evidence.comparison)
    screened = tuple(fit(hypothesis, c, relative) for hypothesis in evidence.hypotheses)
    return replace(evidence, comparison=c, screened=screened)


def _supposed(evidence: Evidence, c: Comparison) -> Comparison:
    """A comparison with what sessions change, and without reference the model's own error."""
    model = None if evidence.referenced else (evidence.settings.model, c.channels)
    responses = [r for r in evidence.responses if r.task in c.tasks]
    share = evidence.session_share
    covariance = total_covariance(c.noise, responses, c.functions, model, share)
    return replace(c, covariance=covariance)


def _density(evidence: Evidence) -> float:
    """Log density of the difference, over all explanations.

    Pairs are among them, or what one of two effects leaves would count as an error.
    """
    c, settings = evidence.comparison, evidence.settings
    pairs = paired(evidence.screened, evidence.prior, c, settings.signature_error)
    known = [*evidence.screened, *pairs]
    logs = [f.log_evidence + np.log(evidence.prior[f.label]) for f in known]
    logs.append(black_box_evidence(c, evidence.boxes.columns) + np.log(settings.prior_none))
    logs.append(no_gap_evidence(c) + np.log(settings.prior_no_gap))
    _, logdet = np.linalg.slogdet(c.covariance)
    return float(logsumexp(logs) - 0.5 * logdet)


def _respond_or_reason(*job: Any) -> Response | SolveError:
    try:
        return respond(*job)
    except SolveError as error:
        return error


def _solved_part(
    records: Records, found: Sequence[Response | SolveError], warnings: list[str]
) -> Records:
    """Records of the tasks whose nominal movement was solved.

    Raises
    ------
    SolveError                       none was
    """
    faults = {
        task: one
        for task, one in zip(records.anchors, found, strict=True)
        if isinstance(one, SolveError)
    }
    if len(faults) == len(records.anchors):
        raise next(iter(faults.values()))
    warnings += [f"task {task} is left out: {error}" for task, error in faults.items()]
    kept = [task for task in records.anchors if task not in faults]
    return replace(
        records,
        test={task: records.test[task] for task in kept},
        reference={task: records.reference[task] for task in kept if records.reference},
        anchors={task: records.anchors[task] for task in kept},
    )


def repeat_noise(records: Records, functions: np.ndarray, settings: GapSettings) -> Noise:
    """Covariance of one trial, from all that was repeated."""
    groups = [
        np.stack([difference(one, records.anchors[task]) for one in trials])
        for side in (records.test, records.reference)
        for task, trials in side.items()
    ]
    return trial_noise(groups, records.channels, functions, settings.noise)


def _differences(
    records: Records, responses: Sequence[Response], noise: Noise, functions: np.ndarray
) -> tuple[Comparison, tuple[TrialDifference, ...]]:
    """Mean differences and those of single trials; their covariance is that between repeats."""
    tasks = tuple(records.anchors)
    bases = [records.anchors[r.task] if records.reference else r.nominal for r in responses]
    singles = [
        [difference(one, base) for one in records.test[task]]
        for task, base in zip(tasks, bases, strict=True)
    ]
    counts = [len(records.reference.get(task, ())) for task in tasks]

    def made(curves_: Sequence[np.ndarray], trials: Sequence[int], index: range) -> Comparison:
        weights = [
            1.0 / n + (1.0 / counts[i] if counts[i] else 0.0)
            for n, i in zip(trials, index, strict=True)
        ]
        repeats = block_diag(*(weight * noise.covariance for weight in weights))
        return Comparison(
            delta=compress(curves_, functions),
            covariance=repeats,
            noise=repeats,
            functions=functions,
            tasks=tuple(tasks[i] for i in index),
            channels=records.channels,
            degrees=noise.worth,
        )

    whole = made(
        [np.mean(curves_, axis=0) for curves_ in singles],
        [len(curves_) for curves_ in singles],
        range(len(tasks)),
    )
    trials = tuple(
        TrialDifference(task, made([curve], [1], range(i, i + 1)))
        for i, task in enumerate(tasks)
        for curve in singles[i]
    )
    return whole, trials


def _emg_curves(emg: np.ndarray, channels: int) -> np.ndarray:
    """EMG (N, C) among K channels, (N, K), zero in the others."""
    curves = np.zeros((len(emg), channels))
    first = len(KINEMATIC_CHANNELS)
    curves[:, first : first + emg.shape[1]] = emg
    return curves


def _linearised(
    effects: Sequence[Effect],
    functions: np.ndarray,
    responses: Sequence[Response],
    seen: tuple[Recorder, np.ndarray],
    firmness: float,
) -> tuple[Hypothesis, ...]:
    """All effects at the nominal solutions; `seen` are electrodes and groups (M,) of muscles."""
    found = []
    kept = [response.effects[FIRMNESS.index(firmness)] for response in responses]
    for i, effect in enumerate(effects):
        slope = compress([changes[i] for changes in kept], functions)
        own = _own_levels(effect, functions, responses, seen)
        found.append(
            Hypothesis((effect,), np.zeros(slope.shape[1]), np.zeros((len(slope), 1)), slope, own)
        )
    return tuple(found)


def _own_levels(
    effect: Effect,
    functions: np.ndarray,
    responses: Sequence[Response],
    seen: tuple[Recorder, np.ndarray],
) -> np.ndarray | None:
    """EMG (D, P) of the anchors as far as it comes from muscles that an effect changes themselves.

    It changes with the primary parameter.
    """
    recorder, groups = seen
    if not effect.changes_muscle or not recorder.channels:
        return None
    share = recorder.electrodes @ (groups == effect.member)
    if not np.any(share):
        return None
    anchors = [response.anchor for response in responses]
    count = responses[0].session.shape[-1]
    levels = compress([_emg_curves(share * np.asarray(a.emg), count) for a in anchors], functions)
    return np.outer(levels, np.eye(len(effect.params))[0])
