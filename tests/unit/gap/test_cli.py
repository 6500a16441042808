"""The command keeps its contract: exit codes, files, refusals, and no influence of names."""

import importlib
import json
import os
import shutil
import tomllib
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml
from gap_files import elevation, finished_diagnosis, write_csv, write_participant
from places import REPOSITORY

from scapulohumeral.errors import DataError, SolveError, StoppedError
from scapulohumeral.gap import cli, pipeline, run
from scapulohumeral.gap.detection.null_bank import bank_file
from scapulohumeral.gap.nominal import participant_model
from scapulohumeral.gap.nominal.participant_model import ModelSettings, _inputs, _key
from scapulohumeral.gap.output import page
from scapulohumeral.gap.recording.case import case_hash
from scapulohumeral.gap.result import read_result
from scapulohumeral.gap.settings import read_settings

pytestmark = pytest.mark.unit


@pytest.fixture
def case_folder(tmp_path):
    """Two test trials and one reference trial of a participant."""
    folder = tmp_path / "case"
    folder.mkdir()
    write_participant(folder)
    for name, peak in (("lift_r1", 60.0), ("lift_r2", 62.0), ("lift_r3", 58.0)):
        table = elevation(peak_deg=peak)
        table["EMG_infra"] = 0.01 * peak + 0.001 * table["time"]
        write_csv(table, folder / f"{name}.csv")
    return folder


@pytest.fixture
def views():
    """The views that were asked for."""
    return []


@pytest.fixture
def seen(monkeypatch, views):
    """The cases that reach the inference; answers are made up, and no model is built."""
    cases = []

    def answer(case, model, settings):
        cases.append(case)
        views.append(settings.view)
        return finished_diagnosis()

    monkeypatch.setattr(
        participant_model, "participant_model", lambda *_: SimpleNamespace(hash="m")
    )
    monkeypatch.setattr(pipeline, "diagnose", answer)
    return cases


def diagnose(folder: Path, tests: list[str], references: list[str], *more: str) -> int:
    """Run the command on files of a folder; the answer goes to ``folder/out``."""
    tests, references = ([str(folder / name) for name in names] for names in (tests, references))
    out = ["--out", str(folder / "out")]
    reference = ["--reference", *references] if references else []
    return cli.main(["gap", "diagnose", *tests, *reference, *out, *more])


def test_an_answer_has_all_its_files(case_folder, seen):
    code = diagnose(case_folder, ["lift_r1.csv", "lift_r2.csv"], ["lift_r3.csv"], "--seed", "7")
    assert code == 0
    out = case_folder / "out"
    document = read_result(out / "result.json")
    assert document["inputs"]["reference"] == ["lift_r3"]
    assert sorted(document["inputs"]["test"]) == ["lift_r1", "lift_r2"]
    assert document["inputs"]["channels"]["emg"] is True
    assert document["hashes"]["inputs"] == case_hash(seen[0])
    assert seen[0].seed == 7
    assert "infra" in (out / "report.html").read_text()
    assert (out / "curves" / "shows.csv").is_file()
    assert "--seed 7" in (out / "run.log").read_text()


def test_names_and_order_change_no_case_and_no_model(case_folder, seen, tmp_path):
    other = tmp_path / "elsewhere"
    other.mkdir()
    for old, new in (("r1", "r9"), ("r2", "r4"), ("r3", "r6")):
        shutil.copy(case_folder / f"lift_{old}.csv", other / f"raise_{new}.csv")
    write_participant(other, id="bob")
    assert diagnose(case_folder, ["lift_r1.csv", "lift_r2.csv"], ["lift_r3.csv"]) == 0
    assert diagnose(other, ["raise_r4.csv", "raise_r9.csv"], ["raise_r6.csv"]) == 0
    assert case_hash(seen[0]) == case_hash(seen[1])
    settings = ModelSettings(REPOSITORY / "config" / "model", {"serratus_path": "flattened"}, {})
    keys = {_key(_inputs(case, settings), settings) for case in seen}
    assert len(keys) == 1
    documents = [read_result(f / "out" / "result.json") for f in (case_folder, other)]
    for document in documents:
        # Remarks name trials.
        del document["inputs"], document["warnings"]
    assert documents[0] == documents[1]


def test_without_reference_the_mode_says_so(case_folder, seen):
    assert diagnose(case_folder, ["lift_r1.csv"], []) == 0
    assert read_result(case_folder / "out" / "result.json")["mode"] == "no_reference"


