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
OF_GAP = {GAP, "results/gap/par1/config.yaml"}
TARGETS = ("results/prediction/summary.csv", "results/validation/summary.csv", GAP)
# Small enough to plan in seconds, with two of everything that a change may or may not reach.
STUDY = {
    "participants": ["par1", "par2"],
    "planes": ["frontal", "sagittal"],
    "formulations": ["quaternion"],
    "validation": {"tasks": ["drinking"]},
    "diagnose": ["par1"],
}
PREDICT = ["healthy", "cuff_w2", "cuff_w4"]

# Plan of a file that is not made again.
UP_TO_DATE = "no update"

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
    # The published arm needs all planes.
    edit(study, lambda config: config["variants"].update(predict={}))
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
    for folder in ("config", "workflow"):
        shutil.copytree(finished / folder, tmp_path / folder)
    yield lambda: {name for name, plan in results(finished).items() if plan != UP_TO_DATE}
    for folder in ("config", "workflow"):
        shutil.copytree(tmp_path / folder, finished / folder, dirs_exist_ok=True)


def test_finished_study_has_nothing_to_do(finished: Path, rerun: Rerun) -> None:
    """Neither do texts about the model matter, nor participants that the study does not have."""
    path = finished / "config/model/README.md"
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    malform(finished, "par3")
    planned = results(finished)
    assert set(TARGETS) < set(planned)
    assert {name for name, plan in planned.items() if plan != UP_TO_DATE} == set()


def test_what_the_targets_do_not_ask_for_follows_its_files(finished: Path, rerun: Rerun) -> None:
    """The sensitivity its recordings, which may be any, and the diagram of the rules these."""
    path = finished / "config/sensitivity.yaml"
    text = path.read_text(encoding="utf-8").replace("planes: [scapular]", "planes: [lifting_5kg]")
    path.write_text(text, encoding="utf-8")
    diagram = finished / "results/dag.mmd"
    diagram.touch()
    rules = finished / "workflow/rules/bench.smk"
    os.utime(rules, (diagram.stat().st_mtime + 60,) * 2)
    command = ["snakemake", "--workflow-profile", PROFILE, "--dry-run", "--"]
    command += ["results/sensitivity/par2/healthy/base.npz", "results/dag.mmd"]
    planned = subprocess.run(command, cwd=finished, capture_output=True, text=True, check=False)
    assert planned.returncode == 0, planned.stderr
    assert "participant par2, lifting_5kg" in planned.stdout
    assert "Diagram of the rules" in planned.stdout


def test_age_of_code_does_not_matter(finished: Path, rerun: Rerun) -> None:
    """As of files that another branch brings and takes away."""
    (finished / "workflow/scripts/solve_prediction.py").touch()
    assert rerun() == set()


def test_a_module_of_the_package_reruns_what_computes_with_it(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rerun: Rerun
) -> None:
    """Scripts import functions of it; what they import in turn counts as well."""
    copy = tmp_path / "copy"
    shutil.copytree(repository / "src", copy / "src")
    shutil.copytree(repository / "config", copy / "config")
    monkeypatch.setenv("PYTHONPATH", str(copy / "src"))
    assert rerun() == set()
    module = copy / "src/scapulohumeral/dynamics/hill.py"
    module.write_text(module.read_text(encoding="utf-8") + "\nX = 1\n", encoding="utf-8")
    made = rerun()
    for solved in ("tracking/par1/frontal_quaternion", "prediction/par1/healthy"):
        assert f"results/{solved}.npz" in made
    assert GAP in made
    assert "results/equations/quaternion" not in made


def test_another_version_of_a_package_reruns_everything(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rerun: Rerun
) -> None:
    """What `make environment` installs by another lock file."""
    installed = tmp_path / "packages" / "scipy-99.0.dist-info"
    installed.mkdir(parents=True)
    (installed / "METADATA").write_text("Metadata-Version: 2.1\nName: scipy\nVersion: 99.0\n")
    monkeypatch.setenv("PYTHONPATH", str(installed.parent), prepend=os.pathsep)
    made = rerun()
    assert {"results/equations/quaternion", *TARGETS} < made


def test_script_reruns_its_rule_however_old_it_is(finished: Path, rerun: Rerun) -> None:
    path = finished / "workflow/scripts/summarise_predictions.py"
    before = path.stat()
    path.write_text(path.read_text(encoding="utf-8") + "\nX = 1\n", encoding="utf-8")
    os.utime(path, (before.st_atime, before.st_mtime))
    made = rerun()
    assert "results/prediction/summary.csv" in made
    assert not [name for name in made if name.endswith(".npz")]


def test_order_of_planes_reruns_what_joins_them(finished: Path, rerun: Rerun) -> None:
    """Elevations of one motion are solved in this order, though their files stay the same."""
    edit(finished, lambda config: config.update(planes=["sagittal", "frontal"]))
    made = rerun()
    assert "results/prediction/par1/healthy.npz" in made
    assert "results/calibration/par1_scalers.json" in made
    assert not [name for name in made if "/tracking/" in name]


