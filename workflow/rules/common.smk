"""Wildcards, checks across files and input functions of all stages."""

import os
from functools import cache
from pathlib import Path

import yaml
from scapulohumeral import provenance
from scapulohumeral.configuration import check_config
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.settings import sections_read


wildcard_constraints:
    participant="[a-z0-9]+",
    trial="[a-z0-9_]+",
    condition="[a-z0-9_]+",
    muscles="generic|calibrated",
    formulation="quaternion|euler",


PARTICIPANTS = Path(config["participants_folder"])
PARTICIPANT_FILE = str(PARTICIPANTS / "{participant}" / "participant.yaml")
MODEL_TABLES = sorted(str(path) for path in Path("config/model").glob("*"))


def code_of(*modules):
    """Source files of modules of the package, as an input: a change in one of them reruns."""
    files = {path for module in modules for path in provenance.code_of(module)}
    return sorted(os.path.relpath(path) for path in files)


@cache
def trials_of(participant):
    """Trials that a participant's participant.yaml lists: name and file of each recording."""
    path = PARTICIPANTS / participant / "participant.yaml"
    if not path.is_file():
        available = sorted(path.parent.name for path in path.parents[1].glob("*/participant.yaml"))
        raise ConfigError(
            f"Config key 'participants' names '{participant}', but there is no {path}. "
            f"Write for example: participants: [{', '.join(available)}]"
        )
    trials = yaml.safe_load(path.read_text(encoding="utf-8"))["trials"]
    return {name: path.with_name(trial["file"]) for name, trial in trials.items()}


def check_recordings_exist():
    """Refuse configured participants and planes that have no recording."""
    for participant in config["participants"]:
        trials = trials_of(participant)
        for plane in config["planes"]:
            if plane not in trials:
                raise ConfigError(
                    f"Config key 'planes' names '{plane}', which participant '{participant}' has "
                    f"no recording of. Write for example: planes: [{', '.join(trials)}]"
                )


def recording(wildcards):
    """Recorded motion of one trial."""
    return str(trials_of(wildcards.participant)[wildcards.trial])


def recordings(wildcards):
    """All recorded motions of a participant, configured or not: they span its range of motion."""
    return [str(path) for path in trials_of(wildcards.participant).values()]


def elevations(wildcards):
    """Recorded motions of a participant, configured or not, but for daily tasks: they validate."""
    trials = participant_document(wildcards.participant)["trials"]
    names = [name for name, trial in trials.items() if not trial.get("daily_task", False)]
    return [str(trials_of(wildcards.participant)[name]) for name in names]


def participant_document(participant):
    """What a participant's file says."""
    file = PARTICIPANTS / participant / "participant.yaml"
    return yaml.safe_load(file.read_text(encoding="utf-8"))


def measured_emg(participant):
    """What a participant's file says of measured EMG; no trials if there is none."""
    return participant_document(participant).get("emg", {"trials": {}})


def raw_emg(wildcards):
    """Raw EMG of a trial and the maximal contractions that it is normalised by."""
    folder = PARTICIPANTS / wildcards.participant
    emg = measured_emg(wildcards.participant)
    if wildcards.trial in emg["trials"]:
        return {
            "raw": str(folder / emg["trials"][wildcards.trial]),
            "mvc": str(folder / emg["mvc"]),
        }
    simulated = f"results/emg/{wildcards.participant}"
    return {"raw": f"{simulated}/{wildcards.trial}_raw.csv", "mvc": f"{simulated}/mvc_raw.csv"}


def calibrated_to_simulated_emg(wildcards):
    """Whether the EMG of any elevation of a participant was simulated."""
    measured = measured_emg(wildcards.participant)["trials"]
    return any(plane not in measured for plane in config["planes"])


def check_conditions():
    """Refuse predictions that are not described, or that start from one that is not."""
    conditions = config["prediction"]["conditions"]
    starts = ["tracking", "direct", *conditions]
    chosen = {"predict": config["prediction"]["predict"], **config["prediction"]["predict_also"]}
    for key, names in chosen.items():
        for name in names:
            if name not in conditions:
                raise ConfigError(
                    f"Config section 'prediction', key '{key}' names '{name}', which its "
                    f"'conditions' do not describe. Choose from: {', '.join(conditions)}"
                )
    for name, condition in conditions.items():
        if condition["start"] not in starts or condition["start"] == name:
            raise ConfigError(
                f"Config key 'prediction.conditions.{name}.start' is '{condition['start']}'. "
                f"Write one of: {', '.join(starts)}"
            )


