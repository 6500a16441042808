"""Sealed keys, opened: that somebody looks is noted beside them before the first is read.

Score cards can be deleted, and what reads keys may fail: they count as seen all the same.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from scapulohumeral.errors import DataError

LOOKS = "looks.json"


def opened_keys(keys: Path, names: Iterable[str], why: str, **more: Any) -> dict[str, bytes]:
    """Keys by the name of their case, as they are in their files.

    Parameters
    ----------
    keys : folder of ``CASE.json``, in which the look is noted
    names : of cases
    why, more : what is noted of the look, beside its date

    Raises
    ------
    DataError                        a key is missing; then none was read, and no look is noted
    """
    paths = {name: key_file(keys, name) for name in names}
    look = {"opened": {"date": now(), "for": why}, **more}
    text = json.dumps([*looks(keys), look], indent=1) + "\n"
    (keys / LOOKS).write_text(text, encoding="utf-8")
    return {name: path.read_bytes() for name, path in paths.items()}


def key_file(keys: Path, name: str) -> Path:
    """The file of the key of a case; raises DataError if it is missing."""
    path = keys / f"{name}.json"
    if not path.is_file():
        raise DataError(f"{path}: missing; expected the key of case {name}.")
    return path


def looks(keys: Path) -> list[dict[str, Any]]:
    """Who opened keys so far, the latest last."""
    path = keys / LOOKS
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def now() -> str:
    """Date and time as they are noted."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
