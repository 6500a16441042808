"""What a configuration asks for: trials, tasks and conditions of each participant, and checks.

The workflow turns this into files. It is planned without reading any recorded motion.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from scapulohumeral.configuration.check import check_config
from scapulohumeral.emg.accuracy import channel_gain
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.errors import ConfigError
from scapulohumeral.model.choices import read_choices
from scapulohumeral.model.participant_file import (
    common_load,
    list_participants,
    read_participant_file,
)
from scapulohumeral.model.published_arm import NODE_S, PUBLISHED_PLANES
from scapulohumeral.model.tables import read_tables
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.problems.variants import named_variants
from scapulohumeral.provenance import CONFIG_FOLDER, MODEL_TABLES

# The condition of static postures and of daily tasks.
HEALTHY = "healthy"
# Where a prediction may start that is no other prediction.
STARTS = ("tracking", "direct")
# Recordings of EMG that belong to no single trial.
WHOLE_RECORDINGS = ("mvc", "composite")
# What follows the name of a condition in files beside its solution.
TABLES_BESIDE = ("_opensim", "_audited", "_geometry")
# Arms that simulate EMG, a file per participant.
PLANTS = CONFIG_FOLDER / "plant"


@dataclass(frozen=True)
class Study:
    """A configuration with the participants that it names.

    Attributes
    ----------
    config : content of a configuration file; make a study with :func:`planned`, which checks it
    folder : of all participants
    """

    config: Mapping[str, Any]
    folder: Path

    @cached_property
    def files(self) -> dict[str, dict[str, Any]]:
        """Content of each participant's file, configured or not."""
        names = dict.fromkeys((*self.participants, *self.config["diagnose"]))
        return {name: read_participant_file(self.folder, name) for name in names}

    @property
    def participants(self) -> list[str]:
        """Names of the participants to simulate."""
        return self.config["participants"]

    @property
    def planes(self) -> list[str]:
        """Elevations to track, in the order of the composite motion."""
        return self.config["planes"]

    def trials(self, participant: str) -> dict[str, Path]:
        """Recorded motion of each trial of a participant, configured or not."""
        trials = self._file(participant)["trials"]
        return {name: self.folder / participant / trial["file"] for name, trial in trials.items()}

    def recordings(self, participant: str) -> list[Path]:
        """Recorded motions of a participant, configured or not, each once."""
        return list(dict.fromkeys(self.trials(participant).values()))

    def recording(self, participant: str, trial: str) -> Path:
        """Recorded motion of one trial.

        Raises
        ------
        ConfigError                  the participant has no such trial
        """
        trials = self.trials(participant)
        if trial not in trials:
            raise ConfigError(
                f"participant '{participant}' has no trial '{trial}'; "
                f"choose from {', '.join(trials)}."
            )
        return trials[trial]

    def elevations(self, participant: str) -> list[Path]:
        """Recorded motions of a participant but for daily tasks, configured or not, each once."""
        trials = self.trials(participant)
        paths = (path for name, path in trials.items() if not self.is_task(participant, name))
        return list(dict.fromkeys(paths))

    def raw_emg(self, participant: str, trial: str, simulated: Path) -> dict[str, Path]:
        """Raw EMG of a trial, and the maximal contractions that it is normalised by.

        Parameters
        ----------
        simulated : folder of simulated EMG of all participants
        """
        emg = self.measured_emg(participant)
        own = self.folder / participant
        if trial in emg["trials"]:
            return {"raw": own / emg["trials"][trial], "mvc": own / emg["mvc"]}
        made = simulated / participant
        return {"raw": made / f"{trial}_raw.csv", "mvc": made / "mvc_raw.csv"}

    def published_composite(self, participant: str) -> Path:
        """Published healthy prediction of a participant, whose arm a variant follows.

        Raises
        ------
        ConfigError                  the participant's file lists none
        """
        listed = self._file(participant).get("published_predictions", {})
        if "healthy" not in listed:
            raise ConfigError(
                f"{self.folder / participant / 'participant.yaml'} lists no "
                "published_predictions.healthy, whose arm is followed by variants and by "
                "'model.paths: published'. Leave the participant out of 'variants.predict', or "
                "write 'paths: das3'"
            )
        return self.folder / participant / str(listed["healthy"])

    def simulates_emg(self, participant: str) -> bool:
        """Whether the EMG of any configured elevation of a participant is simulated."""
        measured = self.measured_emg(participant)["trials"]
        return any(plane not in measured for plane in self.planes)

    def tasks(self, participant: str) -> list[str]:
        """Configured daily tasks that a participant has a recording of."""
        trials = self._file(participant)["trials"]
        return [task for task in self.config["validation"]["tasks"] if task in trials]

    def condition(self, name: str, participant: str) -> Mapping[str, Any]:
        """Settings of one predicted shoulder of a participant."""
        section = self.config["prediction"]
        generic = {"parameters": "generic"} if participant in section["generic_muscles"] else {}
        return {**section["conditions"][name], **generic}

    def conditions(self, participant: str) -> list[str]:
        """Conditions that are predicted for a participant."""
        chosen = self.config["prediction"]
        also = chosen["predict_also"].get(participant, [])
        return list(dict.fromkeys([*chosen["predict"], *also]))

    def predicted(self) -> list[tuple[str, str]]:
        """All pairs of participant and condition that are predicted."""
        return [(name, each) for name in self.participants for each in self.conditions(name)]

    def predicted_tasks(self) -> list[tuple[str, str]]:
        """All pairs of participant and daily task whose arm the healthy shoulder follows.

        None where no elevation is predicted, because they are judged beside these.
        """
        tasks = self.config["prediction"]["tasks"] if self.predicted() else []
        return [(n, task) for n in self.participants for task in tasks if task in self.trials(n)]

    def spread(self) -> list[tuple[str, str]]:
        """Pairs of participant and condition that get a spread from that of the scalers."""
        return [
            (participant, name)
            for participant, name in self.predicted()
            if name in self.config["prediction"]["scaler_spread"]
            and self.condition(name, participant)["parameters"] == "calibrated"
        ]

    def validated(self) -> list[tuple[str, str]]:
        """All pairs of participant and daily task."""
        return [(name, task) for name in self.participants for task in self.tasks(name)]

    def calibrated(self) -> list[str]:
        """Participants whose muscles are calibrated, because a task or a prediction needs it."""
        if self.config["validation"]["tasks"]:
            return self.participants
        asked = [*self.predicted(), *((name, HEALTHY) for name, _ in self.predicted_tasks())]
        needed = {
            participant
            for participant, name in asked
            if self.condition(name, participant)["parameters"] == "calibrated"
        }
        return [participant for participant in self.participants if participant in needed]

    def with_emg(self) -> list[tuple[str, str]]:
        """All pairs of participant and trial whose EMG is used."""
        return [
            (name, trial)
            for name in self.calibrated()
            for trial in (*self.planes, *self.tasks(name))
        ]

    def is_task(self, participant: str, trial: str) -> bool:
        """Whether a trial is a daily task, which validates and shapes nothing."""
        return bool(self._file(participant)["trials"][trial].get("daily_task", False))

    def _file(self, participant: str) -> dict[str, Any]:
        if participant in self.files:
            return self.files[participant]
        return read_participant_file(self.folder, participant)

    def measured_emg(self, participant: str) -> dict[str, Any]:
        """What a participant's file says of measured EMG; no trials if there is none."""
        return self._file(participant).get("emg", {"trials": {}})


