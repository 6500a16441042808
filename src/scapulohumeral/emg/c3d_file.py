"""C3D files as the library reads them, with text of whatever software wrote it."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import ezc3d

from scapulohumeral.errors import DataError

# The C3D User Guide (Motion Lab Systems): blocks; where the header names the first and the last
# frame, in 16 bits; and the processor whose byte order is not the usual one.
BLOCK_BYTES, FRAMES_AT = 512, 6
MOST_FRAMES, BIG_ENDIAN = 65535, bytes([86])


def read_c3d(path: Path) -> Mapping[str, Any]:
    """Parameters and data of a file.

    Raises
    ------
    DataError                        the library cannot read it, or it was cut off
    """
    try:
        file: Mapping[str, Any] = ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError) as error:
        raise DataError(f"{path}: not a C3D file: {error}. Export the recording again.") from error
    found, stated = file["data"]["points"].shape[2], _stated_frames(path)
    # The library makes its header fit what it found.
    if file["data"]["points"].shape[1] and stated is not None and found < stated:
        raise DataError(
            f"{path}: {found} frames, but the file says {stated}: it was cut off. Copy it "
            "again, or export it again."
        )
    return file


def _stated_frames(path: Path) -> int | None:
    """Frames of markers by the header of a file; None where they are more than it can say."""
    with path.open("rb") as handle:
        header = handle.read(BLOCK_BYTES)
        handle.seek((header[0] - 1) * BLOCK_BYTES + 3)
        order = ">" if handle.read(1) == BIG_ENDIAN else "<"
    first, last = struct.unpack_from(f"{order}2H", header, FRAMES_AT)
    return None if last == MOST_FRAMES else last - first + 1


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
