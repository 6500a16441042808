"""Files that are made once for a user, by whichever process needs them first."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path


def cached_file(path: Path, make: Callable[[Path], object]) -> Path:
    """The file at a path, made there if it is missing.

    It is made under its own name in a folder beside it and then moved into place, so that processes
    side by side see all of it or none, and one whose making failed leaves nothing behind.

    Parameters
    ----------
    path : in :func:`scapulohumeral.provenance.user_cache`; its folder may not exist yet
    make : writes the file to the path that it gets; what it raises is passed on
    """
    if not path.is_file():
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=path.parent) as scratch:
            unfinished = Path(scratch) / path.name
            make(unfinished)
            unfinished.replace(path)
    return path
