"""The workflow is complete, well formed, and refuses a wrong configuration before it runs."""

import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml
from snakemake.cli import parse_args

pytestmark = pytest.mark.workflow

Run = Callable[..., subprocess.CompletedProcess[str]]
# What the default target does not ask for.
TABLES = ("ladder", "tried", "sensitivity", "static_postures", "recovery", "held_girdle")
TRIAL = {"hand_load_kg": 0.0, "published": None, "smooth_cutoff_hz": 6.0}


@pytest.fixture
def snakemake(repository: Path) -> Run:
    """Run Snakemake in the repository; returns the finished process with its output as text."""

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["snakemake", *arguments],
            cwd=repository,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )

    return run


@pytest.mark.parametrize(
    ("profile", "arguments"),
    [("default", ("all", *TABLES)), ("quick", ("--configfile", "config/quick.yaml"))],
)
def test_dry_run_from_nothing(snakemake: Run, profile: str, arguments: tuple[str, ...]) -> None:
    """Every file of the study, and of the tables beside it, has a rule, and its inputs are there.

    Also where the name of a model, made of what it is chosen by, holds a digit. All are planned at
    once: Snakemake names a file without a rule, whichever table asks for it.
    """
    result = snakemake(
        "--dry-run", "--forceall", "--workflow-profile", f"workflow/profiles/{profile}", *arguments
    )
    assert result.returncode == 0, result.stdout
    for rule in ("build_participant_model", "solve_tracking", "render_report", "test_results"):
        assert rule in result.stdout


@pytest.mark.parametrize(
    ("command", "target"),
    [
        ("report", "reports/report.html"),
        ("gap", "gap"),
        ("real", "real_cases"),
        ("blind", "results/gap/blind/scores.json"),
    ],
)
def test_make_asks_for_what_it_says(repository: Path, command: str, target: str) -> None:
    """Snakemake reads the command line: an option that takes many words would eat a target."""
    planned = subprocess.run(
        ["make", "--dry-run", "--assume-old=.venv/complete", command, "RECORDINGS=folder"],
        cwd=repository, stdout=subprocess.PIPE, text=True, check=True,
    ).stdout  # fmt: skip
    [line] = [line for line in planned.splitlines() if line.startswith("snakemake")]
    _, read = parse_args(shlex.split(line)[1:])
    assert target in read.targets


def test_participants_may_be_anywhere(repository: Path, tmp_path: Path) -> None:
    """A folder elsewhere, a trial of another name, and nothing of the repository changed."""
    published = repository / "config" / "participants" / "par2"
    own = tmp_path / "people" / "ann"
    own.mkdir(parents=True)
    document = yaml.safe_load((published / "participant.yaml").read_text(encoding="utf-8"))
    document |= {"id": "ann", "trials": {"reaching": {**TRIAL, "file": "reaching.csv"}}}
    for key in ("published_thorax_ellipsoid", "published_predictions"):
        del document[key]
    (own / "participant.yaml").write_text(yaml.safe_dump(document), encoding="utf-8")
    shutil.copyfile(published / "frontal.csv", own / "reaching.csv")
    done = subprocess.run(
        [
            sys.executable, "-m", "scapulohumeral.cli", "study", "--participants", str(own.parent),
            "--predict", "healthy_generic", "--report", "annie", "--dry-run",
        ],
        cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout
    assert "participant ann, reaching plane" in done.stdout
    assert "Prediction: participant ann, healthy_generic" in done.stdout
    assert "reports/annie.html" in done.stdout
    assert "left out: calibration, daily tasks as validation" in done.stdout
    assert "par2" not in done.stdout


def test_real_cases_need_recordings_and_nothing_else_does(snakemake: Run, tmp_path: Path) -> None:
    """Markers are converted once, each case is diagnosed, and the folder is asked for by name."""
    tables = ("results/gap/real/effect.csv", "results/gap/real/no_effect.csv")
    refused = snakemake("--dry-run", *tables)
    assert refused.returncode != 0
    assert "make real RECORDINGS=FOLDER" in refused.stdout
    names = [f"{t}{load}{r}.csv" for t in ("ABD", "FLX", "SHRUG") for load in "02" for r in "123"]
    files = [f"hand_load/{name}" for name in names] + ["arm_support/kinova_martin_tete_f3_1.c3d"]
    for name in files:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    planned = snakemake("--dry-run", "--forceall", *tables, "--config", f"recordings={tmp_path}")
    assert planned.returncode == 0, planned.stdout
    for rule, count in (("convert_real_recordings", 1), ("tabulate_real_cases", 2)):
        assert re.search(rf"^{rule} +{count}$", planned.stdout, re.MULTILINE)
    assert "solve_prediction" not in planned.stdout


def test_wrong_value_is_refused(snakemake: Run, repository: Path, tmp_path: Path) -> None:
    """A typo stops the run and is named. What else is refused: tests/unit/project."""
    path = changed_config(repository, tmp_path, lambda config: config["geometry"].update(posees=1))
    result = snakemake("--dry-run", "--configfile", path)
    assert result.returncode != 0
    assert "posees" in result.stdout


def test_missing_key_is_refused(snakemake: Run, repository: Path, tmp_path: Path) -> None:
    """`--replace-workflow-config` keeps the missing key from being filled from config.yaml."""
    path = changed_config(repository, tmp_path, lambda config: config["solve"].pop("tolerance"))
    result = snakemake("--dry-run", "--replace-workflow-config", "--configfile", path)
    assert result.returncode != 0
    assert "key 'solve.tolerance': is missing" in result.stdout


def test_key_that_stands_twice_is_refused(snakemake: Run, tmp_path: Path) -> None:
    path = tmp_path / "twice.yaml"
    path.write_text("planes: [frontal]\nplanes: [sagittal]\n", encoding="utf-8")
    result = snakemake("--dry-run", "--configfile", str(path))
    assert result.returncode != 0
    assert "twice.yaml: cannot be read as YAML: key 'planes' more than once" in result.stdout


def changed_config(repository: Path, folder: Path, change: Callable[[dict], object]) -> str:
    """Write the full configuration with a change."""
    config = yaml.safe_load((repository / "config/config.yaml").read_text(encoding="utf-8"))
    change(config)
    path = folder / "config.yaml"
    path.write_text(yaml.safe_dump(config), encoding="utf-8")
    return str(path)