def planned(config: Mapping[str, Any], folder: Path) -> Study:
    """The study that a configuration asks for.

    Parameters
    ----------
    config : content of a configuration file; folder : of all participants

    Raises
    ------
    ConfigError                      a key is refused, names what is not there, or a participant's
                                     file is wrong
    """
    check_config(config)
    study = Study(config, folder)
    for key in ("participants", "diagnose"):
        _check_names(key, config[key], folder)
    # An entry without conditions takes back one of another configuration file: who runs the study
    # of own participants does not have those of the paper.
    also = [name for name, asked in config["prediction"]["predict_also"].items() if asked]
    _check_names("prediction.predict_also", also, folder)
    _check_names("prediction.generic_muscles", config["prediction"]["generic_muscles"], folder)
    variants = config["variants"]["predict"].values()
    asked = [name for people in variants for name, conditions in people.items() if conditions]
    _check_names("variants.predict", asked, folder)
    _check_recordings(study)
    _check_emg(study)
    _check_envelope(study)
    _check_paths(study)
    _check_conditions(study)
    _check_loads(study)
    _check_variants(study)
    _check_planes(study)
    _check_steps(study)
    return study


def _check_names(key: str, names: Iterable[str], folder: Path) -> None:
    """Refuse participants that are not there."""
    available = list_participants(folder)
    for name in names:
        if name not in available:
            file = folder / name / "participant.yaml"
            remedy = (
                f"Write for example: participants: [{', '.join(available)}]"
                if available
                else f"No participant is in {folder}: correct participants_folder."
            )
            raise ConfigError(
                f"Config key '{key}' names '{name}', but there is no {file}. {remedy}"
            )


