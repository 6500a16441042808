"""Rules for the whole tree that no single test sees."""

import ast
import re
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest
from places import REPOSITORY

from scapulohumeral import provenance

pytestmark = pytest.mark.unit

CHECKED_FOLDERS = (".ci", "config", "src", "tests", "workflow")
CHECKED_SUFFIXES = (
    "", ".py", ".smk", ".sh", ".md", ".yaml", ".toml", ".cff", ".rst", ".csv", ".json", ".html",
)  # fmt: skip
MACHINE_PATH = re.compile(r"(?<![\w.}])/(?:home|root|tmp|mnt|opt|work|Users)/|[A-Z]:\\\\")
REMINDER = re.compile(r"\b(?:TO" r"DO|FIX" r"ME|XX" r"X)\b")

MODULES = sorted(provenance.SOURCE_ROOT.joinpath("scapulohumeral").rglob("*.py"))


def module_name(path: Path) -> str:
    """Dotted name of a source file."""
    parts = path.relative_to(provenance.SOURCE_ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def text_files(repository: Path) -> Iterator[Path]:
    """Hand-written files of the project."""
    folders = [path for name in CHECKED_FOLDERS for path in (repository / name).rglob("*")]
    for path in [*repository.iterdir(), *folders]:
        if path.is_file() and path.suffix in CHECKED_SUFFIXES and path.name != ".git":
            yield path


def findings(pattern: re.Pattern[str], repository: Path) -> list[str]:
    """File, line and text of every match."""
    return [
        f"{path.relative_to(repository)}:{number}: {line.strip()}"
        for path in text_files(repository)
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1)
        if pattern.search(line)
    ]


def test_no_absolute_machine_paths(repository: Path) -> None:
    assert not findings(MACHINE_PATH, repository)


def test_no_reminders_left_behind(repository: Path) -> None:
    assert not findings(REMINDER, repository)


def test_commands_that_are_documented_run_as_they_are_written(repository: Path) -> None:
    """Snakemake asks for a number of cores, which is in the profile."""
    templates = (repository / "src/scapulohumeral/report").rglob("*.j2")
    documents = [path for path in text_files(repository) if path.suffix in (".md", ".yaml")]
    documents += [*templates, repository / "reports/README.md"]
    bare = re.compile(r"\bsnakemake (?!-)[a-z]")
    assert len(documents) > 20
    assert not [path for path in documents if bare.search(path.read_text(encoding="utf-8"))]


def public_functions(path: Path) -> Iterator[ast.FunctionDef]:
    """Functions of a module and methods of its classes whose names do not start with `_`."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    classes = [node for node in tree.body if isinstance(node, ast.ClassDef)]
    for scope in [tree, *(node for node in classes if not node.name.startswith("_"))]:
        for node in scope.body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                yield node


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_public_functions_are_typed_and_documented(path: Path) -> None:
    for function in public_functions(path):
        arguments = [*function.args.args, *function.args.kwonlyargs]
        untyped = [
            a.arg for a in arguments if a.annotation is None and a.arg not in ("self", "cls")
        ]
        assert not untyped, f"{function.name}: no type for {untyped}"
        assert function.returns is not None, f"{function.name}: no return type"
        assert ast.get_docstring(function), f"{function.name}: no docstring"


def external_packages(paths: Iterable[Path]) -> set[str]:
    """Top-level names that the given source files import."""
    return {
        name.split(".")[0]
        for path in paths
        if path.suffix == ".py"
        for name in provenance.imported_names(path, "scapulohumeral")
    }


@pytest.mark.parametrize("path", MODULES, ids=module_name)
def test_no_module_loads_opensim_and_casadi(path: Path) -> None:
    packages = external_packages(provenance.code_of(module_name(path)))
    solvers = packages & {"casadi", "cyipopt"}  # cyipopt loads the IPOPT of the casadi wheel
    assert not ("opensim" in packages and solvers), "move one of the two into a rule of its own"


@pytest.mark.parametrize(
    "path", sorted((REPOSITORY / "tests").rglob("test_*.py")), ids=lambda path: path.name
)
def test_files_that_load_opensim_are_marked(
    path: Path,
    code_behind: Callable[[Path], set[Path]],
    is_opensim_test: Callable[[Path], bool],
) -> None:
    """Unmarked, they would be imported into a process that has casadi."""
    assert is_opensim_test(path) == ("opensim" in external_packages([path, *code_behind(path)]))
