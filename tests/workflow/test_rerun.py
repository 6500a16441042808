"""A change reruns what depends on it, and nothing else.

In a copy of the study all results are there, empty, and recorded as made; Snakemake then says which
of them it would make again.
"""

import csv
import os
import shutil
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import yaml

pytestmark = pytest.mark.workflow

PROFILE = "workflow/profiles/default"
GAP = "results/gap/par1/result.json"
TARGETS = ("results/prediction/summary.csv", "results/validation/summary.csv", GAP)
# Small enough to plan in seconds, with two of everything that a change may or may not reach.
STUDY = {
    "participants": ["par1", "par2"],
    "planes": ["frontal"],
    "formulations": ["quaternion"],
    "validation": {"tasks": ["drinking"]},
    "diagnose": ["par1"],
}
PREDICT = ["healthy", "cuff_w2", "cuff_w4"]

Rerun = Callable[[], set[str]]


def snakemake(study: Path, *arguments: str) -> str:
    """Run Snakemake in a study; returns what it prints."""
    result = subprocess.run(
        ["snakemake", "--workflow-profile", PROFILE, *arguments, "--", *TARGETS],
        cwd=study,
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def results(study: Path) -> dict[str, str]:
    """Plan for each file that the targets are made from."""
    table = snakemake(study, "--summary").splitlines()
    return {row["output_file"]: row["plan"] for row in csv.DictReader(table, delimiter="\t")}


def edit(study: Path, change: Callable[[dict], object]) -> None:
    """Change the configuration of a study."""
    path = study / "config/config.yaml"
    config = yaml.safe_load(path.read_text(encoding="utf-8"))
    change(config)
    path.write_text(yaml.safe_dump(config, sort_keys=False), encoding="utf-8")


@pytest.fixture(scope="module")
def finished(repository: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The copy of the study."""
    study = tmp_path_factory.mktemp("study")
    shutil.copy(repository / "Snakefile", study)
    for folder in ("workflow", "config"):
        shutil.copytree(repository / folder, study / folder)
    (study / "src").symlink_to(repository / "src")
    edit(study, lambda config: config.update(STUDY))
    edit(study, lambda config: config["prediction"].update(predict=PREDICT, predict_also={}))
    for name in results(study):
        path = study / name
        path.parent.mkdir(parents=True, exist_ok=True)
        # Only the folder of equations has no suffix.
        path.touch() if path.suffix else path.mkdir()
    snakemake(study, "--touch", "--forceall")
    return study


@pytest.fixture
def rerun(finished: Path, tmp_path: Path) -> Iterator[Rerun]:
    """Function that gives the files which a run would make; changes are undone afterwards."""
    shutil.copytree(finished / "config", tmp_path / "config")
    yield lambda: {name for name, plan in results(finished).items() if plan != "no update"}
    shutil.copytree(tmp_path / "config", finished / "config", dirs_exist_ok=True)


def test_finished_study_has_nothing_to_do(finished: Path, rerun: Rerun) -> None:
    assert set(TARGETS) < set(results(finished))
    assert rerun() == set()


def test_texts_about_the_model_rerun_nothing(finished: Path, rerun: Rerun) -> None:
    path = finished / "config/model/README.md"
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert not rerun()


def test_sensitivity_may_follow_any_recording(finished: Path, rerun: Rerun) -> None:
    path = finished / "config/sensitivity.yaml"
    text = path.read_text(encoding="utf-8").replace("planes: [scapular]", "planes: [lifting_5kg]")
    path.write_text(text, encoding="utf-8")
    command = ["snakemake", "--dry-run", "--", "results/sensitivity/par2/healthy/base.npz"]
    planned = subprocess.run(command, cwd=finished, capture_output=True, text=True, check=False)
    assert planned.returncode == 0, planned.stderr
    assert "participant par2, lifting_5kg" in planned.stdout


def test_diagram_of_the_rules_follows_them(finished: Path) -> None:
    diagram = finished / "results/dag.mmd"
    diagram.touch()
    rules = finished / "workflow/rules/bench.smk"
    command = ["snakemake", "--workflow-profile", PROFILE, "--dry-run", "--", "results/dag.mmd"]
    os.utime(rules, (diagram.stat().st_mtime + 60,) * 2)
    planned = subprocess.run(command, cwd=finished, capture_output=True, text=True, check=True)
    assert "Diagram of the rules" in planned.stdout


def test_prediction_weight_reruns_predictions(finished: Path, rerun: Rerun) -> None:
    edit(finished, lambda config: config["weights"]["prediction"].update(activation=1.5))
    made = rerun()
    solutions = {f"results/prediction/{p}/{c}.npz" for p in STUDY["participants"] for c in PREDICT}
    assert solutions < made
    assert all(name.startswith(("results/prediction/", "results/gap/")) for name in made)


def test_condition_reruns_itself_and_the_tables(finished: Path, rerun: Rerun) -> None:
    edit(finished, lambda config: config["prediction"]["conditions"]["cuff_w4"].update(w_gh=5))
    made = rerun()
    assert "results/prediction/summary.csv" in made
    assert {name for name in made if name.endswith(".npz")} == {
        f"results/prediction/{participant}/cuff_w4.npz" for participant in STUDY["participants"]
    }


def test_recording_reruns_its_participant(finished: Path, rerun: Rerun) -> None:
    recording = finished / "config/participants/par2/drinking.csv"
    recording.write_text(recording.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    made = rerun()
    assert "results/validation/par2/drinking_calibrated.npz" in made
    assert "results/models/par2.json" in made, "recordings span the range of motion"
    assert not [name for name in made if "par1" in name or "equations" in name]


def test_calibration_bound_leaves_tracking_alone(finished: Path, rerun: Rerun) -> None:
    edit(finished, lambda config: config["calibration"].update(force_bounds=[0.6, 1.4]))
    made = rerun()
    assert "results/calibration/par2_scalers.json" in made
    assert not [name for name in made if "/tracking/" in name or "/emg/" in name]
    assert not [name for name in made if "drinking_generic" in name]


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("model", "masses", "published"),
        ("geometry", "margin_deg", 12),
        ("weights.prediction", "activation", 1.5),
        ("prediction.conditions.healthy", "w_gh", 3),
    ],
)
def test_whatever_a_diagnosis_reads_reruns_it(
    finished: Path, rerun: Rerun, section: str | None, key: str, value: object
) -> None:
    edit(finished, lambda config: part_of(config, section).update({key: value}))
    made = rerun()
    assert {GAP, "results/gap/par1/config.yaml"} < made


def test_settings_of_diagnoses_rerun_them_alone(finished: Path, rerun: Rerun) -> None:
    path = finished / "config/gap/settings.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace("short_list: 6", "short_list: 2"))
    assert rerun() == {GAP, "results/gap/par1/report.html", "results/gap/par1/config.yaml"}


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("weights.tracking", "activation", 1.5),
        ("geometry", "poses", 2000),
        ("calibration", "force_bounds", [0.6, 1.4]),
        ("prediction.conditions.cuff_w4", "w_gh", 5),
    ],
)
def test_what_a_diagnosis_does_not_read_leaves_it_alone(
    finished: Path, rerun: Rerun, section: str, key: str, value: object
) -> None:
    edit(finished, lambda config: part_of(config, section).update({key: value}))
    made = rerun()
    assert made
    assert not [name for name in made if name.startswith("results/gap/")]


def test_malformed_participant_is_refused_with_file_and_key(finished: Path, rerun: Rerun) -> None:
    """Before anything is planned; other participants than those of the study do not matter."""
    for participant, refused in (("par3", False), ("par2", True)):
        path = finished / "config/participants" / participant / "participant.yaml"
        path.write_text(path.read_text(encoding="utf-8").replace("trials:", "trails:"))
        result = subprocess.run(
            ["snakemake", "--dry-run", "--quiet", "--", *TARGETS],
            cwd=finished,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            check=False,
        )
        assert (result.returncode != 0) == refused, result.stdout
        assert not refused or "config/participants/par2/participant.yaml, top" in result.stdout


def part_of(config: dict, section: str | None) -> dict:
    """A section of a configuration by its dotted name."""
    for name in section.split(".") if section else ():
        config = config[name]
    return config