def _check_recordings(study: Study) -> None:
    """Refuse planes and tasks without a recording, and participants with daily tasks alone."""
    for participant in study.participants:
        trials = study.trials(participant)
        if not study.elevations(participant):
            raise ConfigError(
                f"{study.folder / participant / 'participant.yaml'}, trials: "
                f"{', '.join(trials)} are all daily tasks; expected one at least that is none, to "
                "which thorax and stops of joints are fitted. Remove daily_task from it."
            )
        for plane in study.planes:
            if plane not in trials:
                raise ConfigError(
                    f"Config key 'planes' names '{plane}', which participant '{participant}' has "
                    f"no recording of. Write for example: planes: "
                    f"[{', '.join(one for one in trials if not study.is_task(participant, one))}]"
                )
        _check_judges(study, participant)
    for section in ("validation", "prediction"):
        for task in study.config[section]["tasks"]:
            if not any(task in study.trials(name) for name in study.participants):
                _check_task(study, section, task)


def _check_judges(study: Study, participant: str) -> None:
    """Refuse daily tasks that are no independent judges, because they shape the model.

    All trials but daily tasks shape fibres, thorax and stops. Tasks that are only tracked may be
    among the planes.
    """
    trials = study.trials(participant)
    for section in ("validation", "prediction"):
        for task in study.config[section]["tasks"]:
            if task in trials and not study.is_task(participant, task):
                raise ConfigError(
                    f"Config key '{section}.tasks' names '{task}', which shapes the model of "
                    f"participant '{participant}' and cannot judge it. If it is a daily task, "
                    f"write daily_task: true for it into {study.folder / participant}"
                    "/participant.yaml; else leave it out of the tasks"
                )
    follows = participant in study.calibrated() or study.conditions(participant)
    for plane in study.planes:
        if follows and study.is_task(participant, plane):
            raise ConfigError(
                f"Config key 'planes' names '{plane}', which is a daily task of participant "
                f"'{participant}'. Leave it out, or remove daily_task from "
                f"{study.folder / participant}/participant.yaml"
            )


def _check_emg(study: Study) -> None:
    """Refuse participants to calibrate whose EMG is neither measured nor can be simulated."""
    for name, trial in study.with_emg():
        if trial.startswith(tuple(f"{taken}_" for taken in (*WHOLE_RECORDINGS, *study.planes))):
            raise ConfigError(
                f"Task '{trial}' of participant '{name}': EMG of a name that begins with that of a "
                "plane, mvc or composite and an underscore is another file. Rename the trial."
            )
        plant = PLANTS / f"{name}.yaml"
        if trial not in study.measured_emg(name)["trials"] and not plant.is_file():
            raise ConfigError(
                f"Participant '{name}' is calibrated, because 'validation.tasks' or a condition "
                f"asks for it, and there is no EMG of '{trial}'. Add its recording to emg.trials "
                f"of {study.folder / name / 'participant.yaml'}, or a simulated arm in {plant}; "
                "without either leave validation.tasks empty, and name the participant in "
                "prediction.generic_muscles."
            )