def test_the_view_is_tracking_unless_asked_otherwise(case_folder, seen, views):
    diagnose(case_folder, ["lift_r1.csv"], [])
    diagnose(case_folder, ["lift_r1.csv"], [], "--view", "prediction")
    assert views == ["tracking", "prediction"]


def test_bad_input_is_refused_and_leaves_no_old_answer(case_folder, seen, capsys):
    assert diagnose(case_folder, ["lift_r1.csv"], ["lift_r3.csv"]) == 0
    write_csv(elevation().drop(columns="AC_z"), case_folder / "lift_r2.csv")
    assert diagnose(case_folder, ["lift_r2.csv"], ["lift_r3.csv"]) == 2
    out = case_folder / "out"
    assert not (out / "result.json").exists()
    assert not (out / "report.html").exists()
    assert not list((out / "curves").glob("*.csv"))
    assert "lift_r2.csv, row 1: missing column AC_z" in capsys.readouterr().err
    assert "missing column AC_z" in (out / "run.log").read_text()


def raising(error):
    def infer(*_, **__):
        raise error

    return infer


def test_a_failed_solve_is_an_answer_without_verdict(case_folder, seen, monkeypatch):
    monkeypatch.setattr(pipeline, "diagnose", raising(SolveError("lift: not solved")))
    assert diagnose(case_folder, ["lift_r1.csv"], ["lift_r3.csv"]) == 3
    document = read_result(case_folder / "out" / "result.json")
    assert document["status"] == "failed"
    assert document["status_reason"] == "SolveError: lift: not solved"
    assert document["candidates"] == []
    assert document["hashes"]["model"] == "m"


def test_a_diagnosis_that_was_asked_to_end_has_no_answer(case_folder, seen, monkeypatch, capsys):
    monkeypatch.setattr(pipeline, "diagnose", raising(StoppedError("stopped after 3 iterations")))
    assert diagnose(case_folder, ["lift_r1.csv"], ["lift_r3.csv"]) == 143
    assert "Stopped: stopped after 3 iterations" in capsys.readouterr().err
    assert not (case_folder / "out" / "result.json").exists()


def test_data_that_the_inference_cannot_use_are_refused(case_folder, seen, monkeypatch):
    monkeypatch.setattr(pipeline, "diagnose", raising(DataError("lift: too short")))
    assert diagnose(case_folder, ["lift_r1.csv"], ["lift_r3.csv"]) == 2


def test_an_answer_that_breaks_the_format_is_a_failure(case_folder, seen, monkeypatch):
    monkeypatch.setattr(pipeline, "diagnose", lambda *_, **__: finished_diagnosis(none_p=0.9))
    assert diagnose(case_folder, ["lift_r1.csv"], ["lift_r3.csv"]) == 3
    reason = read_result(case_folder / "out" / "result.json")["status_reason"]
    assert "expected 1" in reason


def test_a_broken_page_does_not_take_the_answer(case_folder, seen, monkeypatch, capsys):
    monkeypatch.setattr(page, "write_report", raising(ValueError("no ink")))
    assert diagnose(case_folder, ["lift_r1.csv"], ["lift_r3.csv"]) == 0
    assert json.loads((case_folder / "out" / "result.json").read_text())["status"] == "ok"
    assert "no ink" in capsys.readouterr().err


def test_the_command_of_the_package_exists():
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    module, _, function = project["scripts"]["scapulohumeral"].partition(":")
    assert callable(getattr(importlib.import_module(module), function))


def test_reference_trials_shape_the_model_if_there_are_any(case_folder, seen):
    assert diagnose(case_folder, ["lift_r1.csv", "lift_r2.csv"], ["lift_r3.csv"]) == 0
    assert diagnose(case_folder, ["lift_r1.csv", "lift_r2.csv"], []) == 0
    settings = ModelSettings(REPOSITORY / "config" / "model", {"serratus_path": "flattened"}, {})
    files = [_inputs(case, settings) for case in seen]
    shaping = [json.loads(each["settings.json"])["shaping_trials"] for each in files]
    assert shaping == [["reference0"], ["test0", "test1"]]
    tables = sorted(name for name in files[0] if name.endswith(".csv"))
    assert tables == ["case/reference0.csv", "case/test0.csv", "case/test1.csv"]


