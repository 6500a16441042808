"""How the script that kills the quick study reads and compares what came out."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.unit

SCRIPT = Path(__file__).resolve().parents[2] / "kill_study.py"


@pytest.fixture(scope="module")
def kill_study():
    spec = importlib.util.spec_from_file_location("kill_study", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    # Dataclasses look their module up.
    sys.modules["kill_study"] = module
    spec.loader.exec_module(module)
    return module


def solve(folder: Path, name: str, objective: float, status: str = "optimal") -> None:
    path = folder / "results" / "tracking" / f"{name}.summary.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps({"objective": objective, "status": status}), encoding="utf-8")


def test_objectives_are_compared_and_failures_count(kill_study, tmp_path):
    for tree, last in (("a", 2.0), ("b", 2.0 + 2e-9), ("c", 2.1)):
        solve(tmp_path / tree, "one", 1.0)
        solve(tmp_path / tree, "two", last)
    a, b, c = (kill_study.objectives(tmp_path / tree) for tree in "abc")
    assert kill_study.largest_change(a, b) == pytest.approx(1e-9, rel=1e-3)
    assert kill_study.largest_change(a, c) > 0.04
    solve(tmp_path / "b", "one", 1.0, "iteration_limit")
    assert kill_study.largest_change(a, kill_study.objectives(tmp_path / "b")) == float("inf")
    assert kill_study.largest_change(a, {"one": 1.0}) == float("inf")
    assert kill_study.largest_change({}, {}) == float("inf")


def test_jobs_are_read_from_what_snakemake_says(kill_study, tmp_path, monkeypatch):
    says = "Job 3: Model of par2\\nJob 4: Tracking\\nFinished jobid: 3 (Rule: build_model)\\n"
    monkeypatch.setattr(kill_study, "STUDY", ("printf", says))
    # The command's own option, --cores, is an argument that printf has no place for.
    got = kill_study.run(tmp_path, 2)
    assert not got.killed
    assert got.started == ("Model of par2", "Tracking")
    assert got.finished == ("Model of par2",)


def test_a_run_that_takes_too_long_is_killed(kill_study, tmp_path, monkeypatch):
    script = "import time; print('Job 1: A', flush=True); time.sleep(60)"
    monkeypatch.setattr(kill_study, "STUDY", (sys.executable, "-c", script))
    got = kill_study.run(tmp_path, 2, kill_after_s=1.0)
    assert got.killed
    assert not got.finished


def test_solves_that_went_on_are_counted_by_their_logs(kill_study, tmp_path):
    log = tmp_path / "results/logs/solve_tracking/par2.solver.log"
    log.parent.mkdir(parents=True)
    log.write_text("{}\n", encoding="utf-8")
    assert not kill_study.resumed(tmp_path)
    log.write_text('{"remark": "Goes on from the checkpoint of an interrupted solve"}\n')
    assert {name for name, _ in kill_study.resumed(tmp_path)} == {log.name}