def _check_envelope(study: Study) -> None:
    """Refuse processing of EMG that contradicts itself, or what simulated electrodes record."""
    if not study.with_emg():
        return
    envelope = EnvelopeSettings(**study.config["emg"]["envelope"])
    channel_gain(envelope)
    electrodes = study.config["emg"]["simulation"]
    if all(trial in study.measured_emg(name)["trials"] for name, trial in study.with_emg()):
        return
    window, held = envelope.mvc_window_s, electrodes["mvc_hold_s"]
    if window > held:
        raise ConfigError(
            f"Config key 'emg.simulation.mvc_hold_s' is {held:g} s; expected the window of the "
            f"maximal contraction at least, emg.envelope.mvc_window_s ({window:g} s): its mean "
            f"would hold rest, and all EMG be too large. Write for example: mvc_hold_s: "
            f"{max(5.0, window):g}"
        )
    if electrodes["rate_hz"] <= 2.0 * envelope.band_high_hz:
        raise ConfigError(
            f"Config key 'emg.envelope.band_high_hz' is {envelope.band_high_hz:g} Hz; expected "
            f"less than half of emg.simulation.rate_hz ({electrodes['rate_hz']:g} Hz). "
            "Write for example: band_high_hz: 400"
        )


def _check_paths(study: Study) -> None:
    """Refuse paths that are fitted on the published arm for participants who have none."""
    if read_choices(study.config["model"]).paths == "published":
        for name in study.participants:
            study.published_composite(name)


def _check_loads(study: Study) -> None:
    """Refuse different loads in planes that a calibration or a prediction follows in one motion."""
    for name in study.participants:
        if not study.conditions(name) and name not in study.calibrated():
            continue
        entries = study.files[name]["trials"]
        loads = {plane: entries[plane]["hand_load_kg"] for plane in study.planes}
        common_load(study.folder / name / "participant.yaml", loads)


def _check_task(study: Study, section: str, task: str) -> None:
    """Refuse a daily task that nobody has a recording of, configured or not."""
    everybody = [study.trials(name) for name in list_participants(study.folder)]
    known = dict.fromkeys(trial for trials in everybody for trial in trials)
    if task not in known:
        raise ConfigError(
            f"Config key '{section}.tasks' names '{task}', which no participant has a recording "
            f"of. Choose from: {', '.join(known)}"
        )


def _check_conditions(study: Study) -> None:
    """Refuse predictions that are not described, or that never come to a start."""
    section = study.config["prediction"]
    conditions = section["conditions"]
    chosen = {"predict": section["predict"], "scaler_spread": section["scaler_spread"]}
    chosen |= {f"predict_also.{name}": also for name, also in section["predict_also"].items()}
    for key, names in chosen.items():
        for name in names:
            if name not in conditions:
                raise ConfigError(
                    f"Config key 'prediction.{key}' names '{name}', which 'prediction.conditions' "
                    f"does not describe. Choose from: {', '.join(conditions)}"
                )
    _check_muscles(conditions)
    for name in conditions:
        if name.endswith(TABLES_BESIDE):
            raise ConfigError(
                f"Config key 'prediction.conditions.{name}': names that end with "
                f"{', '.join(TABLES_BESIDE)} are those of tables beside a solution. Rename it."
            )
        passed = [name]
        while (start := conditions[passed[-1]]["start"]) not in STARTS:
            if start not in conditions or start in passed:
                others = [one for one in conditions if one not in passed]
                raise ConfigError(
                    f"Config key 'prediction.conditions.{passed[-1]}.start' is '{start}', from "
                    f"which '{name}' never comes to a solution. "
                    f"Write one of: {', '.join((*STARTS, *others))}"
                )
            passed.append(start)


def _check_muscles(conditions: Mapping[str, Any]) -> None:
    """Refuse limited muscles that the model does not simulate."""
    groups = read_tables(MODEL_TABLES).active_groups
    for name, condition in conditions.items():
        unknown = [muscle for muscle in condition["muscles"] if muscle not in groups]
        if unknown:
            raise ConfigError(
                f"Config key 'prediction.conditions.{name}.muscles' names {', '.join(unknown)}; "
                f"the model simulates no such group. Choose from: {', '.join(groups)}"
            )