def tracked_elevations(wildcards):
    """Tracking solutions of a participant in the order of the composite motion."""
    return expand(
        f"results/tracking/{wildcards.participant}/{{plane}}_quaternion.npz",
        plane=config["planes"],
    )


def elevation_envelopes(wildcards):
    """EMG envelopes of a participant in the order of the composite motion."""
    return expand(
        f"results/emg/{wildcards.participant}/{{plane}}_envelope.csv", plane=config["planes"]
    )


def scalers_of(participant):
    """Calibrated scalers of a participant, without what scores them."""
    return f"results/calibration/{participant}_scalers.json"


def validation_muscles(wildcards):
    """Scalers for a daily task with calibrated muscles, nothing for generic ones."""
    return [scalers_of(wildcards.participant)] if wildcards.muscles == "calibrated" else []


def prediction_inputs(wildcards):
    """Scalers and the solution that a prediction starts from, where it has them."""
    condition = config["prediction"]["conditions"][wildcards.condition]
    inputs = {}
    if condition["parameters"] == "calibrated":
        inputs["calibration"] = scalers_of(wildcards.participant)
    if condition["start"] not in ("tracking", "direct"):
        inputs["neighbour"] = f"results/prediction/{wildcards.participant}/{condition['start']}.npz"
    return inputs


def condition_of(wildcards):
    """Settings of one predicted shoulder."""
    return config["prediction"]["conditions"][wildcards.condition]


def predicted_conditions(participant):
    """Conditions that are predicted for a participant."""
    chosen = config["prediction"]
    return [*chosen["predict"], *chosen["predict_also"].get(participant, [])]


def prediction_results(pattern):
    """Paths of all configured predictions."""
    return [
        path
        for participant in config["participants"]
        for path in expand(
            pattern, participant=participant, condition=predicted_conditions(participant)
        )
    ]


def prediction_table(name):
    """A table of all predictions, where there are any."""
    predicted = any(predicted_conditions(participant) for participant in config["participants"])
    return [f"results/prediction/{name}.csv"] if predicted else []


def tasks_of(participant):
    """Configured daily tasks that a participant has a recording of."""
    return [task for task in config["validation"]["tasks"] if task in trials_of(participant)]


def validation_results(pattern):
    """Paths of all configured daily tasks, with generic and calibrated muscles."""
    return [
        path
        for participant in config["participants"]
        for task in tasks_of(participant)
        for path in expand(
            pattern, participant=participant, trial=task, muscles=["generic", "calibrated"]
        )
    ]


def validation_envelopes(wildcards):
    """EMG envelope of each result of validation_results, in the same order."""
    return [
        f"results/emg/{participant}/{task}_envelope.csv"
        for participant in config["participants"]
        for task in tasks_of(participant)
        for _ in ("generic", "calibrated")
    ]


def calibrated_participants():
    """Participants whose muscles are calibrated, because a task or a prediction needs it."""
    if config["validation"]["tasks"]:
        return config["participants"]
    conditions = config["prediction"]["conditions"]
    return [
        participant
        for participant in config["participants"]
        if any(
            conditions[name]["parameters"] == "calibrated"
            for name in predicted_conditions(participant)
        )
    ]


def emg_results(pattern):
    """Paths of all trials whose EMG is used: elevations and tasks of calibrated participants."""
    return [
        path
        for participant in calibrated_participants()
        for trial in [*config["planes"], *tasks_of(participant)]
        for path in expand(pattern, participant=participant, trial=trial)
    ]


def blind_scores():
    """Committed score cards of blind cases, the latest draw last; none where no gap is diagnosed."""
    cards = Path("reports/blind_scores").glob("*.json")
    return sorted(map(str, cards)) if config["diagnose"] else []


def tracking_results(pattern):
    """Paths of all configured tracking problems."""
    return expand(
        pattern,
        participant=config["participants"],
        trial=config["planes"],
        formulation=config["formulations"],
    )


check_config(config)
check_recordings_exist()
check_conditions()
