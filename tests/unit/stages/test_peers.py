"""Work of a peer: what it noted is kept, its time is limited, and its own words stand."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from scapulohumeral.stages.peers.limited import Notes, within

pytestmark = pytest.mark.unit

OUTPUT = """
iter    objective    inf_pr   inf_du lg(mu)  ||d||  lg(rg) alpha_du alpha_pr  ls
   0  1.0279626e+01 1.67e+01 1.00e+00   0.0 0.00e+00    -  0.00e+00 0.00e+00   0
  11 -2.1000000e+00 1.67e+01 1.00e+00   0.0 0.00e+00    -  0.00e+00 0.00e+00   0
  12r-2.0000000e+00 1.67e+01 1.00e+00   0.0 0.00e+00    -  0.00e+00 0.00e+00   0
"""


def test_notes_and_iterations_of_work_that_ends_are_kept(tmp_path: Path) -> None:
    def work(notes: Notes) -> None:
        print(OUTPUT)
        notes.add(build_seconds=1.0)
        notes.add(message="Solve_Succeeded")

    found = within(60.0, work, tmp_path / "work.log")
    assert found.pop("wall_seconds") > 0.0
    assert found.pop("processor_seconds") < 60.0
    assert found == {
        "iterations": 12,
        "build_seconds": 1.0,
        "message": "Solve_Succeeded",
        "finished": True,
    }


def test_work_that_takes_too_long_is_ended_with_its_children(tmp_path: Path) -> None:
    child = tmp_path / "child"

    def work(notes: Notes) -> None:
        notes.add(build_seconds=1.0)
        process = subprocess.Popen([sys.executable, "-c", "while True: pass"])
        child.write_text(str(process.pid))
        process.wait()

    found = within(1.0, work, tmp_path / "work.log")
    assert (found["message"], found["finished"]) == ("not finished in 1 s", False)
    assert found["build_seconds"] == 1.0
    assert found["processor_seconds"] > 0.0
    until = time.monotonic() + 10.0
    while _runs(int(child.read_text())):
        assert time.monotonic() < until, "the child is still there"
        time.sleep(0.05)


def test_an_error_is_quoted(tmp_path: Path) -> None:
    def work(notes: Notes) -> None:
        raise RuntimeError("locked coordinates are not supported")

    found = within(60.0, work, tmp_path / "work.log")
    assert found["message"] == "RuntimeError: locked coordinates are not supported"
    assert not found["finished"]


def test_what_work_leaves_in_its_folder_is_removed(tmp_path: Path) -> None:
    def work(notes: Notes) -> None:
        Path("left_behind.txt").write_text("")
        notes.add(folder=str(Path.cwd()))

    found = within(60.0, work, tmp_path / "work.log")
    assert not Path(found["folder"]).exists()
    assert [path.name for path in tmp_path.iterdir()] == ["work.log"]


def _runs(pid: int) -> bool:
    """Whether a process runs; one that has ended and was not yet waited for does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"
