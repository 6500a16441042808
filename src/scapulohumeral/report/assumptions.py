"""Modelling assumptions, collected from the comments and texts that mark them in the sources."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

MARK = re.compile(r"#\s*ASSUME:?\s+(?P<text>.*)")
# In texts of the program, such as the source of a parameter's bounds.
TEXT_MARK = re.compile(r"\bASSUME:?\s+")
# Calls that describe a parameter: its name comes first.
DESCRIBES = "Param"
COMMENT = re.compile(r"^\s*#\s?(?P<text>.*)")


@dataclass(frozen=True)
class Assumption:
    """One marked comment or text and where it stands."""

    text: str
    file: str
    line: int


def find_assumptions(paths: Sequence[Path]) -> list[Assumption]:
    """Comments that begin with ``ASSUME`` and go on below, and texts of Python code that hold it.

    A text that bounds a parameter carries the name of the parameter.

    Parameters
    ----------
    paths : text files with comments after ``#``, in the order of the result
    """
    return [assumption for path in paths for assumption in _in_file(path)]


def _in_file(path: Path) -> list[Assumption]:
    source = path.read_text(encoding="utf-8")
    found = _in_comments(path, source.splitlines())
    if path.suffix == ".py":
        found += _in_texts(path, ast.parse(source))
    return sorted(found, key=lambda assumption: assumption.line)


def _in_comments(path: Path, lines: Sequence[str]) -> list[Assumption]:
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


def _in_texts(path: Path, tree: ast.Module) -> list[Assumption]:
    """Marked texts, once for each parameter that they are the source of."""
    constants = {
        target.id: node.value
        for node in tree.body
        if isinstance(node, ast.Assign)
        for target in node.targets
        if isinstance(target, ast.Name)
    }
    names: dict[ast.expr, list[str]] = {}
    for call in ast.walk(tree):
        if isinstance(call, ast.Call) and getattr(call.func, "id", None) == DESCRIBES:
            for given in (*call.args, *(keyword.value for keyword in call.keywords)):
                text = constants.get(given.id) if isinstance(given, ast.Name) else given
                if text is not None:
                    names.setdefault(text, []).append(_first_text(call))
    return [
        Assumption(name + _unmarked(text), path.as_posix(), node.lineno)
        for node, text in _texts(tree)
        if TEXT_MARK.search(text)
        for name in names.get(node, [""])
    ]


def _first_text(call: ast.Call) -> str:
    """Name of the parameter that a call describes, before what is said of it; empty if unknown."""
    first = call.args[0] if call.args else None
    return f"{first.value!s}: " if isinstance(first, ast.Constant) else ""


def _unmarked(text: str) -> str:
    """A text without its mark, which leaves a word where only what follows is assumed."""
    return TEXT_MARK.sub("assumed: ", text).removeprefix("assumed: ")


def _texts(tree: ast.Module) -> Iterator[tuple[ast.expr, str]]:
    """All texts but those that document, with their nodes."""
    documents = {node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node not in documents:
            yield node, node.value
