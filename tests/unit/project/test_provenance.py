"""Provenance: the list of source files is the one Python loads, hashes follow the contents."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from scapulohumeral import provenance
from scapulohumeral.errors import ConfigError

pytestmark = pytest.mark.unit

LOADED_FILES = """
import importlib, sys
importlib.import_module(sys.argv[1])
for name, module in list(sys.modules.items()):
    if name.split(".")[0] == sys.argv[2]:
        print(module.__file__)
"""


def loaded_files(module: str, root: Path) -> set[Path]:
    """Files of the package that a fresh Python process loads for `module`."""
    result = subprocess.run(
        [sys.executable, "-c", LOADED_FILES, module, module.split(".")[0]],
        check=True,
        capture_output=True,
        text=True,
        env={"PYTHONPATH": str(root)},
    )
    return {Path(line) for line in result.stdout.splitlines()}


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package with every form of import that the walk has to follow."""
    files = {
        "arm/__init__.py": "from .units import DEGREE\n",
        "arm/units.py": "DEGREE = 0.017\n",
        "arm/unused.py": "",
        "arm/bones/__init__.py": "",
        "arm/bones/humerus.py": "from ..motion import speed\nfrom . import scapula\nimport math\n",
        "arm/bones/scapula.py": "import arm.motion.frames\n",
        "arm/motion/__init__.py": "",
        "arm/motion/speed.py": "from arm.motion.frames import thorax\n",
        "arm/motion/frames.py": "from arm import bones\nthorax = 1\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


def test_code_is_what_python_loads(package: Path) -> None:
    code = provenance.code_of("arm.bones.humerus", package)
    assert set(code) == loaded_files("arm.bones.humerus", package)
    assert package / "arm/unused.py" not in code


@pytest.mark.parametrize("module", ["scapulohumeral.provenance", "scapulohumeral.model.rotations"])
def test_code_of_this_package_is_what_python_loads(module: str) -> None:
    code = provenance.code_of(module)
    assert set(code) == loaded_files(module, provenance.SOURCE_ROOT)


def test_imports_inside_functions_count(package: Path) -> None:
    late = package / "arm/late.py"
    late.write_text("def run():\n    from arm import unused\n", encoding="utf-8")
    assert package / "arm/unused.py" in provenance.code_of("arm.late", package)


def test_c_sources_of_a_module_count(package: Path) -> None:
    before = provenance.code_of("arm.bones.humerus", package)
    kernels = package / "arm/motion/speed.c"
    kernels.write_text("int speed;\n", encoding="utf-8")
    (package / "arm/unused.c").write_text("", encoding="utf-8")
    assert provenance.code_of("arm.bones.humerus", package) == sorted([*before, kernels])
    assert any(
        path.name == "dense_kernels.c"
        for path in provenance.code_of("scapulohumeral.ocp.solving.solver")
    )


def test_unknown_module_is_refused() -> None:
    with pytest.raises(ConfigError, match="scapulohumeral.no_such_module"):
        provenance.code_of("scapulohumeral.no_such_module")


def test_code_hash_tells_modules_apart() -> None:
    first = provenance.code_hash("scapulohumeral.provenance")
    assert first == provenance.code_hash("scapulohumeral.provenance")
    assert first != provenance.code_hash("scapulohumeral.errors")


def test_input_hash_follows_content_and_name_but_not_order(tmp_path: Path) -> None:
    first, second = tmp_path / "a.csv", tmp_path / "b.csv"
    first.write_text("1")
    second.write_text("2")
    before = provenance.input_hash([first, second])
    assert before == provenance.input_hash([second, first])
    second.write_text("3")
    assert before != provenance.input_hash([first, second])
    assert provenance.input_hash([second]) != provenance.input_hash(
        [second.rename(tmp_path / "c.csv")]
    )


def test_input_hash_does_not_follow_folders(tmp_path: Path) -> None:
    """The same files are the same inputs, wherever results and participants lie."""
    hashes = set()
    for folders in (("x", "y"), ("y", "x")):
        paths = [tmp_path / "".join(folders) / folder for folder in folders]
        for path, name in zip(paths, ("a.csv", "b.csv"), strict=True):
            path.mkdir(parents=True)
            (path / name).write_text(name, encoding="utf-8")
        hashes.add(provenance.input_hash([paths[0] / "a.csv", paths[1] / "b.csv"]))
    assert len(hashes) == 1


def test_files_of_folders_inside_count_and_folders_do_not(tmp_path: Path) -> None:
    (tmp_path / "paths").mkdir()
    for name in ("paths/b.csv", "a.csv"):
        (tmp_path / name).write_text("x", encoding="utf-8")
    found = provenance.files_below(tmp_path)
    assert found == [tmp_path / "a.csv", tmp_path / "paths/b.csv"]
    assert provenance.input_hash(found) != provenance.input_hash(found[:1])


def test_without_git_there_is_no_commit(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    assert provenance.last_commit(Path(__file__)) == "no commit: there is no git on this machine"


def test_changes_that_are_not_committed_are_said(tmp_path: Path) -> None:
    """A commit that does not hold what stands in the file would vouch for nothing."""
    limits = tmp_path / "targets.yaml"
    limits.write_text("limit: 3\n", encoding="utf-8")
    none = "no commit: these files are not under version control"
    assert provenance.last_commit(limits) == none
    author = ["-c", "user.name=a", "-c", "user.email=a@b"]
    for command in (["init"], ["add", "."], [*author, "commit", "-m", "limits"]):
        subprocess.run(["git", *command], cwd=tmp_path, check=True, capture_output=True)
    committed = provenance.last_commit(limits)
    assert re.fullmatch(r"[0-9a-f]{7,} of [0-9-]{10}", committed)
    limits.write_text("limit: 4\n", encoding="utf-8")
    changed = f"{committed}, with changes that are not committed"
    assert provenance.last_commit(limits) == changed


def test_environment_names_the_solver_and_python() -> None:
    versions = provenance.environment_versions()
    assert {"python", "machine", "casadi", "cyipopt"} <= versions.keys()
    assert all(versions.values())
