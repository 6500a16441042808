"""What the study command asks for, for own participants."""

import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

from scapulohumeral import cli
from scapulohumeral.errors import ConfigError
from scapulohumeral.laboratory.commands.study import REPOSITORY, own_study
from scapulohumeral.provenance import CONFIG_FOLDER

pytestmark = pytest.mark.unit
CONFIG = yaml.safe_load((CONFIG_FOLDER / "config.yaml").read_text(encoding="utf-8"))


@pytest.fixture(name="people")
def people_fixture(tmp_path: Path) -> Path:
    """Two participants with the three elevations, one of them with daily tasks too."""
    for name, published in (("ann", "par2"), ("bob", "par3")):
        shutil.copytree(CONFIG_FOLDER / "participants" / published, tmp_path / name)
        file = tmp_path / name / "participant.yaml"
        text = file.read_text(encoding="utf-8")
        file.write_text(text.replace(f"id: {published}", f"id: {name}"), encoding="utf-8")
    return tmp_path


def test_trials_that_all_have_are_tracked(people: Path) -> None:
    asked = own_study(people, [], ["healthy_generic"], "own", CONFIG)
    assert asked["participants"] == ["ann", "bob"]
    assert asked["planes"] == ["frontal", "scapular", "sagittal"]
    assert asked["participants_folder"] == str(people)
    assert asked["prediction"]["predict"] == ["healthy_generic"]
    assert not any(asked["prediction"]["predict_also"].values())
    assert asked["validation"]["tasks"] == asked["prediction"]["tasks"] == asked["diagnose"] == []


def test_a_prediction_follows_no_daily_task_unless_it_is_named(people: Path) -> None:
    shutil.rmtree(people / "bob")
    tracked = own_study(people, [], [], "own", CONFIG)["planes"]
    assert "drinking" in tracked
    predicted = own_study(people, [], ["healthy_generic"], "own", CONFIG)["planes"]
    assert predicted == ["frontal", "scapular", "sagittal"]
    named = own_study(people, ["drinking"], ["healthy_generic"], "own", CONFIG)
    assert named["planes"] == ["drinking"]


@pytest.mark.parametrize(
    ("trials", "predict", "said"),
    [
        (["lifting"], [], "--trials lifting: expected trials that all of ann, bob have"),
        ([], ["healthy"], "--predict healthy: expected healthy_generic"),
    ],
)
def test_what_cannot_be_asked_is_refused(
    trials: list[str], predict: list[str], said: str, people: Path
) -> None:
    with pytest.raises(ConfigError, match=said):
        own_study(people, trials, predict, "own", CONFIG)


def name_emg(people: Path, name: str, trials: list[str]) -> None:
    """Put measured EMG of some trials into the file of a participant."""
    file = people / name / "participant.yaml"
    document = yaml.safe_load(file.read_text(encoding="utf-8"))
    raw = {trial: f"{trial}_raw.csv" for trial in trials}
    document["emg"] = {"mvc": "mvc.csv", "trials": raw, "delay_s": 0.0}
    file.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")


def test_calibrated_muscles_are_predicted_where_all_have_measured_emg(
    people: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planes = ["frontal", "scapular", "sagittal"]
    name_emg(people, "ann", planes)
    name_emg(people, "bob", planes[:2])
    with pytest.raises(ConfigError, match=r"--predict cuff_w2: .* of bob does not name under emg"):
        own_study(people, [], ["cuff_w2"], "own", CONFIG)
    assert own_study(people, planes[:2], ["cuff_w2"], "own", CONFIG)["planes"] == planes[:2]
    name_emg(people, "bob", planes)
    asked = own_study(people, [], ["healthy", "cuff_w2"], "own", CONFIG)
    assert asked["prediction"]["predict"] == ["healthy", "cuff_w2"]
    with pytest.raises(
        ConfigError, match="strong: no such condition; expected healthy_generic, healthy"
    ):
        own_study(people, [], ["strong"], "own", CONFIG)

    monkeypatch.setattr(subprocess, "run", lambda *_, **__: subprocess.CompletedProcess([], 0))
    call = ["study", "--participants", str(people)]
    assert cli.main(call) == 0
    said = capsys.readouterr().out
    assert "left out: calibration, daily tasks" in said
    assert "not used: measured EMG of ann, bob" in said
    assert cli.main([*call, "--predict", "healthy"]) == 0
    said = capsys.readouterr().out
    assert "left out: daily tasks" in said
    assert "not used" not in said


def test_names_of_the_published_study_are_refused(people: Path) -> None:
    """Results and reports are told apart by names alone."""
    with pytest.raises(ConfigError, match="--report report: is that of the published study"):
        own_study(people, [], [], "report", CONFIG)
    (people / "ann").rename(people / "par2")
    with pytest.raises(ConfigError, match="par2 as in the published study"):
        own_study(people, [], [], "own", CONFIG)
    published = own_study(CONFIG_FOLDER / "participants", [], [], "own", CONFIG)
    assert published["participants"] == CONFIG["participants"]


def test_a_folder_without_participants_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no folder with a participant.yaml"):
        own_study(tmp_path, [], [], "own", CONFIG)


@pytest.mark.parametrize(("profile", "limited"), [("default", True), ("slurm", False)])
def test_memory_grows_with_the_cores_of_this_machine(
    profile: str, limited: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[str] = []

    def run(command: list[str], **_: object) -> subprocess.CompletedProcess[str]:
        asked.extend(command)
        return subprocess.CompletedProcess(command, 0)

    monkeypatch.setattr(subprocess, "run", run)
    assert cli.main(["study", "--cores", "4", "--profile", profile]) == 0
    assert asked[asked.index("--cores") + 1] == "4"
    assert ("mem_mb=16000" in asked) == limited


def test_make_lets_every_core_solve() -> None:
    planned = subprocess.run(
        ["make", "--dry-run", "reproduce", "CORES=4"],
        cwd=REPOSITORY, capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert "--resources mem_mb=16000 --cores 4" in planned
