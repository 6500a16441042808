"""Accept what the present code answers to the golden cases as right, deliberately.

Usage: ``PYTHONPATH=tests python -m golden.accept [CASE ...]``. Prints what changes for a reader.
When this is allowed is said in ``README.md``.
"""

from __future__ import annotations

import argparse
import json
import tempfile
from pathlib import Path
from typing import Any

from golden.answers import CASES, NAMES, RESULT, answer, differences

from scapulohumeral.gap.result import read_result

# Digits that are kept: far beyond all tolerances. Shares still add up to one, and equal runs give
# equal files.
DIGITS = 9


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", choices=[*NAMES, []], metavar="CASE")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        for name in options.cases or NAMES:
            _accept(CASES / name, Path(folder) / name, Path(folder) / "cache")


def _accept(case: Path, folder: Path, cache: Path) -> None:
    done = answer(case, folder, cache)
    if done.returncode != 0:
        raise SystemExit(f"{case.name}: exit code {done.returncode}\n{done.stderr}")
    found = read_result(folder / "out" / RESULT)
    stored = case / RESULT
    if stored.exists():
        changes = differences(found, read_result(stored))
        print(f"{case.name}: {len(changes)} changes", *changes, sep="\n  ")
    stored.write_text(json.dumps(_rounded(found), indent=1) + "\n", encoding="utf-8")


def _rounded(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _rounded(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_rounded(value) for value in node]
    return float(f"{node:.{DIGITS}g}") if isinstance(node, float) else node


if __name__ == "__main__":
    main()