def test_prediction_weight_reruns_predictions_and_the_diagnosis(
    finished: Path, rerun: Rerun
) -> None:
    edit(finished, lambda config: config["weights"]["prediction"].update(activation=1.5))
    made = rerun()
    solutions = {f"results/prediction/{p}/{c}.npz" for p in STUDY["participants"] for c in PREDICT}
    assert solutions < made
    assert all(name.startswith(("results/prediction/", "results/gap/")) for name in made)
    assert made > OF_GAP


def test_condition_reruns_itself_and_the_tables(finished: Path, rerun: Rerun) -> None:
    """A condition that no diagnosis reads."""
    edit(finished, lambda config: config["prediction"]["conditions"]["cuff_w4"].update(w_gh=5))
    made = rerun()
    assert "results/prediction/summary.csv" in made
    assert {name for name in made if name.endswith(".npz")} == {
        f"results/prediction/{participant}/cuff_w4.npz" for participant in STUDY["participants"]
    }
    assert not diagnosed(made)


def test_recording_reruns_its_participant(finished: Path, rerun: Rerun) -> None:
    recording = finished / "config/participants/par2/drinking.csv"
    recording.write_text(recording.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    made = rerun()
    assert "results/validation/par2/drinking_calibrated.npz" in made
    assert "results/models/par2.json" in made, "recordings span the range of motion"
    assert not [name for name in made if "par1" in name or "equations" in name]


def test_calibration_bound_leaves_tracking_and_the_diagnosis_alone(
    finished: Path, rerun: Rerun
) -> None:
    edit(finished, lambda config: config["calibration"].update(force_bounds=[0.6, 1.4]))
    made = rerun()
    assert "results/calibration/par2_scalers.json" in made
    assert not [name for name in made if "/tracking/" in name or "/emg/" in name]
    assert not [name for name in made if "drinking_generic" in name]
    assert not diagnosed(made)


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("model", "masses", "published"),
        ("geometry", "margin_deg", 12),
        ("prediction.conditions.healthy", "w_gh", 3),
    ],
)
def test_whatever_a_diagnosis_reads_reruns_it(
    finished: Path, rerun: Rerun, section: str, key: str, value: object
) -> None:
    """As weights of predictions do, above."""
    edit(finished, lambda config: part_of(config, section).update({key: value}))
    assert rerun() > OF_GAP


def test_settings_of_diagnoses_rerun_them_alone(finished: Path, rerun: Rerun) -> None:
    path = finished / "config/gap/settings.yaml"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("short_list: 2", "short_list: 3"), encoding="utf-8")
    answers = {GAP, "results/gap/par1/report.html"}
    assert rerun() == OF_GAP | answers
    # A run that stops before the diagnosis has written its configuration, which says nothing of
    # these settings.
    touch = ["snakemake", "--workflow-profile", PROFILE, "--touch", "--", *(OF_GAP - answers)]
    try:
        subprocess.run(touch, cwd=finished, check=True, capture_output=True)
        assert rerun() == answers
    finally:
        path.write_text(text, encoding="utf-8")
        subprocess.run(touch, cwd=finished, check=True, capture_output=True)


def test_what_a_diagnosis_does_not_read_leaves_it_alone(finished: Path, rerun: Rerun) -> None:
    """As calibration and another condition do, above. Of these changes none may reach it."""
    edit(finished, lambda config: config["weights"]["tracking"].update(activation=1.5))
    edit(finished, lambda config: config["geometry"].update(poses=2000))
    made = rerun()
    assert [name for name in made if "/tracking/" in name]
    assert [name for name in made if "/muscle_geometry/" in name]
    assert not diagnosed(made)


def test_malformed_participant_is_refused_with_file_and_key(finished: Path, rerun: Rerun) -> None:
    """Before anything is planned."""
    malform(finished, "par2")
    result = subprocess.run(
        ["snakemake", "--dry-run", "--quiet", "--", *TARGETS],
        cwd=finished,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        check=False,
    )
    assert result.returncode != 0, result.stdout
    assert "participant.yaml, trails: there is no such key. Did you mean trials?" in result.stdout


def malform(study: Path, participant: str) -> None:
    """Misspell a key in the file of a participant."""
    path = study / "config/participants" / participant / "participant.yaml"
    path.write_text(path.read_text(encoding="utf-8").replace("trials:", "trails:"))


def diagnosed(made: set[str]) -> list[str]:
    """Files that belong to the diagnosis."""
    return [name for name in made if name.startswith("results/gap/")]


def part_of(config: dict, section: str) -> dict:
    """A section of a configuration by its dotted name."""
    for name in section.split("."):
        config = config[name]
    return config
