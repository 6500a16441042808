"""Sealing, answering and scoring, with a command that answers without diagnosing."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from scapulohumeral import provenance
from scapulohumeral.errors import DataError
from scapulohumeral.gap import cli
from scapulohumeral.gap.benchmark import protocol
from scapulohumeral.gap.benchmark.by_derivatives.limits import limits
from scapulohumeral.gap.benchmark.open_draws.open_cases import read_scored_cases
from scapulohumeral.gap.benchmark.open_keys import looks
from scapulohumeral.gap.benchmark.protocol import SALTS, BlindFiles, answer, score, seal
from scapulohumeral.gap.benchmark.score_card import REGISTERED
from scapulohumeral.gap.run import answering_code

pytestmark = pytest.mark.unit

NO_GAP_ANSWER = {
    "status": "ok",
    "gap": {"present": False},
    "candidates": [],
    "none_p": 0.1,
    "no_gap_p": 0.9,
    "set90": ["no_gap"],
    "classes": [],
    "regions": {"shows": [], "enters": []},
    "shrinkage": None,
    "hashes": {"code": answering_code()},
}
# Stands for `gap diagnose`: writes the same answer for every case.
WRITER = """
import json, sys
from pathlib import Path
out = Path(sys.argv[sys.argv.index("--out") + 1])
(out / "result.json").write_text({answer!r})
"""


def write_key(path: Path, name: str) -> None:
    key = {
        "case": name,
        "plant": "P1",
        "kind": "null",
        "mode": {"emg": False, "reference": False},
        "effects": [],
        "channels": ["SC_rx"],
        "footprint": {"SC_rx": 0.0},
        "shown": False,
        "change_sigma": {},
    }
    path.write_text(json.dumps(key))


@pytest.fixture
def files(tmp_path: Path) -> BlindFiles:
    """Two null cases with keys in a folder of their own."""
    (tmp_path / "keys").mkdir()
    for name in ("a1", "b2"):
        case = tmp_path / "cases" / name
        (case / "test").mkdir(parents=True)
        (case / "participant.yaml").write_text("schema: participant/1\n")
        (case / "test" / "frontal_r1.csv").write_text("time\n0\n")
        write_key(tmp_path / "keys" / f"{name}.json", name)
    return BlindFiles(tmp_path / "cases", tmp_path / "published.json", tmp_path / "answers")


def command(files: BlindFiles) -> tuple[str, ...]:
    script = files.answers.parent / "writer.py"
    script.write_text(WRITER.format(answer=json.dumps(NO_GAP_ANSWER)))
    return (sys.executable, str(script))


def keys(files: BlindFiles) -> Path:
    return files.cases.parent / "keys"


@pytest.fixture
def answered(files: BlindFiles) -> BlindFiles:
    """The same, sealed and answered."""
    seal(files.cases, keys(files), files.published)
    answer(files, 1, command(files))
    return files


def test_honest_answers_are_scored(
    answered: BlindFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scapulohumeral.gap.benchmark.scored_case.baseline_families", lambda *_: {})
    card = score(answered, keys(answered), tmp_path / "scores.json")
    assert card["look"] == "first look"
    assert card["plants"]["P1"]["all"]["false_alarms"]["value"] == 0.0
    (tmp_path / "scores.json").unlink()
    again = score(answered, keys(answered), tmp_path / "scores.json")
    assert again["look"].startswith("look 2")
    assert len(again["earlier_looks"]) == 1
    assert again["earlier_looks"][0]["answered"] == card["answered"]
    assert card["scored"]["code"] == protocol.scoring_code() != card["answered"]["code"]
    assert card["sealed"]["other_rules"] == {}


@pytest.fixture
def no_baselines(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cases here have no trials that a baseline could read."""
    monkeypatch.setattr("scapulohumeral.gap.benchmark.scored_case.baseline_families", lambda *_: {})


def places(files: BlindFiles) -> dict[str, str]:
    """Where a draw lies, as weights are fitted to it."""
    folders = {name: str(getattr(files, name)) for name in ("cases", "published", "answers")}
    return {**folders, "keys": str(keys(files))}


