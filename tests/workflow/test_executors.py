"""The study through executor plug-ins: profiles are complete, and a queue of one's own works."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

pytestmark = pytest.mark.workflow
QUEUE, STATUS = (Path(__file__).with_name(f"local_{name}.sh") for name in ("queue", "status"))
FOLDERS = ("config", "workflow", "src")


@pytest.mark.parametrize("profile", ["slurm", "generic"])
def test_cluster_profiles_run_the_study_as_the_default_does(profile: str, repository: Path) -> None:
    folder = repository / "workflow" / "profiles"
    texts = {
        name: yaml.safe_load((folder / name / "config.yaml").read_text(encoding="utf-8"))
        for name in ("default", profile)
    }
    for key in ("rerun-triggers", "keep-going", "rerun-incomplete", "default-resources"):
        assert texts[profile][key] == texts["default"][key]
    # Slurm and the like end a job beyond its memory; on this machine it may take more.
    assert texts[profile]["set-resources"]["calibrate"]["mem_mb"] > 4000
    assert "cores" not in texts[profile]


@pytest.mark.parametrize(
    ("qstat", "qacct", "said"),
    [
        ("echo job_number: 7", "exit 1", "running"),
        ("echo error reason 1: no such folder", "exit 1", "failed"),
        ("exit 1", "exit 1", "running"),
        ("exit 1", "printf 'failed 0\\nexit_status 0\\n'", "success"),
        ("exit 1", "printf 'failed 0\\nexit_status 1\\n'", "failed"),
        ("exit 1", "printf 'failed 37 : h_rt\\nexit_status 137\\n'", "failed"),
        ("exit 1", "printf 'failed 1\\nexit_status 1\\nfailed 0\\nexit_status 0\\n'", "success"),
    ],
)
def test_a_job_that_the_queue_ended_has_failed(
    qstat: str, qacct: str, said: str, repository: Path, tmp_path: Path
) -> None:
    """What Grid Engine says of a job, put into the three words that Snakemake knows."""
    for name, answer in (("qstat", qstat), ("qacct", qacct)):
        (tmp_path / name).write_text(f"#!/bin/sh\n{answer}\n", encoding="utf-8")
        (tmp_path / name).chmod(0o755)
    profile = repository / "workflow" / "profiles" / "generic" / "config.yaml"
    command = yaml.safe_load(profile.read_text(encoding="utf-8"))["cluster-generic-status-cmd"]
    done = subprocess.run(
        f"{command} '7'",
        shell=True, cwd=repository, env={"PATH": f"{tmp_path}:{os.environ['PATH']}"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert done.stdout == f"{said}\n"


@pytest.mark.slow
@pytest.mark.parametrize("killed", [False, True])
def test_a_queue_of_ones_own_makes_the_model(
    killed: bool, repository: Path, tmp_path: Path
) -> None:
    """One rule, submitted to a queue script with its memory and run time; killed jobs fail."""
    copy = tmp_path / "study"
    for name in FOLDERS:
        shutil.copytree(repository / name, copy / name)
    shutil.copyfile(repository / "Snakefile", copy / "Snakefile")
    if killed:
        script = copy / "workflow" / "scripts" / "build_participant_model.py"
        script.write_text("import os, signal\n\nos.killpg(0, signal.SIGKILL)\n", encoding="utf-8")
    notes = tmp_path / "queue.txt"
    asked = "{threads} {resources.mem_mb} {resources.runtime}"
    done = subprocess.run(
        [
            "snakemake", "--workflow-profile", "workflow/profiles/generic",
            "--cluster-generic-submit-cmd", f"{QUEUE} {notes} {asked}",
            "--cluster-generic-status-cmd", f"{STATUS} {notes}", "--latency-wait", "5",
            "--", "results/models/par2.json",
        ],
        cwd=copy, env={**os.environ, "PYTHONPATH": str(copy / "src")}, timeout=300,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode == 0) != killed, done.stderr
    assert (copy / "results" / "models" / "par2.json").is_file() != killed
    assert notes.read_text(encoding="utf-8").splitlines() == ["1 threads, 2000 MB, 30 min"]
