"""The installed packages are the locked ones, and the lock file is complete and portable."""

import re
import sysconfig
import tomllib
from importlib import metadata
from pathlib import Path

import pytest

pytestmark = pytest.mark.unit


@pytest.fixture
def lock(repository: Path) -> str:
    return (repository / "environment.lock").read_text(encoding="utf-8")


@pytest.fixture
def locked(lock: str) -> dict[str, str]:
    """Locked version of each package."""
    return dict(re.findall(r"^([a-z0-9.-]+)==(\S+)", lock, flags=re.MULTILINE))


def canonical(name: str) -> str:
    """Package name as package indices compare it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def test_installed_versions_are_the_locked_ones(locked: dict[str, str]) -> None:
    # Only site-packages: once setuptools is imported, the copies it carries are on the path too.
    folder = sysconfig.get_path("purelib")
    installed = {canonical(d.name): d.version for d in metadata.distributions(path=[folder])}
    differing = {
        name: (version, installed.get(name))
        for name, version in locked.items()
        if installed.get(name) != version
    }
    assert not differing, f"package: (locked, installed); run `make environment`: {differing}"


def test_every_declared_dependency_is_locked(repository: Path, locked: dict[str, str]) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    declared = sum(project["optional-dependencies"].values(), start=project["dependencies"])
    names = {canonical(re.split(r"[=<>~!]", requirement)[0]) for requirement in declared}
    assert not names - locked.keys(), "run `make lock`"


def test_every_entry_carries_hashes(lock: str) -> None:
    entries = re.findall(
        r"^[a-z0-9.-]+==\S+ \\\n((?:    --hash=\S+(?: \\)?\n)+)", lock, re.MULTILINE
    )
    assert len(entries) == len(re.findall(r"^[a-z0-9]", lock, re.MULTILINE))


def test_lock_names_no_host_and_no_folder(lock: str) -> None:
    assert "://" not in lock
    assert not re.search(r"^\s*-[a-z-]*(?:index|find-links|host)", lock, re.MULTILINE)


def test_solver_is_the_ipopt_of_the_casadi_wheel() -> None:
    import cyipopt

    assert cyipopt.IPOPT_VERSION == (3, 14, 19)
