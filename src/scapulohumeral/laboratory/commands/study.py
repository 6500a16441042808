"""``scapulohumeral study``: run the study, of this repository or of a folder of own participants.

A thin wrapper of Snakemake. For own participants it writes what differs from the configuration
into ``study.yaml`` in their folder, anew each time. To ask for more, change a copy of it and run
``snakemake --configfile config/config.yaml COPY``.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from scapulohumeral.errors import ConfigError
from scapulohumeral.provenance import CONFIG_FOLDER

REPOSITORY = CONFIG_FOLDER.parent
PROFILES = REPOSITORY / "workflow" / "profiles"
OVERLAY = "study.yaml"
# Profiles of this machine, and memory that one of its cores may use [MB]: one solve.
LOCAL = ("default", "quick")
MEMORY_MB = 4000
EXAMPLES = """examples:
  scapulohumeral study                                   # the published participants
  scapulohumeral study --participants people --cores 4   # those of a folder, tracked and reported
  scapulohumeral study --participants people --trials frontal reach --predict healthy_generic
  scapulohumeral study --participants people --profile slurm
  scapulohumeral study --dry-run                         # what would run, and why

Own participants are made by 'scapulohumeral participant'. What needs published values is left out,
and named. Muscles are calibrated for predictions that ask for it, if participant.yaml names
measured EMG of all trials. Results go to results/, the report to reports/.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Describe the command to a parser."""
    parser.description = "Run the study by Snakemake."
    parser.epilog = EXAMPLES
    add = parser.add_argument
    add("--participants", type=Path, metavar="DIR", help="folder of own participants")
    add("--trials", nargs="+", default=[], metavar="NAME", help="default: those that all have")
    add("--predict", nargs="+", default=[], metavar="CONDITION", help="of config.yaml")
    add("--report", default="own", metavar="NAME", help="reports/NAME.html (default own)")
    add("--quick", action="store_true", help="the quick study of config/quick.yaml")
    add("--profile", default="default", help="how to run: a folder of workflow/profiles")
    add("--cores", type=int, metavar="N", help="processor cores (default: as the profile says)")
    add("--dry-run", action="store_true", help="only say what would run")


def run(options: argparse.Namespace, command: str) -> int:
    """Run Snakemake in the repository; returns its exit code."""
    if not (PROFILES / options.profile).is_dir():
        found = ", ".join(sorted(path.name for path in PROFILES.iterdir()))
        raise ConfigError(f"--profile {options.profile}: expected one of {found}.")
    if options.cores is not None and options.cores < 1:
        raise ConfigError(f"--cores {options.cores}: expected 1 or more. Raise it.")
    files = [CONFIG_FOLDER / "config.yaml"]
    if options.quick:
        files.append(CONFIG_FOLDER / "quick.yaml")
    if options.participants is not None:
        files.append(_written_overlay(options))
    arguments = ["--workflow-profile", str(PROFILES / options.profile)]
    arguments += ["--configfile", *map(str, files)]
    if options.cores is not None:
        arguments += ["--cores", str(options.cores)]
        if options.profile in LOCAL:
            arguments += ["--resources", f"mem_mb={MEMORY_MB * options.cores}"]
    if options.dry_run:
        arguments.append("--dry-run")
    return subprocess.run(
        [sys.executable, "-m", "snakemake", *arguments], cwd=REPOSITORY, check=False
    ).returncode


def _written_overlay(options: argparse.Namespace) -> Path:
    """Write what differs for own participants, and say what is left out."""
    import yaml

    folder = options.participants.resolve()
    config = yaml.safe_load((CONFIG_FOLDER / "config.yaml").read_text(encoding="utf-8"))
    overlay = own_study(folder, options.trials, options.predict, options.report, config)
    path: Path = folder / OVERLAY
    text = yaml.safe_dump(overlay, sort_keys=False)
    path.write_text(f"# Made by scapulohumeral study; over config/config.yaml.\n{text}", "utf-8")
    print(f"{path}: participants {', '.join(overlay['participants'])}")
    print(f"trials: {', '.join(overlay['planes'])}")
    conditions = config["prediction"]["conditions"]
    calibrated = [one for one in options.predict if conditions[one]["parameters"] != "generic"]
    left_out = {
        "calibration": not calibrated,
        "daily tasks as validation": True,
        "comparison with published values": True,
        "predictions (name some with --predict)": not options.predict,
        "diagnosis of the report (run scapulohumeral gap diagnose)": True,
    }
    print("left out:", ", ".join(what for what, out in left_out.items() if out))
    unused = [] if calibrated else _having_emg(folder, overlay["participants"], [])
    if unused:
        print(f"not used: measured EMG of {', '.join(unused)}, which no prediction asks for")
    return path


def own_study(
    folder: Path,
    trials: Sequence[str],
    predict: Sequence[str],
    report: str,
    config: Mapping[str, Any],
) -> dict[str, Any]:
    """Configuration of own participants, as far as it differs from that of the published ones.

    Parameters
    ----------
    folder : Path                    of all participants
    trials : to track; empty: all that every participant has; daily tasks, which no prediction
        follows together with elevations, only where nothing is predicted
    predict : conditions to predict; those of calibrated muscles need measured EMG
    report : name of the report
    config : configuration of the study

    Raises
    ------
    ConfigError                      no participants, no common trials, a condition that cannot be
                                     predicted without EMG, or a name of the published study
    """
    from scapulohumeral.model.participant import read_participant
    from scapulohumeral.model.participant_file import list_participants

    names = list_participants(folder)
    if not names:
        above = (folder / "participant.yaml").is_file()
        remedy = f"Name the folder above it: {folder.resolve().parent}"
        raise ConfigError(
            f"{folder}: no folder with a participant.yaml. "
            f"{remedy if above else 'Make one: scapulohumeral participant'}."
        )
    _check_published(folder, names, report, config)
    recorded = {
        name: [
            trial
            for trial, of in read_participant(folder, name).trials.items()
            if trials or not (predict and of.daily_task)
        ]
        for name in names
    }
    common = _common_trials(recorded, trials)
    with_emg = _having_emg(folder, names, common)
    _check_predictable(
        config["prediction"]["conditions"], predict, [one for one in names if one not in with_emg]
    )
    return {
        "report": report,
        "participants_folder": str(folder),
        "participants": list(names),
        "planes": common,
        "validation": {"tasks": []},
        "prediction": {
            "predict": list(predict),
            "predict_also": {name: [] for name in config["prediction"]["predict_also"]},
            "tasks": [],
            "generic_muscles": [],
        },
        "variants": {
            "predict": {
                variant: {name: [] for name in asked}
                for variant, asked in config["variants"]["predict"].items()
            }
        },
        "diagnose": [],
    }


def _check_published(
    folder: Path, names: Sequence[str], report: str, config: Mapping[str, Any]
) -> None:
    """Refuse names of the published study: results and reports are told apart by nothing else."""
    if report == config["report"]:
        raise ConfigError(
            f"--report {report}: is that of the published study; expected another name. Rename it."
        )
    same = sorted({*names} & {*config["participants"]})
    if same and folder != (REPOSITORY / config["participants_folder"]).resolve():
        raise ConfigError(
            f"{folder}: {', '.join(same)} as in the published study, whose results would be "
            "replaced; expected other names. Rename the folders, and id in each participant.yaml."
        )


def _common_trials(recorded: Mapping[str, list[str]], wanted: Sequence[str]) -> list[str]:
    """Trials that all participants have: the wanted ones, or all without wishes."""
    first = next(iter(recorded.values()))
    common = [trial for trial in first if all(trial in trials for trials in recorded.values())]
    missing = [trial for trial in wanted if trial not in common]
    if missing or not common:
        raise ConfigError(
            f"--trials {', '.join(missing) or '(none)'}: expected trials that all of "
            f"{', '.join(recorded)} have: {', '.join(common) or 'there are none'}."
        )
    return list(wanted or common)


def _having_emg(folder: Path, names: Sequence[str], trials: Sequence[str]) -> list[str]:
    """Participants whose files name measured EMG, of all of some trials at least."""
    from scapulohumeral.model.participant_file import read_participant_file

    files = {name: read_participant_file(folder, name) for name in names}
    return [
        n for n, file in files.items() if "emg" in file and {*trials} <= {*file["emg"]["trials"]}
    ]


def _check_predictable(
    conditions: Mapping[str, Any], wanted: Sequence[str], without_emg: Sequence[str]
) -> None:
    """Refuse predictions that need muscles calibrated to EMG that some participants lack."""
    possible = [
        name
        for name, condition in conditions.items()
        if condition["parameters"] == "generic" and condition["start"] in ("direct", "tracking")
    ]
    if unknown := [name for name in wanted if name not in conditions]:
        raise ConfigError(
            f"--predict {', '.join(unknown)}: no such condition; expected {', '.join(conditions)}."
        )
    wrong = [name for name in wanted if name not in possible]
    if wrong and without_emg:
        raise ConfigError(
            f"--predict {', '.join(wrong)}: expected {', '.join(possible)}; the others need "
            f"muscles calibrated to measured raw EMG of all trials, which participant.yaml of "
            f"{', '.join(without_emg)} does not name under emg."
        )
