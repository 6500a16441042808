"""Wildcards, checks across files and input functions of all stages."""

import os
from functools import cache
from pathlib import Path

import yaml
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

from scapulohumeral import provenance
from scapulohumeral.errors import ConfigError


wildcard_constraints:
    participant="[a-z0-9]+",
    trial="[a-z0-9_]+",
    formulation="quaternion|euler",


MODEL_TABLES = sorted(str(path) for path in Path("config/model").glob("*"))


def code_of(*modules):
    """Source files of modules of the package, as an input: a change in one of them reruns."""
    files = {path for module in modules for path in provenance.code_of(module)}
    return sorted(os.path.relpath(path) for path in files)


def check_schema():
    """Refuse a configuration that its schema does not allow, naming key, reason and meaning.

    Snakemake's own `validate` prints the whole schema with every error.
    """
    schema = yaml.safe_load(Path("workflow/schemas/config.schema.yaml").read_text("utf-8"))
    error = best_match(Draft202012Validator(schema).iter_errors(config))
    if error is None:
        return
    place = ".".join(str(part) for part in error.absolute_path)
    allowed = ", ".join(error.schema.get("properties", {}))
    raise ConfigError(
        f"Configuration, {f'key {place!r}' if place else 'top level'}: {error.message}. "
        + (f"Keys there are: {allowed}. " if allowed else "")
        + f"Meaning: {error.schema['description']}"
    )


@cache
def trials_of(participant):
    """Trials that a participant's participant.yaml lists: name and file of each recording."""
    path = Path("config/participants", participant, "participant.yaml")
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
    """Recorded arm elevations of a participant, configured or not."""
    trials = trials_of(wildcards.participant)
    return [str(trials[plane]) for plane in ("frontal", "scapular", "sagittal") if plane in trials]


def raw_emg(wildcards):
    """Raw EMG of a trial and the maximal contractions that it is normalised by."""
    folder = Path("config/participants", wildcards.participant)
    document = yaml.safe_load((folder / "participant.yaml").read_text(encoding="utf-8"))
    emg = document.get("emg", {"trials": {}})
    if wildcards.trial in emg["trials"]:
        return {
            "raw": str(folder / emg["trials"][wildcards.trial]),
            "mvc": str(folder / emg["mvc"]),
        }
    simulated = f"results/emg/{wildcards.participant}"
    return {"raw": f"{simulated}/{wildcards.trial}_raw.csv", "mvc": f"{simulated}/mvc_raw.csv"}


def tracking_results(pattern):
    """Paths of all configured tracking problems."""
    return expand(
        pattern,
        participant=config["participants"],
        trial=config["planes"],
        formulation=config["formulations"],
    )


check_schema()
check_recordings_exist()
