"""Nominal movements solved and differentiated, and records compared with them.

Letters: N nodes, K channels, C EMG channels, D coefficients, P parameters.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.gap import decide
from scapulohumeral.gap.attribute import Hypothesis
from scapulohumeral.gap.case import Case
from scapulohumeral.gap.effects.base import Effect, Setup
from scapulohumeral.gap.evidence import Evidence, most_probable
from scapulohumeral.gap.floor import compress
from scapulohumeral.gap.forward import nominal_body
from scapulohumeral.gap.library import library
from scapulohumeral.gap.locate import disturbances
from scapulohumeral.gap.observe import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.participant_model import ParticipantModel
from scapulohumeral.gap.records import Records, differences, repeat_noise, solved_part
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.gap.signatures import FIRMNESS, Recorder, Response, respond
from scapulohumeral.gap.workers import side_by_side

SHOULDER_JOINTS = 3


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
    records = solved_part(records, found, warnings)
    if not records.reference:
        responses = tuple(response.of_residual() for response in responses)
    functions = phase_functions(settings.nodes, settings.phase_functions)
    noise = repeat_noise(records, functions, settings)
    if not noise.degrees:
        warnings.append("no task was repeated: noise levels are those of the configuration")
    groups = nominal_body(model, settings.nodes).groups
    whole, trials = differences(records, responses, noise, functions)
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
    owns = [
        _own_levels(effect, functions, responses, (records.recorder, groups)) for effect in effects
    ]
    firmnesses = FIRMNESS if records.reference else FIRMNESS[:1]
    return most_probable(
        evidence, {f: _linearised(effects, functions, responses, owns, f) for f in firmnesses}
    )


def _respond_or_reason(*job: Any) -> Response | SolveError:
    try:
        return respond(*job)
    except SolveError as error:
        return error


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
    owns: Sequence[np.ndarray | None],
    firmness: float,
) -> tuple[Hypothesis, ...]:
    """All effects at the nominal solutions; `owns` as for :class:`Hypothesis`."""
    kept = [response.effects[FIRMNESS.index(firmness)] for response in responses]
    found = []
    for i, (effect, own) in enumerate(zip(effects, owns, strict=True)):
        slope = compress([changes[i] for changes in kept], functions)
        nothing, off = np.zeros((len(slope), 1)), np.zeros(slope.shape[1])
        found.append(Hypothesis((effect,), off, nothing, slope, own))
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
