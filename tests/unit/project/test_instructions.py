"""The hash of instructions follows what is computed, and neither words nor places."""

import re
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.detection.null_bank import LEFT_OUT, STATISTICS
from scapulohumeral.gap.detection.null_bank import PACKAGE as GAP
from scapulohumeral.gap.run import ANSWERING
from scapulohumeral.instructions import instruction_hash, kept_instruction_hash
from scapulohumeral.provenance import SOURCE_ROOT

pytestmark = pytest.mark.unit

FILES = {
    "arm/__init__.py": "",
    "arm/units.py": "HALF = 0.5\nUNUSED = 3\n\n\ndef unused():\n    return UNUSED\n",
    "arm/bone.py": "SIZE = (1.0,)\n\n\ndef length(x):\n    return SIZE[0] * x\n",
    "arm/joint.py": "SIZE = (2.0,)\n\n\ndef width(x):\n    return SIZE[0] * x\n",
    "arm/main.py": '''"""Doc."""

from arm import bone, joint
from arm.units import HALF as SHARE

FAMILIES = (bone, joint)


def total(x: float) -> float:
    """Total."""
    if x < 0:
        raise ValueError(f"{x} is below zero")
    # why
    return sum(family.SIZE[0] for family in FAMILIES) + bone.length(SHARE * x)
''',
}


def written(folder: Path, **changes: tuple[str, str]) -> Path:
    """A small package, with (old, new) replaced in modules by name."""
    for name, text in FILES.items():
        old, new = changes.get(Path(name).stem, ("", ""))
        assert old in text
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text.replace(old, new) if old else text, encoding="utf-8")
    return folder


def small_hash(folder: Path) -> str:
    return instruction_hash(["arm.main:total"], "arm", folder)


@pytest.mark.parametrize(
    ("module", "change"),
    [
        ("main", ("Total.", "Sum.")),
        ("main", ("# why", "# because")),
        ("main", ("x: float", "x: int")),
        ("main", ("below zero", "negative")),
        ("main", ("from arm.units import HALF as SHARE", "from arm.units import HALF as SHARE, x")),
        ("units", ("UNUSED = 3", "UNUSED = 4")),
    ],
)
def test_words_and_what_is_not_reached_do_not_count(
    tmp_path: Path, module: str, change: tuple[str, str]
) -> None:
    before = small_hash(written(tmp_path / "a"))
    assert small_hash(written(tmp_path / "b", **{module: change})) == before


@pytest.mark.parametrize(
    ("module", "change"),
    [
        ("units", ("0.5", "0.6")),
        ("bone", ("1.0", "1.1")),
        ("joint", ("2.0", "2.1")),
        ("joint", ("SIZE[0] * x", "SIZE[0] + x")),
        ("main", ("(bone, joint)", "(joint, bone)")),
        ("main", ("x < 0", "x <= 0")),
        ("main", ("ValueError", "TypeError")),
        ("main", ("bone.length(", "joint.width(")),
    ],
)
def test_every_instruction_that_is_reached_counts(
    tmp_path: Path, module: str, change: tuple[str, str]
) -> None:
    before = small_hash(written(tmp_path / "a"))
    assert small_hash(written(tmp_path / "b", **{module: change})) != before


def test_equal_names_of_two_modules_are_told_apart(tmp_path: Path) -> None:
    """``SIZE`` of one module in place of ``SIZE`` of another is another instruction."""
    change = ("bone.length(SHARE", "bone.length(bone.SIZE[0] * SHARE")
    other = ("bone.length(SHARE", "bone.length(joint.SIZE[0] * SHARE")
    one, two = written(tmp_path / "a", main=change), written(tmp_path / "b", main=other)
    assert small_hash(one) != small_hash(two)


def test_own_names_of_a_function_are_not_those_of_its_module(tmp_path: Path) -> None:
    change = ("    # why\n", "    for UNUSED in ():\n        x = UNUSED\n")
    root = written(tmp_path, main=change)
    path = root / "arm/main.py"
    before = small_hash(root)
    path.write_text(path.read_text().replace("as SHARE\n", "as SHARE, UNUSED\n"))
    assert small_hash(root) == before


def test_an_entry_that_is_gone_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match=r"no definition sum_up in module arm\.main"):
        instruction_hash(["arm.main:sum_up"], "arm", written(tmp_path))


# Modules of the bank that move into packages, one of them under another name.
MOVES = {
    "scapulohumeral.gap.verdict.posterior": "scapulohumeral.gap.probable.posterior",
    "scapulohumeral.gap.detection.presence": "scapulohumeral.gap.detection.tests",
    "scapulohumeral.gap.recording.case": "scapulohumeral.gap.recording.whole.case",
}