@pytest.fixture
def changed(tmp_path):
    """Function that writes a configuration file with one value replaced, and gives the option."""

    def write(option, key, value):
        names = {"--config": "config.yaml", "--settings": "gap/settings.yaml"}
        content = yaml.safe_load((REPOSITORY / "config" / names[option]).read_text())
        *sections, last = key.split(".")
        part = content
        for section in sections:
            part = part[section]
        part[last] = value
        path = tmp_path / "elsewhere.yaml"
        path.write_text(yaml.safe_dump(content))
        return option, str(path)

    return write


@pytest.mark.parametrize(
    ("option", "key", "value", "said"),
    [
        ("--config", "model.masses", "weighed", "key 'model.masses': 'weighed'; expected"),
        ("--config", "model.mases", "published", "Did you mean 'masses'"),
        ("--settings", "itreations", 3, "Did you mean 'iterations'"),
        ("--settings", "alpha", 0.01, "key 'alpha': 0.01; expected"),
        ("--settings", "nodes", 3, "key 'nodes': 3; expected"),
        ("--settings", "phase_functions", 20, "Refused: phase_functions: 20 of 21 nodes"),
    ],
)
def test_a_wrong_configuration_is_refused(case_folder, changed, option, key, value, said, capsys):
    """With key and reason, by every command, before anything is built."""
    options = changed(option, key, value)
    assert diagnose(case_folder, ["lift_r1.csv"], [], *options) == 2
    assert said in capsys.readouterr().err
    assert not (case_folder / "out" / "result.json").exists()
    assert cli.main(["gap", "bank", "check", *options]) == 2
    assert said in capsys.readouterr().err


def test_every_command_finds_the_files_that_a_configuration_names(
    case_folder, seen, changed, monkeypatch, capsys
):
    """Beside the configuration of the study, wherever the one that is used lies."""
    used = []

    def diagnosed(case, model, settings):
        used.append(bank_file(settings))
        return finished_diagnosis()

    monkeypatch.setattr(pipeline, "diagnose", diagnosed)
    for name, fits in (("gap/null_bank.json", True), ("gap/other.json", False)):
        options = changed("--settings", "null_bank", name)
        assert diagnose(case_folder, ["lift_r1.csv"], [], *options) == 0
        assert used[-1] == REPOSITORY / "config" / name
        assert (cli.main(["gap", "bank", "check", *options]) == 0) == fits
        assert fits or "other.json is not there" in capsys.readouterr().out


def test_each_process_takes_one_thread(tmp_path, monkeypatch):
    """Whatever Snakemake says of a job that has two processors."""
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    missing = str(tmp_path / "reach.csv")
    assert cli.main(["gap", "diagnose", missing, "--out", str(tmp_path / "answer")]) == 2
    assert os.environ["OMP_NUM_THREADS"] == "1"


def test_two_records_of_one_movement_are_what_the_command_was_told(case_folder, seen, capsys):
    options = ["lift_r1.csv"], ["lift_r3.csv"]
    # The EMG of the folder says that these are two movements.
    assert diagnose(case_folder, *options, "--one-movement") == 2
    assert "lift_r1: not each of them has" in capsys.readouterr().err
    for name in ("lift_r1.csv", "lift_r3.csv"):
        table = pd.read_csv(case_folder / name).drop(columns="EMG_infra")
        table.to_csv(case_folder / name, index=False)
    assert diagnose(case_folder, *options, "--one-movement") == 0
    assert diagnose(case_folder, *options) == 0
    assert [one.one_movement for one in seen] == [True, False]
    assert diagnose(case_folder, *options, "--one-movement", "--simulated") == 2
    assert "Leave one of them out" in capsys.readouterr().err


def test_what_made_simulations_is_refused_for_other_trials(case_folder, seen, capsys):
    simulator = ["--simulator", str(REPOSITORY / "config" / "gap" / "simulators" / "study.yaml")]
    for more in ([], ["--simulated"], ["--view", "prediction"]):
        assert diagnose(case_folder, ["lift_r1.csv"], [], *simulator, *more) == 2
        assert "expected it with --simulated --view prediction" in capsys.readouterr().err


def test_a_diagnosis_gets_what_it_is_said_to_depend_on(case_folder, seen, monkeypatch):
    """So that nothing else can change an answer, or has to rerun it."""
    given = []

    def read(config, *view):
        given.append(config)
        return read_settings(config, *view)

    monkeypatch.setattr(run, "read_settings", read)
    assert diagnose(case_folder, ["lift_r1.csv"], []) == 0
    assert set(given[0]) == {"model", "geometry", "weights", "gap", "problem", "prediction"}
    assert "cuff_w2" not in given[0]["prediction"]["conditions"]
