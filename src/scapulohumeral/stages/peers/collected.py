"""This solver and its peers in one record."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path


def collect(solver: Path, peers: Sequence[Path], output: Path) -> None:
    """Write ``peers.json``: `own`, the record of this solver, and `peers` by name."""
    document = {
        "own": json.loads(solver.read_text(encoding="utf-8")),
        "peers": {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in peers},
    }
    output.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
