"""The command line: quick help, one entry for all commands, errors with a remedy."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from scapulohumeral import cli
from scapulohumeral.gap.cli import _parser as gap_parser

pytestmark = pytest.mark.unit
# What takes seconds to import, or loads a solver.
HEAVY = ("casadi", "ezc3d", "matplotlib", "numpy", "opensim", "pandas", "scipy", "sympy")


@pytest.mark.parametrize("command", [[], *([name] for name in cli.COMMANDS)])
def test_help_imports_nothing_heavy(command: list[str]) -> None:
    code = (
        "import sys\nfrom scapulohumeral import cli\n"
        f"try:\n    cli.main({[*command, '--help']!r})\nexcept SystemExit as end:\n"
        f"    print(end.code, sorted(set(sys.modules) & set({HEAVY!r})))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 []"


@pytest.mark.parametrize("command", [*cli.COMMANDS, "gap", "gap diagnose"])
def test_each_help_shows_examples_that_are_understood(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        cli.main([*command.split(), "--help"])
    shown = examples(capsys.readouterr().out.split("example")[-1])
    assert [words for words in shown if " ".join(words).startswith(f"scapulohumeral {command}")]
    for words in shown:
        understood(words)


def test_the_commands_of_the_readme_are_understood(repository: Path) -> None:
    shown = examples((repository / "README.md").read_text(encoding="utf-8"))
    assert {words[1] for words in shown} == {*cli.COMMANDS, cli.GAP}
    for words in shown:
        understood(words)


def examples(text: str) -> list[list[str]]:
    """Commands in a text, as words; lines that are set in further go on with the one before."""
    found = re.findall(r"^( *)(scapulohumeral .+(?:\n\1 {4}\S.*)*)", text, re.MULTILINE)
    return [shlex.split(command, comments=True) for _, command in found]


def understood(words: list[str]) -> None:
    """Read the arguments of a command without running it; what is wrong ends the test."""
    parser = gap_parser() if words[1] == cli.GAP else cli._parser(words[1:2])
    parser.parse_args(words[1:])


def test_the_gap_keeps_its_own_command_line(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        cli.main(["gap", "diagnose", "--help"])
    assert end.value.code == 0
    assert "--reference" in capsys.readouterr().out


def test_errors_say_what_to_do(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recording = str(tmp_path / "a.c3d")
    map_file = str(tmp_path / "none.yaml")
    assert cli.main(["convert", recording, "--map", map_file, "--out", str(tmp_path)]) == 2
    assert "Refused: " in capsys.readouterr().err
