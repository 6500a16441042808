"""Folders that commands write into."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from scapulohumeral.errors import ConfigError, DataError


def make_folder(out: Path) -> None:
    """Make a folder for results, with those above it; one that is there is kept.

    Raises
    ------
    ConfigError                      a file is in its place, or nobody may write there
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        if not os.access(out, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(out))
    except OSError as error:
        raise unwritable(out, error) from error


def check_kept(read: Iterable[Path], written: Iterable[Path]) -> None:
    """Refuse to write over what is read.

    Raises
    ------
    ConfigError                      names the file that would be lost
    """
    lost = {path.resolve() for path in written}
    for path in read:
        if path.resolve() in lost:
            raise ConfigError(
                f"{path}: is read, and the result would replace it; expected another folder as "
                "--out. Name one that holds no recordings."
            )


def check_own(written: Iterable[Path], beside: Callable[[Path], Path]) -> None:
    """Refuse to replace files of others, which lack what a command writes beside its own.

    Parameters
    ----------
    written : files that are to be written
    beside : of a file, what its command writes beside it

    Raises
    ------
    ConfigError                      names the file that would be lost
    """
    for path in written:
        if path.exists() and not beside(path).exists():
            raise ConfigError(
                f"{path}: is there without {beside(path).name}, so this command did not make it, "
                "and the result would replace it; expected another folder as --out. Name one, or "
                "move the file."
            )


def check_names(what: str, names: Sequence[str]) -> None:
    """Refuse two files of one name, of which one would replace the other.

    Parameters
    ----------
    what : is named so, for the message
    names : without suffix

    Raises
    ------
    DataError                        names those that stand more than once
    """
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise DataError(
            f"{what} named {', '.join(twice)} more than once; expected different names, which "
            "become the names of the trials. Rename the files."
        )


def unwritable(out: Path, error: OSError) -> ConfigError:
    """The refusal of a folder that the system would not write into."""
    return ConfigError(
        f"--out {out}: {error.strerror}: {error.filename}; expected a folder that can be "
        "written into. Name another one, or remove what is in its place."
    )
