"""The five errors of the package, one per kind of remedy.

A message names the value, its place (file and row, column or key; joint, node or time),
what was expected, and what to do about it.
"""

from pathlib import Path

# Exit code of a command or process that refuses its input.
REFUSED = 2
# The same of one that SIGTERM ended, as shells have it.
STOPPED = 143


class ConfigError(ValueError):
    """The study cannot be run as configured: the remedy is to edit the configuration."""


class ModelError(ValueError):
    """The musculoskeletal model contradicts itself: the remedy is to correct the model tables."""


class DataError(ValueError):
    """A recording or table cannot be used as it is: the remedy is to correct the data file."""


class SolveError(RuntimeError):
    """An optimal control problem was not solved: the remedy is another start, mesh or setting."""


class StoppedError(RuntimeError):
    """The process was asked to end: the remedy is to run the same again.

    It says nothing of the problem that was being solved, so whatever makes a result of a
    :class:`SolveError` lets it pass.
    """


def absent(path: Path) -> str:
    """Why a path names no file, as part of a message."""
    return "a folder; expected a file" if path.is_dir() else "no such file"
