"""Files that the rule of a test of results was given."""

from pathlib import Path

import pytest


def paths(files, name: str) -> list[Path]:
    """Files of an input of the rule, which is no list if it is one file."""
    value = files[name]
    return [Path(value)] if isinstance(value, str) else [Path(path) for path in value]


def some_paths(files, name: str) -> list[Path]:
    """The same; a test of none would pass whatever the study does, so it is skipped."""
    found = paths(files, name)
    if not found:
        pytest.skip(f"the study has no {name.replace('_', ' ')}")
    return found