@pytest.mark.usefixtures("no_baselines")
@pytest.mark.parametrize("way", ["weights", "limits", "scores that fail"])
def test_whoever_opened_keys_leaves_a_look(
    answered: BlindFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    """The look is noted before the first key is read, whatever comes of it."""
    if way == "weights":
        read_scored_cases({"one": places(answered)})
    elif way == "limits":
        with pytest.raises(DataError, match="'noise_free' is missing"):
            limits(answered.cases, keys(answered), tmp_path / "none.yaml", tmp_path)
    else:
        with monkeypatch.context() as broken:
            broken.setattr(protocol, "score_card", lambda _: 1 / 0)
            with pytest.raises(ZeroDivisionError):
                score(answered, keys(answered), tmp_path / "scores.json")
    card = score(answered, keys(answered), tmp_path / "scores.json")
    assert card["look"] == "look 2: keys were open"
    assert card["earlier_looks"][0]["opened"]["date"] <= card["scored"]["date"]


@pytest.mark.usefixtures("no_baselines")
def test_looks_of_earlier_drafts_count(answered: BlindFiles, tmp_path: Path) -> None:
    early = [{"answered": {"date": "2026-11-21"}, "scored": {"date": "2026-11-21", "cases": 2}}]
    (keys(answered) / "looks.json").write_text(json.dumps(early))
    card = score(answered, keys(answered), tmp_path / "scores.json")
    assert card["look"].startswith("look 2")
    assert card["earlier_looks"] == early
    assert looks(keys(answered))[:1] == early


def test_no_look_is_noted_where_answers_are_refused(answered: BlindFiles, tmp_path: Path) -> None:
    (answered.answers / "a1" / "result.json").unlink()
    with pytest.raises(DataError, match="not the answer that was recorded"):
        score(answered, keys(answered), tmp_path / "scores.json")
    assert looks(keys(answered)) == []


def test_answers_to_another_sealed_file_are_refused(answered: BlindFiles, tmp_path: Path) -> None:
    sealed = json.loads(answered.published.read_text())
    answered.published.write_text(json.dumps(sealed | {"date": "2020-01-01T00:00:00Z"}))
    with pytest.raises(DataError, match="answers to other cases"):
        score(answered, keys(answered), tmp_path / "scores.json")


def test_an_answer_by_other_code_than_is_recorded_is_refused(
    files: BlindFiles, tmp_path: Path
) -> None:
    seal(files.cases, keys(files), files.published)
    script = tmp_path / "writer.py"
    other = {**NO_GAP_ANSWER, "hashes": {"code": "0" * 64}}
    script.write_text(WRITER.format(answer=json.dumps(other)))
    answer(files, 1, (sys.executable, str(script)))
    with pytest.raises(DataError, match="by code 0000"):
        score(files, keys(files), tmp_path / "scores.json")


@pytest.mark.usefixtures("no_baselines")
def test_a_card_says_which_rules_are_others_than_were_sealed(
    files: BlindFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    early = {**REGISTERED, "sure": 0.7, "gone": "a rule that was dropped"}
    del early["set90"]
    with monkeypatch.context() as before:
        before.setattr(protocol, "REGISTERED", early)
        seal(files.cases, keys(files), files.published)
    answer(files, 1, command(files))
    card = score(files, keys(files), tmp_path / "scores.json")
    assert card["look"] == "first look; by other rules than were sealed"
    assert card["sealed"]["other_rules"] == {"gone": early["gone"], "set90": None, "sure": 0.7}
    assert card["rules"]["sure"] == REGISTERED["sure"]


def test_a_draw_whose_seed_was_known_is_never_called_a_first_look(
    files: BlindFiles, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scapulohumeral.gap.benchmark.scored_case.baseline_families", lambda *_: {})
    seal(files.cases, keys(files), files.published, known=True)
    answer(files, 1, command(files))
    card = score(files, keys(files), tmp_path / "scores.json")
    assert card["look"] == "open draw: its seed was known"


def test_published_file_does_not_give_keys_away(answered: BlindFiles) -> None:
    """A key has few possible contents: without a salt its hash could be guessed."""
    published = json.loads(answered.published.read_text())["cases"]
    assert published["a1"]["key"] != published["b2"]["key"]
    unsalted = provenance.input_hash([keys(answered) / "a1.json"])
    assert unsalted not in answered.published.read_text()


def test_changed_key_is_refused(answered: BlindFiles, tmp_path: Path) -> None:
    path = keys(answered) / "a1.json"
    path.write_text(path.read_text().replace("null", "single"))
    with pytest.raises(DataError, match=r"a1\.json: not the key that was sealed"):
        score(answered, keys(answered), tmp_path / "scores.json")
    assert len(looks(keys(answered))) == 1


def test_changed_answer_is_refused(answered: BlindFiles, tmp_path: Path) -> None:
    path = answered.answers / "b2" / "result.json"
    path.write_text(path.read_text().replace("0.9", "0.8"))
    with pytest.raises(DataError, match="not the answer that was recorded"):
        score(answered, keys(answered), tmp_path / "scores.json")


def test_changed_case_is_refused(files: BlindFiles) -> None:
    seal(files.cases, keys(files), files.published)
    (files.cases / "a1" / "test" / "frontal_r1.csv").write_text("time\n1\n")
    with pytest.raises(DataError, match="changed after sealing"):
        answer(files, 1, command(files))


def test_keys_are_sealed_once(answered: BlindFiles) -> None:
    with pytest.raises(DataError, match="sealed once"):
        seal(answered.cases, keys(answered), answered.published)


def test_the_command_refuses_in_one_line(answered: BlindFiles, capsys) -> None:
    folders = ("--cases", answered.cases, "--keys", keys(answered))
    arguments = (*folders, "--published", answered.published)
    assert cli.main(["gap", "blind", "seal", *map(str, arguments)]) == 2
    assert capsys.readouterr().err.startswith(f"Refused: {answered.published}: there already")


def test_answers_of_other_code_are_refused(answered: BlindFiles) -> None:
    record = answered.answers / "answers.json"
    record.write_text(record.read_text().replace('"code": "', '"code": "0'))
    with pytest.raises(DataError, match="other code"):
        answer(answered, 1, command(answered))


def test_answers_to_an_earlier_draw_of_the_same_names_are_refused(files: BlindFiles) -> None:
    seal(files.cases, keys(files), files.published)
    answer(files, 1, command(files))
    files.published.unlink()
    (keys(files) / SALTS).unlink()
    (files.cases / "a1" / "test" / "frontal_r1.csv").write_text("time\n1\n")
    seal(files.cases, keys(files), files.published)
    with pytest.raises(DataError, match="or to other cases"):
        answer(files, 1, command(files))


def test_a_case_without_result_counts_as_unanswered(files: BlindFiles, tmp_path: Path) -> None:
    seal(files.cases, keys(files), files.published)
    answer(files, 1, (sys.executable, "-c", "raise SystemExit(3)"))
    card = score(files, keys(files), tmp_path / "scores.json")
    assert card["plants"]["P1"]["all"]["abstention"]["value"] == 1.0


AUDIT = """
import sys
from pathlib import Path
from scapulohumeral.gap.benchmark.protocol import BlindFiles, answer
opened = []
sys.addaudithook(lambda event, args: opened.append(str(args[0])) if event in
                 ("open", "os.listdir", "os.scandir") and args else None)
folder = Path(sys.argv[1])
answer(BlindFiles(folder / "cases", folder / "published.json", folder / "answers"), 1,
       (sys.executable, sys.argv[2]))
print(any(str(folder / "keys") in name for name in opened),
      any(str(folder / "cases") in name for name in opened))
"""


def test_answering_never_opens_the_keys(files: BlindFiles) -> None:
    """Every file that the process opens is heard; cases are among them, keys are not."""
    seal(files.cases, keys(files), files.published)
    script = command(files)[1]
    arguments = [sys.executable, "-c", AUDIT, str(files.cases.parent), script]
    done = subprocess.run(arguments, capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "False True"


def test_a_diagnosis_is_given_one_case_and_no_keys(files: BlindFiles) -> None:
    seal(files.cases, keys(files), files.published)
    spy = files.answers.parent / "spy.py"
    spy.write_text("import sys\nprint(sys.argv[1:])\n")
    answer(files, 1, (sys.executable, str(spy)))
    for name, other in (("a1", "b2"), ("b2", "a1")):
        said = (files.answers / name / "console.log").read_text()
        assert str(files.cases / name) in said
        assert str(files.cases / other) not in said
        assert str(keys(files)) not in said


def test_what_diagnoses_knows_neither_benchmark_nor_plants() -> None:
    modules = provenance.code_of("scapulohumeral.gap.run")
    assert not [path for path in modules if path.parent.name == "benchmark"]
    for path in (provenance.SOURCE_ROOT / "scapulohumeral").rglob("*.py"):
        module = ".".join(path.relative_to(provenance.SOURCE_ROOT).with_suffix("").parts)
        names = {name.split(".")[0] for name in provenance.imported_names(path, module)}
        assert not names & {"simulated_persons", "tests"}, path
