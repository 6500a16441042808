"""Wildcards and input functions of all stages: paths of what the study asks for."""

from dataclasses import asdict
from functools import cache
from pathlib import Path

import pandas as pd
import yaml

from scapulohumeral import provenance
from scapulohumeral.configuration.check import REMEDY, read_recovery, read_sensitivity
from scapulohumeral.documents import read_yaml
from scapulohumeral.problems import sensitivity, variants
from scapulohumeral.study import HEALTHY, STARTS, TABLES_BESIDE, WHOLE_RECORDINGS, planned


wildcard_constraints:
    participant="[a-z0-9]+",
    trial="[a-z0-9_]+",
    # Tables of the audit stand beside the solutions.
    condition="[a-z0-9_]+" + "".join(f"(?<!{end})" for end in TABLES_BESIDE),
    muscles="generic|calibrated",
    variant="[a-z][a-z0-9_]*",
    case="[a-z][a-z0-9_]*",
    model="[a-z0-9_]+(-[a-z0-9_]+)+",
    formulation="quaternion|euler",


# Refuses a key that stands twice, of which Snakemake takes the last without a word.
for each in workflow.configfiles:
    read_yaml(Path(each), REMEDY)

PARTICIPANTS = Path(config["participants_folder"])
PARTICIPANT_FILE = str(PARTICIPANTS / "{participant}" / "participant.yaml")
# Texts about the tables are no part of a model, nor are other folders in it.
MODEL_FOLDER = Path("config/model")
MODEL_TABLES = [
    str(path)
    for folder in (MODEL_FOLDER, MODEL_FOLDER / "published_paths")
    for path in sorted(folder.iterdir())
    if path.suffix in (".csv", ".yaml")
]
SCRIPTS = Path("workflow/scripts").resolve()
MUSCLES = ("generic", "calibrated")
PACKAGES = " ".join(provenance.package_versions().values())
# Refuses a configuration, or the file of a participant, before any rule is read.
STUDY = planned(config, PARTICIPANTS)


@cache
def files_of(name):
    """Source files that run for a module of the package, or for a script beside the rules.

    Imports of a script are followed into both. `_log` is not looked at, because no result depends
    on it.
    """
    if "." in name:
        return frozenset(provenance.code_of(name))
    scripts = [path for path in provenance.code_of(name, SCRIPTS) if path.stem != "_log"]
    imported = {one for path in scripts for one in provenance.imported_names(path, path.stem)}
    modules = {provenance.module_of(name) for name in imported} - {None, "scapulohumeral"}
    return frozenset(scripts).union(*map(files_of, modules))


def code_of(*names):
    """Hash of the code of scripts, by name, and modules, by dotted name, and what it computes with:
    a parameter of a rule.

    As a parameter it is that of the plan, so code that is edited while a job runs makes its result
    stale; and the age of files does not count, as that of a script would by the trigger `code`.
    """
    files = sorted(frozenset().union(*map(files_of, names)))
    return f"{provenance.input_hash(files)}, packages {PACKAGES}"


def recording(wildcards):
    """Recorded motion of one trial."""
    return str(STUDY.recording(wildcards.participant, wildcards.trial))


def recordings(wildcards):
    """All recorded motions of a participant, configured or not: they span its range of motion."""
    return [str(path) for path in STUDY.recordings(wildcards.participant)]


def elevations(wildcards):
    """Recorded arm elevations of a participant, configured or not."""
    return [str(path) for path in STUDY.elevations(wildcards.participant)]


def raw_emg(wildcards):
    """Raw EMG of a trial and the maximal contractions that it is normalised by."""
    files = STUDY.raw_emg(wildcards.participant, wildcards.trial, Path("results/emg"))
    return {name: str(path) for name, path in files.items()}


def calibrated_to_simulated_emg(wildcards):
    """Whether the EMG of any elevation of a participant was simulated."""
    return STUDY.simulates_emg(wildcards.participant)


def tracked_elevations(wildcards):
    """Tracking solutions of a participant in the order of the composite motion."""
    solution = f"results/tracking/{wildcards.participant}/{{plane}}_quaternion.npz"
    return expand(solution, plane=STUDY.planes)


def elevation_envelopes(wildcards):
    """EMG envelopes of a participant in the order of the composite motion."""
    envelope = f"results/emg/{wildcards.participant}/{{plane}}_envelope.csv"
    return expand(envelope, plane=STUDY.planes)


