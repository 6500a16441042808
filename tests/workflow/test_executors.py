"""The study through executor plug-ins: profiles are complete, and a queue of one's own works."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest
import yaml

pytestmark = pytest.mark.workflow
QUEUE = Path(__file__).with_name("local_queue.sh")
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


@pytest.mark.slow
def test_a_queue_of_ones_own_makes_the_model(repository: Path, tmp_path: Path) -> None:
    """One rule, submitted to a queue script with its memory and run time."""
    copy = tmp_path / "study"
    for name in FOLDERS:
        shutil.copytree(repository / name, copy / name)
    shutil.copyfile(repository / "Snakefile", copy / "Snakefile")
    notes = tmp_path / "queue.txt"
    asked = "{threads} {resources.mem_mb} {resources.runtime}"
    done = subprocess.run(
        [
            "snakemake", "--workflow-profile", "workflow/profiles/generic",
            "--cluster-generic-submit-cmd", f"{QUEUE} {notes} {asked}", "--latency-wait", "5",
            "--", "results/models/par2.json",
        ],
        cwd=copy, env={**os.environ, "PYTHONPATH": str(copy / "src")}, timeout=300,
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert (copy / "results" / "models" / "par2.json").is_file()
    assert notes.read_text(encoding="utf-8").splitlines() == ["1 threads, 2000 MB, 30 min"]
