"""Fixtures and collection rules for all tests."""

import re
from collections.abc import Callable
from pathlib import Path

import hypothesis
import pytest

from scapulohumeral import provenance

# The same examples in every run; no deadline, because symbolic code compiles on first use.
hypothesis.settings.register_profile("study", derandomize=True, deadline=None)
hypothesis.settings.load_profile("study")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import a test file with opensim tests only under ``-m opensim``, and no other file then.

    The opensim and casadi wheels cannot be loaded into one process, and collecting a test file
    imports it whatever its marks are.
    """
    if not collection_path.match("test_*.py"):
        return None
    wants_opensim = config.option.markexpr == "opensim"
    return True if is_opensim_test(collection_path) != wants_opensim else None


def is_opensim_test(path: Path) -> bool:
    """Whether a test file, or one of its tests, carries the mark `opensim`."""
    text = path.read_text(encoding="utf-8")
    return re.search(r"^(?:pytestmark\b.*|\s*@)pytest\.mark\.opensim", text, re.M) is not None


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Refuse a test that no command would run: `make unit` and the rule choose by these marks."""
    kinds = ("unit", "workflow", "opensim", "results")
    lost = [
        item.nodeid
        for item in items
        if sum(item.get_closest_marker(kind) is not None for kind in kinds) != 1
    ]
    if lost:
        raise pytest.UsageError(
            f"{lost[0]}: expected exactly one of the marks {', '.join(kinds)}. Set pytestmark."
        )


@pytest.fixture(scope="session", name="is_opensim_test")
def is_opensim_test_fixture() -> Callable[[Path], bool]:
    """The function of the same name."""
    return is_opensim_test


@pytest.fixture(scope="session")
def repository() -> Path:
    """Top folder of the checkout."""
    return Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def code_behind() -> Callable[[Path], set[Path]]:
    """Function that gives the source files of the package which a script or test file loads."""

    def code_behind(path: Path) -> set[Path]:
        files: set[Path] = set()
        for name in provenance.imported_names(path, path.stem):
            module = provenance.module_of(name)
            if name.split(".")[0] == "scapulohumeral" and module is not None:
                files.update(provenance.code_of(module))
        return files

    return code_behind