@pytest.fixture(scope="module")
def copied(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources."""
    root = tmp_path_factory.mktemp("sources")
    shutil.copytree(SOURCE_ROOT / "scapulohumeral", root / "scapulohumeral")
    return root


Edit = Callable[[str, str, str], Path]


@pytest.fixture
def edited(copied: Path) -> Iterator[Edit]:
    """Function that replaces a text of one module in the copy; undone afterwards."""
    before: dict[Path, str] = {}

    def edit(module: str, old: str, new: str) -> Path:
        path = file_of(copied, f"scapulohumeral.{module}")
        before[path] = path.read_text(encoding="utf-8")
        assert old in before[path]
        path.write_text(before[path].replace(old, new), encoding="utf-8")
        return copied

    yield edit
    for path, text in before.items():
        path.write_text(text, encoding="utf-8")


@pytest.fixture(scope="module")
def bank_before() -> str:
    """Hash of the code of the bank, as it is."""
    return bank_code(SOURCE_ROOT)


@pytest.fixture(scope="module")
def answers_before() -> str:
    """Hash of the code that answers, as it is."""
    return answers(SOURCE_ROOT)


def bank_code(root: Path, moves: dict[str, str] | None = None) -> str:
    entries = [one.split(":") for one in STATISTICS]
    moved = [f"{(moves or {}).get(module, module)}:{name}" for module, name in entries]
    return instruction_hash(moved, GAP, root, LEFT_OUT)


def answers(root: Path) -> str:
    return instruction_hash(ANSWERING, "scapulohumeral", root)


def file_of(root: Path, module: str) -> Path:
    return root.joinpath(*module.split(".")).with_suffix(".py")


def test_bank_survives_moves_of_its_modules(copied: Path, tmp_path: Path, bank_before: str) -> None:
    """Modules go into packages, and every import is written anew, some in another form."""
    root = tmp_path / "moved"
    shutil.copytree(copied, root)
    for old, new in MOVES.items():
        target = file_of(root, new)
        target.parent.mkdir(exist_ok=True)
        (target.parent / "__init__.py").touch()
        file_of(root, old).rename(target)
    for path in root.rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        for old, new in MOVES.items():
            text = re.sub(rf"\b{re.escape(old)}\b", new, text)
        path.write_text(text, encoding="utf-8")
    assert bank_code(root, MOVES) == bank_before


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("isolation.priors", "PAIRS = ", "PAIRS = 2.0 * "),
        (
            "effects.library",
            "    hand_load,\n    segment_mass,",
            "    segment_mass,\n    hand_load,",
        ),
        ("recording.case", "ORDERING_POINTS = ", "ORDERING_POINTS = 2 * "),
        ("effects.emd", "60.0,", "61.0,"),
        ("recording.movement_window", "CUTOFF_HZ = ", "CUTOFF_HZ = 2.0 * "),
        ("detection.presence", "ON_RECORD: 0.5", "ON_RECORD: 0.4"),
    ],
)
def test_bank_follows_what_thresholds_depend_on(
    edited: Edit, bank_before: str, module: str, old: str, new: str
) -> None:
    assert bank_code(edited(f"gap.{module}", old, new)) != bank_before


def test_bank_ignores_what_comes_after_thresholds(edited: Edit, bank_before: str) -> None:
    """Probabilities of causes are tuned without a new bank."""
    change = "UNPROVEN = ", "UNPROVEN = 0.9 * "
    assert bank_code(edited("gap.verdict.posterior", *change)) == bank_before


def test_code_that_answered_is_the_same(copied: Path, edited: Edit, answers_before: str) -> None:
    """After all of these changes: of the scorer, of words and of what is drawn."""
    for module, old, new in (
        # A comment of the scorer, and even what it does.
        ("gap.benchmark.score_card", "import", "# Scores.\nimport"),
        ("gap.benchmark.scored_case", "LARGE_MULTIPLE = ", "LARGE_MULTIPLE = 2 * "),
        ("gap.cli", "EXIT_CODES = ", "EXIT_CODES = ''"),
        ("gap.output.figures", "MOST_PANELS = 9", "MOST_PANELS = 8"),
        ("gap.verdict.posterior", "UNPROVEN = ", "# Doubt.\nUNPROVEN = "),
    ):
        edited(module, old, new)
    assert answers(copied) == answers_before


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("gap.verdict.posterior", "UNPROVEN = ", "UNPROVEN = 0.9 * "),
        ("gap.recording.trials", "SHORTEST_S = ", "SHORTEST_S = 2 * "),
        ("ocp.layout", "REACTION_UNIT_N = ", "REACTION_UNIT_N = 2 * "),
        ("model.opensim_model", "strict=True", "strict=False"),
    ],
)
def test_code_that_answered_is_another(
    edited: Edit, answers_before: str, module: str, old: str, new: str
) -> None:
    assert answers(edited(module, old, new)) != answers_before


def test_what_is_kept_is_what_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, answers_before: str
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert kept_instruction_hash(ANSWERING, "scapulohumeral") == answers_before
    [kept] = tmp_path.rglob("instructions/*")
    kept.write_text("kept", encoding="utf-8")
    assert kept_instruction_hash(ANSWERING, "scapulohumeral") == "kept"
    assert kept_instruction_hash(ANSWERING[:1], "scapulohumeral") != "kept"