def scalers_of(participant):
    """Calibrated scalers of a participant, without what scores them."""
    return f"results/calibration/{participant}_scalers.json"


def validation_muscles(wildcards):
    """Scalers for a daily task with calibrated muscles, nothing for generic ones."""
    return [scalers_of(wildcards.participant)] if wildcards.muscles == "calibrated" else []


def condition_of(wildcards):
    """Settings of one predicted shoulder."""
    return STUDY.condition(wildcards.condition, wildcards.participant)


# Parameters of every rule that solves, of every one that predicts with a free girdle, and of where
# muscle paths were fitted.
SOLVER = {
    name: lookup(within=config, dpath=f"solve/{name}")
    for name in ("time_step_s", "tolerance", "max_iterations", "hessian")
}
PREDICTION = {
    **SOLVER,
    "max_iterations": lookup(within=config, dpath="prediction/max_iterations"),
    "weights": lookup(within=config, dpath="weights/prediction"),
    "pause_s": lookup(within=config, dpath="composite/pause_s"),
    "guidance": lookup(within=config, dpath="prediction/guidance"),
    "capacity_steps": lookup(within=config, dpath="prediction/capacity_steps"),
    "condition": condition_of,
}
FIT_REGION = {
    name: lookup(within=config, dpath=f"geometry/{name}")
    for name in ("margin_deg", "scapula_turn_deg", "girdle_turn_deg")
}


def needed_scalers(condition, participant):
    """Scalers of a participant, if a condition has calibrated muscles."""
    calibrated = condition["parameters"] == "calibrated"
    return {"calibration": scalers_of(participant)} if calibrated else {}


def healthy_scalers(wildcards):
    """Scalers of a participant whose healthy shoulder has them."""
    return needed_scalers(STUDY.condition(HEALTHY, wildcards.participant), wildcards.participant)


def prediction_inputs(wildcards):
    """Scalers and the solution that a prediction starts from, where it has them."""
    condition = condition_of(wildcards)
    inputs = needed_scalers(condition, wildcards.participant)
    if condition["start"] in config["prediction"]["conditions"]:
        inputs["neighbour"] = f"results/prediction/{wildcards.participant}/{condition['start']}.npz"
    return inputs


def paths_of(pattern, pairs, second):
    """A pattern for pairs of a participant and a trial or condition."""
    return [pattern.format(participant=name, **{second: other}) for name, other in pairs]


def prediction_results(pattern):
    """Paths of all configured predictions."""
    return paths_of(pattern, STUDY.predicted(), "condition")


# The healthy shoulder on the arm of a daily task, below the folder of a model.
ON_TASK = f"{{participant}}/{{trial}}/{HEALTHY}"
TRACKED_TASK = "results/tracking/{participant}/{trial}_quaternion.npz"


def task_results(ending):
    """Paths of all predictions on the arm of a daily task."""
    return paths_of(f"results/prediction/{ON_TASK}{ending}", STUDY.predicted_tasks(), "trial")


def task_table():
    """The table of predicted daily tasks, where there are any."""
    return ["results/prediction/against_tasks.csv"] if STUDY.predicted_tasks() else []


def prediction_table(name):
    """A table of all predictions, where there are any."""
    return [f"results/prediction/{name}.csv"] if STUDY.predicted() else []


def emg_results(pattern):
    """Paths of all trials whose EMG is used: elevations and tasks of calibrated participants."""
    return paths_of(pattern, STUDY.with_emg(), "trial")


VARIANTS = variants.named_variants(config["variants"])
# Parameters of every rule that compares variants with recordings. Muscle paths of some variants are
# the authors', fitted to poses that the authors drew.
AGAINST = {
    **FIT_REGION,
    "elsewhere": [
        name
        for name, variant in VARIANTS.items()
        if {**config["model"], **variant.model}["paths"] == "published"
    ],
}


def model_and_paths(participant, model, paths):
    """Model and muscle geometry by the names of their choices; None: those of the study."""
    return {
        "model": (
            f"results/variants/models/{model}/{participant}.json"
            if model
            else f"results/models/{participant}.json"
        ),
        "geometry": (
            f"results/variants/geometry/{paths}/{participant}/quaternion.npz"
            if paths
            else f"results/muscle_geometry/{participant}/quaternion.npz"
        ),
    }


