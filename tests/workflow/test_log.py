"""The log of a failed script ends with one sentence: what failed, where, what to do."""

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.workflow

SCRIPT = """
import os, sys
from types import SimpleNamespace
sys.path.insert(0, sys.argv[1])
from _log import log_to_file
log_to_file(SimpleNamespace(
    rule="solve_tracking", log=SimpleNamespace(python=sys.argv[2]), wildcards={"trial": "frontal"}
))
os.write(1, b"line from C\\n")
from scapulohumeral.errors import DataError
raise {error}
"""


def log_of(error: str, repository: Path, folder: Path) -> list[str]:
    """Lines of the log of a script that raises `error`."""
    log = folder / "python.log"
    result = subprocess.run(
        [sys.executable, "-c", SCRIPT.replace("{error}", error)]
        + [str(repository / "workflow/scripts"), str(log)],
        capture_output=True,
        check=False,
    )
    assert result.returncode != 0
    assert not result.stdout + result.stderr, "everything belongs into the log"
    return log.read_text(encoding="utf-8").splitlines()


def test_last_line_is_the_sentence_of_the_error(repository: Path, tmp_path: Path) -> None:
    lines = log_of('DataError("row 3 lacks a time;\\n add it")', repository, tmp_path)
    assert lines[0] == "line from C"
    assert lines[-1].startswith("Failed: solve_tracking (trial frontal): DataError at <string>:")
    assert lines[-1].endswith("row 3 lacks a time; add it")


def test_unexpected_error_is_called_a_defect(repository: Path, tmp_path: Path) -> None:
    lines = log_of('KeyError("mass")', repository, tmp_path)
    assert "KeyError" in lines[-1]
    assert lines[-1].endswith("This is a defect of the program: see the traceback above.")
