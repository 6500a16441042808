"""How much of the gap on a hidden task an answer removes: the truth that shrinkage is scored by.

The parameters of the answer, and how much of the effect it found in each channel of this person,
predict the change on a task that it never saw, with nothing fitted again, and are compared with
curves of that task free of noise.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from scapulohumeral.errors import SolveError
from scapulohumeral.gap.assembly import (
    bias_and_following,
    effects_of,
    settings_of_signatures,
)
from scapulohumeral.gap.benchmark.noise_free.trial import noise_free_trial
from scapulohumeral.gap.benchmark.protocol import folder_request
from scapulohumeral.gap.benchmark.scored_case import HiddenGap, ScoredCase
from scapulohumeral.gap.curve_files import read_table
from scapulohumeral.gap.effects.base import Effect
from scapulohumeral.gap.explained import remaining
from scapulohumeral.gap.labels import JOIN, MOVED
from scapulohumeral.gap.nominal.participant_model import (
    ModelSettings,
    ParticipantModel,
    participant_model,
)
from scapulohumeral.gap.recording.case import Case, EmgSeries, GapTrial, make_case
from scapulohumeral.gap.recording.observables import difference, phase_functions, without
from scapulohumeral.gap.residual.differences import read_records, repeat_noise
from scapulohumeral.gap.residual.noise import SessionShares, total_covariance
from scapulohumeral.gap.residual.residual import Residual, compress
from scapulohumeral.gap.run import read_case
from scapulohumeral.gap.settings import GapSettings, read_diagnosis_config, read_settings
from scapulohumeral.gap.signatures.of_tasks import STIFFNESSES, task_signatures
from scapulohumeral.gap.signatures.resolve import Resolve, recorded_change

log = logging.getLogger(__name__)


def hidden_shrinkage(
    scored: ScoredCase, candidate: Mapping[str, Any], config_file: Path, cache: Path
) -> HiddenGap | None:
    """Noise-free gap on the hidden task, before and after a candidate with its parameters.

    What two recordings of one person differ by is taken as the diagnosis found it.

    Parameters
    ----------
    scored : case, its answer and its opened key
    candidate : one of the answer
    config_file, cache : as for the diagnosis; the model is fitted over the hidden task, too

    Returns
    -------
    HiddenGap | None                 None if the hidden movement cannot be solved, the candidate
                                     predicts nothing of it, it is the same with the cause, or
                                     EMG that the case compares does not change on it

    Raises
    ------
    DataError                        the answer lacks its table of errors or of factors
    """
    if candidate["label"] == MOVED:
        # Another movement has no shape of its own that could be carried to an unseen task.
        return None
    sides = scored.key["hidden_task"]
    if scored.key["mode"]["reference"] and sides["test"] == sides["reference"]:
        # Who keeps a movement may show nothing of a cause in the channels that were recorded.
        return None
    config = read_diagnosis_config(config_file)
    settings, model_settings = read_settings(config), ModelSettings.of(config)
    case = read_case(folder_request(scored.folder, config_file, cache), config)
    test, reference = (
        _with_channels(noise_free_trial(sides[side], scored.key["channels"], "hidden", side), case)
        for side in ("test", "reference")
    )
    references = [reference] if case.reference else []
    whole = make_case(case.participant, [*case.test, test], [*case.reference, *references])
    hidden = replace(case, test=(test,), reference=tuple(references))
    if hidden.channels != case.channels:
        # A muscle that never changes on this task tells nothing of what the answer says of it.
        return None
    errors = read_table(scored.answer_folder, "errors").set_index("error")["value"]
    table = read_table(scored.answer_folder, "factors")
    factors = table[table["label"] == candidate["label"]].pivot(
        index="effect", columns="channel", values="factor"
    )
    try:
        model = participant_model(whole, model_settings, cache)
        c, removed = _compared(case, hidden, candidate, factors, errors, model, settings)
    except SolveError as error:
        log.warning("%s: hidden task: %s", scored.folder.name, error)
        return None
    return HiddenGap(*remaining(c, removed))


def _with_channels(trial: GapTrial, case: Case) -> GapTrial:
    """A trial with the EMG channels that a case compares: one that was off there has no answer."""
    if trial.emg is None or not case.channels:
        return replace(trial, emg=None)
    own = EmgSeries(trial.emg.time_s, case.channels, trial.emg.of(case.channels))
    return replace(trial, emg=own)


def _ordered(effects: Sequence[Effect], candidate: Mapping[str, Any]) -> list[Effect]:
    """The effects of a candidate in the order of its label, as its parameters are."""
    known = {effect.label: effect for effect in effects}
    return [known[label] for label in candidate["label"].split(JOIN)]


def _compared(
    case: Case,
    hidden: Case,
    candidate: Mapping[str, Any],
    factors: pd.DataFrame,
    errors: pd.Series,
    model: ParticipantModel,
    settings: GapSettings,
) -> tuple[Residual, np.ndarray]:
    """The difference on the hidden task, and the change (D,) that a candidate predicts.

    `factors` has effects as rows and channels as columns, `errors` what the diagnosis found of
    person and sessions.
    """
    stiffness, shares = float(errors["stiffness"]), _shares(errors)
    records = read_records(case, model, settings, [])
    effects = _ordered(effects_of(case, records, model, settings), candidate)
    unseen = read_records(hidden, model, settings, [])
    [mean_record], [[test]] = unseen.mean_records.values(), unseen.test.values()
    last, local = bias_and_following(case, records), settings_of_signatures(settings, records)
    of_task = task_signatures(
        "hidden", mean_record, test.duration_s, model, effects, records.sensors, local, *last
    )
    test = without(test, of_task.tempo)
    spread, base = None, mean_record
    if not records.reference:
        of_task, base = of_task.of_residual(), of_task.nominal
        spread = settings.model
    functions = phase_functions(settings.nodes, settings.phase_functions)
    noise = repeat_noise(records, functions, settings)
    # As exact as the difference between means of the visible trials of one task.
    sides = [trials for trials in (case.test, case.reference) if trials]
    one = np.mean(list(noise.covariances.values()), axis=0)
    repeats = one * sum(len(records.test) / len(trials) for trials in sides)
    whole = total_covariance(repeats, [of_task], functions, records.channels, spread, shares)
    residual = Residual(
        delta=compress([difference(test, base)], functions),
        covariance=whole,
        noise=repeats,
        functions=functions,
        tasks=("hidden",),
        channels=records.channels,
        degrees=(min(noise.worth.values()),),
    )
    values = iter([parameter["value"] for parameter in candidate["parameters"]])
    change = np.zeros_like(residual.delta)
    slopes = of_task.effects[STIFFNESSES.index(stiffness)]
    for effect, slope in zip(effects, slopes, strict=True):
        x = np.array([p.internal(next(values)) for p in effect.params])
        if not records.reference:
            own = np.tensordot(x, slope, 1)
        elif effect.changes_body:
            person = Resolve.kept(model, of_task, stiffness, records.sensors, settings)
            own = person.solved(effect, x).change
        else:
            own = recorded_change(effect, x, of_task)[0]
        of_person = factors.loc[effect.label, list(records.channels)].to_numpy()
        change += compress([of_person * own], functions)
    return residual, change


def _shares(errors: pd.Series) -> SessionShares:
    """What a diagnosis found most probable of the sessions."""
    return SessionShares(float(errors["marker_share"]), float(errors["electrode_share"]))