def variant_files(wildcards):
    """Model, muscle geometry and arm of a variant."""
    participant, variant = wildcards.participant, VARIANTS[wildcards.variant]
    files = model_and_paths(
        participant,
        variants.model_name(config["model"], variant.model),
        variants.geometry_name(config["model"], variant),
    )
    if variant.problem.get("arm", "own") == "published":
        files["arm"] = published_composite(participant)
    return files


def published_composite(participant):
    """Published healthy prediction of a participant, whose arm a variant follows."""
    return str(STUDY.published_composite(participant))


def published_motions(participant):
    """Published motions of a participant, if there are any."""
    return sorted(map(str, (PARTICIPANTS / participant / "published").glob("*.csv")))


def variant_inputs(wildcards):
    """What a variant's prediction is made from, beside what it shares with the study."""
    condition, inputs = condition_of(wildcards), variant_files(wildcards)
    if condition["parameters"] == "calibrated":
        inputs["calibration"] = variant_scalers(wildcards)
    before, start = VARIANTS[wildcards.variant].neighbour, wildcards.condition
    if condition["start"] not in STARTS:
        before, start = wildcards.variant, condition["start"]
    if before:
        inputs["neighbour"] = f"results/variants/{before}/{wildcards.participant}/{start}.npz"
    return inputs


def variant_iterations(wildcards):
    """Iterations that a variant's solves are given: more where they start from another variant."""
    far = VARIANTS[wildcards.variant].neighbour
    return (config["variants"]["ladder"] if far else config["prediction"])["max_iterations"]


def variant_scalers(wildcards):
    """Scalers of a variant: those that were published for fibres as the authors set them."""
    published = PARTICIPANTS / wildcards.participant / "published" / "scalers.json"
    if VARIANTS[wildcards.variant].model.get("fibres") == "published" and published.is_file():
        return str(published)
    return scalers_of(wildcards.participant)


def variant_results(pattern):
    """Paths of all configured predictions of variants."""
    return [
        pattern.format(variant=variant, participant=participant, condition=condition)
        for variant, participant, condition in variants.predicted(
            config["variants"], config["participants"]
        )
    ]


def ladder_results(pattern):
    """Paths of all rungs of the ladder, the variant that it starts from first."""
    settings = config["variants"]["ladder"]
    named = {name: VARIANTS[name] for name in (variants.STUDY, settings["start"])}
    return expand(
        pattern,
        variant=[settings["start"], *variants.ladder(named, settings)],
        participant=settings["participant"],
        condition=settings["conditions"],
    )


def held_results(pattern):
    """Paths of the predictions whose girdle is held to a motion."""
    held = config["variants"]["held"]
    return [
        pattern.format(variant=variant, participant=participant, condition=held["condition"])
        for variant, people in held["variants"].items()
        for participant in people
    ]


def prediction_of(wildcards):
    """Solution of a variant's prediction, that of the study included."""
    study = wildcards.variant == variants.STUDY
    folder = "results/prediction" if study else f"results/variants/{wildcards.variant}"
    return f"{folder}/{wildcards.participant}/{wildcards.condition}.npz"


def tried_results(pattern):
    """Paths of the variants that were tried on every participant."""
    tried = config["variants"]["tried"]
    return expand(
        pattern,
        variant=tried["variants"],
        participant=tried["participants"],
        condition=tried["condition"],
    )


def tried_tasks():
    """Pairs of participant and daily task that variants are judged on."""
    people = config["variants"]["tried"]["participants"]
    return [(name, task) for name, task in STUDY.predicted_tasks() if name in people]


def tried_models():
    """Folders of predictions of the study and of all variants that were tried."""
    names = config["variants"]["tried"]["variants"]
    return ["results/prediction", *(f"results/variants/{name}" for name in names)]


def tried_task_results(ending):
    """Paths of the daily tasks that the study and all tried variants predict."""
    patterns = [f"{folder}/{ON_TASK}{ending}" for folder in tried_models()]
    return [path for each in patterns for path in paths_of(each, tried_tasks(), "trial")]


def tried_tracked_tasks():
    """Paths of the tracked daily tasks that the study and all tried variants follow."""
    return paths_of(TRACKED_TASK, tried_tasks(), "trial")


