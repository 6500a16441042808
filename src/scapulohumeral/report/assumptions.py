"""Modelling assumptions, collected from the comments that mark them in the sources."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

MARK = re.compile(r"#\s*ASSUME:?\s+(?P<text>.*)")
COMMENT = re.compile(r"^\s*#\s?(?P<text>.*)")


@dataclass(frozen=True)
class Assumption:
    """One marked comment and where it stands."""

    text: str
    file: str
    line: int


def find_assumptions(paths: Sequence[Path]) -> list[Assumption]:
    """Comments that begin with ``ASSUME``, with the comment lines that follow them.

    Parameters
    ----------
    paths : text files with comments after ``#``, in the order of the result
    """
    return [assumption for path in paths for assumption in _in_file(path)]


def _in_file(path: Path) -> list[Assumption]:
    lines = path.read_text(encoding="utf-8").splitlines()
    found = []
    for number, line in enumerate(lines):
        mark = MARK.search(line)
        if mark:
            text = [mark["text"], *_continuation(lines[number + 1 :])]
            found.append(Assumption(" ".join(text).strip(), path.as_posix(), number + 1))
    return found


def _continuation(lines: Sequence[str]) -> list[str]:
    """Text of the comment lines right below a mark, up to the next mark."""
    text = []
    for line in lines:
        comment = COMMENT.match(line)
        if comment is None or MARK.search(line):
            break
        text.append(comment["text"])
    return text
