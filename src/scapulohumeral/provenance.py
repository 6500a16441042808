"""What a result was made from: source files, input files, versions of the software."""

import ast
import hashlib
import os
import platform
import subprocess
from collections.abc import Iterable, Iterator
from functools import cache
from importlib import metadata
from pathlib import Path

from scapulohumeral.errors import ConfigError

SOURCE_ROOT = Path(__file__).resolve().parents[1]
# What the study is. Files that a configuration names are relative to it, wherever that one lies.
CONFIG_FOLDER = SOURCE_ROOT.parent / "config"
MODEL_TABLES = CONFIG_FOLDER / "model"

# Packages whose version can change a number in a result.
NUMERICAL_PACKAGES = (
    "casadi",
    "cyipopt",
    "numpy",
    "opensim",
    "opty",
    "pandas",
    "scipy",
    "snakemake",
    "sympy",
)


def user_cache() -> Path:
    """Folder of what is made once for all checkouts and cases of a user; it may not exist yet."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "scapulohumeral"


def code_of(module: str, root: Path = SOURCE_ROOT) -> list[Path]:
    """Source files that run when a module is imported, found without importing it.

    Imports inside functions count too, so the list may hold more than a plain import would load.

    Parameters
    ----------
    module : str
        Dotted name, e.g. ``scapulohumeral.model.rotations``.
    root : Path
        Folder that holds the top-level package; imports from elsewhere are not followed.

    Returns
    -------
    list of Path
        Absolute paths, sorted: the module, its parents' ``__init__.py``, the same for all modules
        it imports, directly or not, and C sources named like one of them beside it.

    Raises
    ------
    ConfigError
        If there is no such module below ``root``.
    """
    if source_file(module, root) is None:
        raise ConfigError(
            f"No source file for module '{module}' in {root}; "
            "name a module by its dotted path, e.g. scapulohumeral.provenance."
        )
    found: dict[str, Path] = {}
    waiting = _source_files([module], root)
    while waiting:
        name, path = waiting.popitem()
        if name not in found:
            found[name] = path
            waiting |= _imported_files(path, name, root, path.stat().st_mtime_ns)
    beside = (path.with_suffix(".c") for path in found.values())
    return sorted([*found.values(), *(path for path in beside if path.is_file())])


def imported_names(path: Path, module: str) -> Iterator[str]:
    """Dotted names a source file may import, relative imports resolved.

    ``from a import b`` gives ``a.b`` (and with it ``a``): whether ``b`` is a module or a function
    is left to the reader of the name.

    Parameters
    ----------
    path : Path
        Source file.
    module : str
        Dotted name of that file, against which relative imports are resolved.
    """
    yield from _imported_names(path, module, path.stat().st_mtime_ns)


@cache
def _imported_names(path: Path, module: str, modified_ns: int) -> tuple[str, ...]:
    """The same, read once per version of the file: the code of every rule is asked for."""
    package = module if path.name == "__init__.py" else module.rpartition(".")[0]
    names: list[str] = []
    for node in _statements(ast.parse(path.read_text(encoding="utf-8"), filename=str(path))):
        if isinstance(node, ast.Import):
            names += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            origin = absolute_origin(node, package)
            names += [f"{origin}.{alias.name}" for alias in node.names]
    return tuple(names)


def _statements(node: ast.AST) -> Iterator[ast.AST]:
    """All statements below a node; their expressions, most of a tree, hold no imports."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.stmt | ast.excepthandler | ast.match_case):
            yield child
            yield from _statements(child)


@cache
def _imported_files(path: Path, module: str, root: Path, modified_ns: int) -> dict[str, Path]:
    """Modules that a source file may import, looked for once per version of the file."""
    return _source_files(imported_names(path, module), root)


def _source_files(modules: Iterable[str], root: Path) -> dict[str, Path]:
    """Files of those names that are modules below `root`, their parents' ``__init__.py`` too."""
    names = {name for module in modules for name in _with_parents(module)}
    files = {name: source_file(name, root) for name in sorted(names)}
    return {name: path for name, path in files.items() if path is not None}


