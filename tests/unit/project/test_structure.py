"""The tree as a newcomer reads it: packages in one direction, none too large."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.unit

# Packages and single modules from the lowest floor up. A module may import from floors below its
# own, and from its own. Those in one row know nothing of each other.
FLOORS: tuple[tuple[str, ...], ...] = (
    ("errors",),
    ("documents", "templates", "cached_file", "linear_algebra", "exit_codes"),
    ("provenance",),
    ("instructions",),
    ("model",),
    ("configuration",),
    ("dynamics", "emg"),
    ("ocp",),
    ("quantities",),
    ("problems",),
    ("stages",),
    ("study", "player"),
    ("report",),
    ("laboratory",),
    ("gap.weighing",),
    ("gap.labels", "gap.settings", "gap.parallel"),
    ("gap.effects",),
    ("gap.recording",),
    ("gap.result", "gap.curve_files"),
    ("gap.nominal",),
    ("gap.signatures",),
    ("gap.residual",),
    ("gap.detection", "gap.isolation"),
    ("gap.assembly", "gap.explained", "gap.left_over"),
    ("gap.verdict",),
    ("gap.judgement",),
    ("gap.robustness", "gap.output"),
    ("gap.answer",),
    ("gap.pipeline",),
    ("gap.run",),
    ("gap.benchmark",),
    ("gap.cli",),
    ("cli",),
)
# One module per family of effects.
MOST_MODULES, UNLIMITED = 15, {"gap/effects"}
LONGEST_FUNCTION = 45


def test_no_import_runs_against_the_order(package: Path):
    against = [
        f"{module} imports {target}"
        for module, target in imports(package)
        if (floor(target) > floor(module)) or beside(module, target)
    ]
    assert not against


def test_every_module_has_a_floor(package: Path):
    whole = {entry.split(".")[0] for row in FLOORS for entry in row} | {""}
    lost = [name for name in modules(package) if floor(name) < 0 and name not in whole]
    assert not lost, "name their packages in FLOORS"


def test_no_import_circle(package: Path):
    below: dict[str, set[str]] = {}
    for module, target in imports(package):
        below.setdefault(module, set()).add(target)
    settled: set[str] = set()
    waiting = set(modules(package))
    while waiting:
        free = {m for m in waiting if below.get(m, set()) - {m} <= settled}
        assert free, f"modules that import each other are among {sorted(waiting)}"
        settled |= free
        waiting -= free


def test_packages_are_small_enough_to_survey(package: Path):
    counts = {
        str(folder.relative_to(package)): len(list(folder.glob("*.py"))) - 1
        for folder in {path.parent for path in package.rglob("*.py")}
    }
    too_many = {k: n for k, n in counts.items() if n > MOST_MODULES and k not in UNLIMITED}
    assert not too_many


def test_each_module_opens_with_what_it_is_for(package: Path):
    silent = []
    for path in package.rglob("*.py"):
        text = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
        if not text.split("\n")[0].rstrip().endswith((".", ":")):
            silent.append(str(path.relative_to(package)))
    assert not silent


def test_functions_are_short(package: Path):
    long = [
        f"{path.relative_to(package)}:{node.lineno} {node.name}"
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
        and body_lines(node) > LONGEST_FUNCTION
    ]
    assert not long


@pytest.fixture
def package(repository: Path) -> Path:
    return repository / "src" / "scapulohumeral"


def body_lines(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines of a function without its signature and docstring."""
    body = node.body[1:] if ast.get_docstring(node) is not None else node.body
    return 0 if not body else (body[-1].end_lineno or 0) - body[0].lineno + 1


def modules(package: Path) -> Iterator[str]:
    """Dotted names below the package."""
    for path in package.rglob("*.py"):
        parts = path.relative_to(package).with_suffix("").parts
        yield ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(package: Path) -> Iterator[tuple[str, str]]:
    """Which module imports which, both below the package."""
    known = set(modules(package))
    for name in known:
        folder = package.joinpath(*name.split(".")) if name else package
        path = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(package.name):
                origin = (node.module or "")[len(package.name) + 1 :]
                for alias in node.names:
                    inner = f"{origin}.{alias.name}".strip(".")
                    yield name, inner if inner in known else origin


def floor(module: str) -> int:
    """Place of a module in the order, by its longest entry; -1 if it has none."""
    places = [
        (len(entry), number)
        for number, row in enumerate(FLOORS)
        for entry in row
        if module == entry or module.startswith(f"{entry}.")
    ]
    return max(places)[1] if places else -1


def beside(module: str, target: str) -> bool:
    """Whether both stand in one row of the order, but not in one package of it."""
    if floor(module) != floor(target) or floor(module) < 0:
        return False
    row = FLOORS[floor(module)]
    return not any(
        all(name == entry or name.startswith(f"{entry}.") for name in (module, target))
        for entry in row
    )
