"""C3D files as the library reads them, with text of whatever software wrote it."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import ezc3d

from scapulohumeral.errors import DataError


def read_c3d(path: Path) -> Mapping[str, Any]:
    """Parameters and data of a file.

    Raises
    ------
    DataError                        the library cannot read it
    """
    try:
        file: Mapping[str, Any] = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError) as error:
        raise DataError(f"{path}: not a C3D file: {error}. Export the recording again.") from error
    return file


def text_of(value: str) -> str:
    """A text of a file without blanks around it.

    The format names no encoding: what is not UTF-8, which the library hands on as lone surrogates,
    is taken as Windows software of western languages writes it.
    """
    raw = value.encode("utf-8", "surrogateescape")
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("cp1252", "replace").strip()