def code_hash(module: str) -> str:
    """SHA-256 over names and contents of `code_of` a module, the same in every checkout."""
    files = code_of(module)
    return _hash((path.relative_to(SOURCE_ROOT).as_posix(), path.read_bytes()) for path in files)


def input_hash(paths: Iterable[Path | str]) -> str:
    """SHA-256 over names (without folder) and contents of files, in the order of both.

    Raises
    ------
    FileNotFoundError
        If one of the files is missing.
    """
    return _hash(sorted((path.name, path.read_bytes()) for path in map(Path, paths)))


def file_hash(path: Path) -> str:
    """SHA-256 of the content of a file, in hexadecimal digits."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def files_below(folder: Path) -> list[Path]:
    """All files of a folder and of those in it, in the order of their paths."""
    return sorted(path for path in folder.rglob("*") if path.is_file())


def last_commit(path: Path) -> str:
    """Ten digits of the hash and date of the commit that last changed a file, or why there is none.

    Says so if the file has been changed since.
    """
    try:
        commit = _git(path, "log", "-1", "--abbrev=10", "--format=%h of %cs")
        changed = _git(path, "status", "--porcelain")
    except FileNotFoundError:
        return "no commit: there is no git on this machine"
    if not commit:
        return "no commit: these files are not under version control"
    return f"{commit}, with changes that are not committed" if changed else commit


def _git(path: Path, *command: str) -> str:
    """What git says of a file."""
    asked = ["git", *command, "--", path.name]
    folder = path.resolve().parent
    found = subprocess.run(asked, cwd=folder, capture_output=True, text=True, check=False)
    return found.stdout.strip()


def environment_versions() -> dict[str, str]:
    """Versions of Python, the machine type and the `NUMERICAL_PACKAGES`, without importing them.

    Raises
    ------
    importlib.metadata.PackageNotFoundError
        If a package is missing; ``make environment`` installs it.
    """
    return {"machine": platform.platform()} | package_versions()


def package_versions() -> dict[str, str]:
    """Versions of Python and the `NUMERICAL_PACKAGES`; raises as `environment_versions`."""
    versions = {name: metadata.version(name) for name in NUMERICAL_PACKAGES}
    return {"python": platform.python_version()} | versions


def _with_parents(module: str) -> Iterator[str]:
    """`module` and all packages above it: ``a.b.c`` gives ``a``, ``a.b``, ``a.b.c``."""
    parts = module.split(".")
    return (".".join(parts[:count]) for count in range(1, len(parts) + 1))


def source_file(module: str, root: Path) -> Path | None:
    """File of a module or package below `root`; None for everything else, such as functions."""
    stem = root.joinpath(*module.split("."))
    candidates = (stem / "__init__.py", stem.with_name(f"{stem.name}.py"))
    return next((path for path in candidates if path.is_file()), None)


def module_of(name: str, root: Path = SOURCE_ROOT) -> str | None:
    """The module below `root` that a dotted name is, or stands in; None if there is none.

    What is imported from a package may be a module of it; from a module it is a function or class.
    """
    parts = name.split(".")
    modules = (".".join(parts[:count]) for count in range(len(parts), 0, -1))
    return next((module for module in modules if source_file(module, root)), None)


def absolute_origin(node: ast.ImportFrom, package: str) -> str:
    """Dotted name of the module in a ``from … import`` statement inside `package`."""
    if node.level == 0:
        return node.module or ""
    parts = package.split(".")
    parts = parts[: len(parts) - node.level + 1]
    return ".".join([*parts, node.module] if node.module else parts)


def _hash(files: Iterable[tuple[str, bytes]]) -> str:
    """SHA-256 over pairs of (name, content); lengths keep neighbouring contents apart."""
    digest = hashlib.sha256()
    for name, content in files:
        digest.update(f"{name}:{len(content)}:".encode())
        digest.update(content)
    return digest.hexdigest()
