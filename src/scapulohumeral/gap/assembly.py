"""Nominal movements solved and differentiated, and records compared with them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.effects.base import Effect, Setup
from scapulohumeral.gap.effects.library import library
from scapulohumeral.gap.isolation import priors
from scapulohumeral.gap.isolation.empirical_bayes import Evidence, most_probable
from scapulohumeral.gap.isolation.hypothesis import Hypothesis
from scapulohumeral.gap.nominal.optimal_movement import movement, nominal_body
from scapulohumeral.gap.nominal.participant_model import ParticipantModel
from scapulohumeral.gap.parallel import side_by_side
from scapulohumeral.gap.recording.case import Case
from scapulohumeral.gap.recording.observables import phase_functions
from scapulohumeral.gap.residual.differences import (
    Records,
    at_one_tempo,
    folds,
    halves,
    mean_difference,
    repeat_noise,
    solved_part,
)
from scapulohumeral.gap.residual.emg_level import at_level_of_model
from scapulohumeral.gap.residual.noise import SessionShares, scatterings
from scapulohumeral.gap.residual.residual import compress
from scapulohumeral.gap.residual.unknown_input import (
    UnknownInputs,
    unknown_errors,
    unknown_inputs,
)
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures.of_tasks import STIFFNESSES, TaskSignatures, task_signatures

SHOULDER_JOINTS = 3
NO_LEVEL = (
    "EMG has no level: each channel is taken to be as high as the model predicts, so amplitudes of "
    "causes that it tells rest on the model"
)


def effects_of(
    case: Case, records: Records, model: ParticipantModel, settings: GapSettings
) -> tuple[Effect, ...]:
    """All effects of the library that a case can have."""
    body = nominal_body(model, settings.nodes)
    moving = body.groups[body.crossing[:, :SHOULDER_JOINTS].any(axis=1)]
    setup = Setup(
        tuple(sorted(set(moving.tolist()))),
        case.channels,
        case.participant.neighbours,
        case.has_contact,
        of_one_person=records.of_one_person,
        simulated=settings.of_simulations,
        unmeasured=frozenset(records.sensors.unmeasured),
        of_one_movement=records.of_one_movement,
    )
    return library(setup)


def settings_of_signatures(settings: GapSettings, records: Records) -> GapSettings:
    """Settings by which records are linearised.

    Without reference trials, errors of electrodes and of the model's EMG levels are one unknown.
    """
    if records.reference:
        return settings
    return replace(settings, session=replace(settings.session, emg_gain=settings.model.emg_gain))


def bias_and_following(case: Case, records: Records) -> tuple[bool, bool]:
    """Last arguments of `task_signatures`.

    EMG tells how muscles are driven without effects if there are reference trials and its level is
    known. Without reference trials the prediction follows the records that it is compared with.
    """
    referenced = bool(records.reference)
    return referenced and case.participant.emg_is_of_mvc, not referenced


def assemble(
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
    effects = effects_of(case, records, model, settings)
    local = settings_of_signatures(settings, records)
    last = bias_and_following(case, records)
    # The set-up that all movements of the model share, before processes part.
    movement(model, next(iter(records.mean_records.values())), local)
    if case.channels and not case.participant.emg_is_of_mvc:
        records = at_level_of_model(records, model, local, case.threads)
        warnings.append(NO_LEVEL)
    durations_s = records.durations_s
    jobs = [
        (task, one, durations_s[task], model, effects, records.sensors, local, *last)
        for task, one in records.mean_records.items()
    ]
    found = side_by_side(_respond_or_reason, jobs, case.threads)
    signatures = tuple(one for one in found if isinstance(one, TaskSignatures))
    records = at_one_tempo(solved_part(records, found, warnings), signatures, warnings)
    if not records.reference:
        signatures = tuple(of_task.of_residual() for of_task in signatures)
    functions = phase_functions(settings.nodes, settings.phase_functions)
    noise = repeat_noise(records, functions, settings)
    if noise.source != "repeats":
        warnings.append("no task was repeated: noise levels are those of the configuration")
    whole = mean_difference(records, signatures, noise, functions)
    reserved = settings.prior_no_gap + settings.prior_none + settings.prior_moved
    single = priors.priors(effects, reserved)
    # A simulation gives way as its model says; without reference trials nothing tells.
    stiffnesses = STIFFNESSES if records.of_one_person else STIFFNESSES[:1]
    evidence = Evidence(
        residuals={0.0: whole},
        cautious=whole,
        folds=folds(records, signatures, noise, functions),
        halves=halves(records, signatures, functions),
        noise=noise,
        effects=effects,
        prior={**single, **priors.pair_priors(single, reserved)},
        records=records,
        signatures=signatures,
        unknown_inputs=_unknown(signatures, functions, records, settings),
        session_shares=SessionShares(1.0, 1.0),
        scatter=dict.fromkeys(scatterings(whole), 1.0),
        settings=settings,
        known={f: _linearised(effects, functions, signatures, f) for f in stiffnesses},
        fits={},
    )
    return most_probable(evidence)


def _unknown(
    signatures: Sequence[TaskSignatures],
    functions: np.ndarray,
    records: Records,
    settings: GapSettings,
) -> UnknownInputs:
    """What may act that no effect names: on the body, or of one movement on its records alone."""
    of_case = unknown_errors if records.of_one_movement else unknown_inputs
    return of_case(signatures, functions, records.channels, settings.noise)


def _respond_or_reason(*job: Any) -> TaskSignatures | SolveError:
    try:
        return task_signatures(*job)
    except SolveError as error:
        return error


def _linearised(
    effects: Sequence[Effect],
    functions: np.ndarray,
    signatures: Sequence[TaskSignatures],
    stiffness: float,
) -> tuple[Hypothesis, ...]:
    """All effects at the nominal solutions."""
    every = [of_task.effects[STIFFNESSES.index(stiffness)] for of_task in signatures]
    found = []
    for i, effect in enumerate(effects):
        slope = compress([changes[i] for changes in every], functions)
        nothing, off = np.zeros((len(slope), 1)), np.zeros(slope.shape[1])
        # However firmly a movement is kept, the record of it is the same.
        kept = stiffness if effect.changes_body else STIFFNESSES[0]
        found.append(Hypothesis((effect,), off, nothing, slope, kept))
    return tuple(found)