def _check_planes(study: Study) -> None:
    """Refuse variants on the published arm without all planes of its motion, or on another mesh."""
    section = study.config["variants"]
    described = named_variants(section)
    step = study.config["solve"]["time_step_s"]
    missing = [plane for plane in PUBLISHED_PLANES if plane not in study.planes]
    for name, people in section["predict"].items():
        if not any(people.values()) or described[name].problem.get("arm") != "published":
            continue
        if abs(step - NODE_S) > 1e-9:
            raise ConfigError(
                f"Config key 'solve.time_step_s' is {step:g} s, but 'variants.predict.{name}' "
                f"follows the published arm, which has a node every {NODE_S:g} s. Write that step, "
                f"or for each participant: variants: {{predict: {{{name}: {{par2: []}}}}}}"
            )
        if missing:
            raise ConfigError(
                f"Config key 'planes' has no {', '.join(missing)}, but 'variants.predict.{name}' "
                f"follows the published arm through {', '.join(PUBLISHED_PLANES)}. Add what is "
                f"missing, or write for each participant: variants: {{predict: {{{name}: "
                "{par2: []}}}"
            )


def _check_steps(study: Study) -> None:
    """Refuse a mesh of daily tasks that tracked motions do not end on, and pauses without any."""
    step = study.config["solve"]["time_step_s"]
    pause = study.config["composite"]["pause_s"]
    if (study.calibrated() or study.predicted()) and round(pause / step) < 2:
        raise ConfigError(
            f"Config key 'composite.pause_s' is {pause:g} s; expected two mesh intervals at least, "
            f"of solve.time_step_s ({step:g} s) each. Write for example: pause_s: "
            f"{max(1.0, 2.0 * step):g}"
        )
    own = study.config["prediction"]["task_time_step_s"]
    parts = round(step / own)
    if study.config["prediction"]["tasks"] and abs(parts * own - step) > 1e-9:
        raise ConfigError(
            f"Config key 'prediction.task_time_step_s' is {own:g}; expected 'solve.time_step_s' "
            f"({step:g}) divided by a whole number, since predictions of daily tasks begin at "
            f"tracked ones. Write for example: task_time_step_s: {step / max(parts, 1):g}"
        )


def _check_variants(study: Study) -> None:
    """Refuse predictions of variants, or by conditions, that are not described."""
    section = study.config["variants"]
    described = named_variants(section)
    beside = ("tried", "held")
    chosen = {"predict": section["predict"], **{key: section[key]["variants"] for key in beside}}
    for key, names in chosen.items():
        for name in names:
            if name not in described:
                raise ConfigError(
                    f"Config key 'variants.{key}' names '{name}', which 'variants.named' does not "
                    f"describe. Choose from: {', '.join(described)}"
                )
    for name in section["tried"]["variants"]:
        if described[name].neighbour or described[name].problem.get("arm") == "published":
            raise ConfigError(
                f"Config key 'variants.tried.variants' names '{name}', which follows the published "
                "arm, or starts from another variant: it cannot be predicted for daily tasks. "
                "Remove it from that list."
            )
    conditions = study.config["prediction"]["conditions"]
    people = section["predict"].values()
    asked = [name for of_person in people for names in of_person.values() for name in names]
    asked += [section[key]["condition"] for key in beside]
    for name in [*asked, *section["ladder"]["conditions"]]:
        if name not in conditions:
            raise ConfigError(
                f"Config section 'variants' asks for the condition '{name}', which "
                f"'prediction.conditions' does not describe. Choose from: {', '.join(conditions)}"
            )
    known = [choice.name for choice in fields(ProblemChoices)]
    for name, variant in described.items():
        read_choices({**study.config["model"], **variant.model})
        unknown = [choice for choice in variant.problem if choice not in known]
        if unknown:
            raise ConfigError(
                f"Config key 'variants.named.{name}.problem' has {', '.join(unknown)}, which is no "
                f"choice of a problem. Choose from: {', '.join(known)}"
            )
        ProblemChoices(**variant.problem)