def tried_study(pattern):
    """Paths of the study's own predictions that variants were tried beside."""
    tried = config["variants"]["tried"]
    return expand(pattern, participant=tried["participants"], condition=tried["condition"])


RECOVERY = read_recovery(Path("config/recovery.yaml"))


def recovery_model(wildcards):
    """Model and muscle geometry of a simulated arm."""
    path = {"serratus_path": RECOVERY.plants[wildcards.plant].serratus_path}
    own = variants.model_name(config["model"], path)
    return model_and_paths(wildcards.participant, own, own)


def has_own_factors(wildcards):
    """Whether the muscles of a simulated arm differ from the model's."""
    return RECOVERY.plants[wildcards.plant].factors == "own"


def recovery_weights(wildcards):
    """What a simulated arm minimises."""
    power = RECOVERY.plants[wildcards.plant].activation_power
    return {**config["weights"]["calibration"], "activation_power": power}


def recovery_electrodes(wildcards):
    """How the EMG of a simulated arm is taken."""
    plant = RECOVERY.plants[wildcards.plant]
    seen = {"cross_talk": plant.cross_talk, "mvc_effort": plant.mvc_effort}
    return {**config["emg"]["simulation"], **seen}


SENSITIVITY = read_sensitivity(Path("config/sensitivity.yaml"))
CASES = sensitivity.sensitivity_cases(SENSITIVITY)


def case_inputs(wildcards):
    """Scalers and tracked motions of a case of the sensitivity."""
    own = "results/sensitivity/{participant}/{case}_{plane}.npz"
    tracked = expand(own, **wildcards, plane=SENSITIVITY.planes)
    return {"tracked": tracked, **needed_scalers(condition_of(wildcards), wildcards.participant)}


def case_condition(wildcards):
    """Settings of the shoulder of a case, which starts from the motion of the case alone."""
    condition = condition_of(wildcards)
    factor = CASES[wildcards.case].factors.get(sensitivity.STABILITY, 1.0)
    return {**condition, "w_gh": factor * condition["w_gh"], "start": "direct"}


def case_weights(wildcards):
    """Weights of the objective of a case."""
    return sensitivity.changed_weights(CASES[wildcards.case], config["weights"]["prediction"])


def case_time_step(wildcards):
    """Mesh interval of a case [s]."""
    return CASES[wildcards.case].time_step_s or config["solve"]["time_step_s"]


def case_results(pattern):
    """Paths of all cases of the sensitivity, the unchanged one first."""
    return expand(
        pattern,
        participant=SENSITIVITY.participant,
        condition=SENSITIVITY.condition,
        case=CASES,
    )


def validation_results(pattern):
    """Paths of all configured daily tasks, with generic and calibrated muscles."""
    return [
        pattern.format(participant=name, trial=task, muscles=muscles)
        for name, task in STUDY.validated()
        for muscles in MUSCLES
    ]


def validation_envelopes(wildcards):
    """EMG envelope of each result of validation_results, in the same order."""
    return validation_results("results/emg/{participant}/{trial}_envelope.csv")


def calibrated_participants():
    """Participants whose muscles are calibrated."""
    return STUDY.calibrated()


def committed_table(name):
    """A table in reports/ that is no part of the study, where there is one and anything is predicted.

    Only a copy is made there, so that a fresh checkout shows it and does not compute it. It is about
    the participants that the repository holds.
    """
    path = Path("reports", f"{name}.csv")
    of_these = PARTICIPANTS == Path("config/participants")
    return [str(path)] if of_these and path.is_file() and prediction_table("summary") else []


def blind_scores():
    """Committed score cards of blind cases, the latest draw last; none where no gap is diagnosed."""
    cards = Path("reports/blind_scores").glob("*.json")
    return sorted(map(str, cards)) if config["diagnose"] else []


def real_case_tables():
    """The committed table of cases of known cause, where there is one and gaps are diagnosed."""
    made = Path("reports/real_cases.csv")
    return [str(made)] if made.is_file() and config["diagnose"] else []


def speed_records():
    """Committed records of runs beside the study, as far as there are any."""
    names = ("side_by_side", "peers", "kills")
    return [f"reports/{name}.json" for name in names if Path(f"reports/{name}.json").is_file()]


def tracking_results(pattern):
    """Paths of all configured tracking problems."""
    return expand(
        pattern,
        participant=STUDY.participants,
        trial=STUDY.planes,
        formulation=config["formulations"],
    )
