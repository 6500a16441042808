"""The blind benchmark: seal keys, answer cases, check every hash, score once.

Commit and reveal: whoever draws the cases publishes SHA-256(salt + key) of every key and a hash of
every case; whoever answers records hashes of the answers and of the code that made them; only then
are keys and salts opened, and a score counts only if all hashes agree. A second scoring of the
same answers, or of new ones, is labelled as such for ever.

The keys lie in a folder that the one who draws names, outside of the checkout. Answering takes no
such folder, and each diagnosis runs as a process of its own that is given the trials of one case.
"""

from __future__ import annotations

import hashlib
import json
import secrets
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from scapulohumeral.configuration.check import STUDY
from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.score_card import REGISTERED, score_card
from scapulohumeral.gap.benchmark.scored_case import HiddenGap, ScoredCase
from scapulohumeral.gap.parallel import side_by_side
from scapulohumeral.gap.run import COMMAND, RESULT, Request, answering_code, settings_hash
from scapulohumeral.gap.settings import VIEWS, read_diagnosis_config, read_settings, sections_read
from scapulohumeral.provenance import file_hash, files_below

SEAL_SCHEMA, ANSWER_SCHEMA, SCORE_SCHEMA = "blind-seal/1", "blind-answers/1", "blind-scores/1"
SALTS, LOOKS, ANSWERS = "salts.json", "looks.json", "answers.json"
SALT_BYTES = 32
# Gap on the hidden task before and after a candidate of an answer; None: unknown.
Shrinks = Callable[[ScoredCase, Mapping[str, Any]], HiddenGap | None]
DIAGNOSE = (sys.executable, "-m", COMMAND, "gap", "diagnose")


@dataclass(frozen=True)
class BlindFiles:
    """Where a benchmark lies.

    Attributes
    ----------
    cases : folder of case folders
    published : file of hashes, public from the start
    answers : folder of answer folders, one per case
    """

    cases: Path
    published: Path
    answers: Path


def seal(cases: Path, keys: Path, published: Path, known: bool = False) -> None:
    """Draw a salt for each key and publish the hashes of salted keys and of case folders.

    Parameters
    ----------
    cases : folder of case folders; keys : folder of ``CASE.json``; salts are written there too
    published : new file of hashes, with the rules that scores will be made by
    known : whether the seed is known, as that of cases to calibrate with; score cards say so

    Raises
    ------
    DataError                        already sealed, or a case without a key
    """
    for path in (published, keys / SALTS):
        if path.exists():
            raise DataError(
                f"{path}: there already; keys are sealed once. Draw new cases into new folders."
            )
    names = _case_names(cases)
    salts = {name: secrets.token_hex(SALT_BYTES) for name in names}
    hashes = {
        name: {"key": _key_hash(keys, name, salts[name]), "inputs": folder_hash(cases / name)}
        for name in names
    }
    _write(keys / SALTS, salts)
    document = {"schema": SEAL_SCHEMA, "date": _today(), "known": known, "rules": REGISTERED}
    _write(published, document | {"cases": hashes})


def answer(files: BlindFiles, jobs: int, command: Sequence[str] = DIAGNOSE) -> None:
    """Diagnose every sealed case and record hashes of answers and code.

    Cases that are answered already are skipped, so an interrupted run goes on.

    Parameters
    ----------
    files : cases, published hashes, folder for answers
    jobs : diagnoses at a time, each on one thread
    command : what is run on a case; ends before the names of trials

    Raises
    ------
    DataError                        a case changed after sealing, or other code, settings or
                                     weights answered before, or answers are to other cases
    """
    sealed = _read(files.published, SEAL_SCHEMA)["cases"]
    made_by = {
        "code": answering_code(),
        "settings": _settings(),
        "sealed": file_hash(files.published),
    }
    record_file = files.answers / ANSWERS
    record: dict[str, Any] = {"schema": ANSWER_SCHEMA, "date": _today(), **made_by, "cases": {}}
    if record_file.exists():
        record = _read(record_file, ANSWER_SCHEMA)
    if any(record.get(key) != value for key, value in made_by.items()):
        raise DataError(
            f"{record_file}: answers of other code, settings or weights, or to other cases, are "
            "here. Name another folder of answers; it will count as a second look if keys were "
            "opened in between."
        )
    open_cases = [name for name in sorted(sealed) if name not in record["cases"]]
    for name in open_cases:
        if folder_hash(files.cases / name) != sealed[name]["inputs"]:
            raise DataError(f"{files.cases / name}: changed after sealing; restore it.")
    with ThreadPoolExecutor(jobs) as pool:
        tasks = (
            pool.submit(_diagnose, files.cases / name, files.answers / name, command)
            for name in open_cases
        )
        for name, task in zip(open_cases, list(tasks), strict=True):
            record["cases"][name] = task.result()
            _write(record_file, record)
            print(f"{name}: exit code {record['cases'][name]['exit_code']}", flush=True)


def _settings() -> str:
    """Hash of settings and weights that a diagnosis has unless others are named."""
    config = sections_read(read_diagnosis_config(STUDY), *VIEWS)
    return settings_hash(config, read_settings(config))


def score(
    files: BlindFiles, keys: Path, out: Path, shrinks: Shrinks | None = None, jobs: int = 1
) -> dict[str, Any]:
    """Check all hashes, open the keys, and write the score card.

    Parameters
    ----------
    files : cases, published hashes, answers
    keys : folder of keys and salts; every look at them is noted there
    out : ``scores.json``
    shrinks : gap on the hidden task before and after a candidate of an answer; asked for singles.
        Without it shrinkage is not compared with a truth
    jobs : processes that ask for it

    Raises
    ------
    DataError                        a key, answer or case does not fit its hash, or is missing
    """
    cases = opened_cases(files, keys)
    sealed = _read(files.published, SEAL_SCHEMA)
    record = _read(files.answers / ANSWERS, ANSWER_SCHEMA)
    if shrinks is not None:
        cases = side_by_side(partial(_with_hidden, shrinks=shrinks), [(c,) for c in cases], jobs)
    before = _looks(keys)
    card: dict[str, Any] = {
        "schema": SCORE_SCHEMA,
        "look": _look(len(before) + 1, sealed.get("known", False)),
        "earlier_looks": before,
        "sealed": {"date": sealed["date"], "hash": file_hash(files.published)},
        "answered": {"date": record["date"], "code": record["code"]},
        "scored": {"date": _today(), "cases": len(cases)},
        **score_card(cases),
    }
    _write(out, card)
    look = {"answered": card["answered"], "scored": card["scored"]}
    (keys / LOOKS).write_text(json.dumps([*before, look], indent=1) + "\n", encoding="utf-8")
    return card


def opened_cases(files: BlindFiles, keys: Path) -> list[ScoredCase]:
    """All cases with their answers and keys, once every hash agrees.

    Raises
    ------
    DataError                        a key, answer or case does not fit its hash, or is missing
    """
    sealed = _read(files.published, SEAL_SCHEMA)["cases"]
    record = _read(files.answers / ANSWERS, ANSWER_SCHEMA)
    salts = json.loads((keys / SALTS).read_text(encoding="utf-8"))
    cases = []
    for name, hashes in sorted(sealed.items()):
        if _key_hash(keys, name, salts.get(name, "")) != hashes["key"]:
            raise DataError(f"{keys / name}.json: not the key that was sealed; restore it.")
        if folder_hash(files.cases / name) != hashes["inputs"]:
            raise DataError(f"{files.cases / name}: changed after sealing; restore it.")
        cases.append(_scored_case(files, keys, name, record))
    return cases


def folder_hash(folder: Path) -> str:
    """SHA-256 over names and contents of all files below a folder."""
    digest = hashlib.sha256()
    for path in files_below(folder):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(folder).as_posix()}:{len(content)}:".encode())
        digest.update(content)
    return digest.hexdigest()


def _diagnose(case: Path, out: Path, command: Sequence[str]) -> dict[str, Any]:
    """Run the command on one case; its record."""
    arguments = [*command, *map(str, trial_tables(case / "test"))]
    references = trial_tables(case / "reference")
    if references:
        arguments += ["--reference", *map(str, references)]
    arguments += ["--participant", str(case / "participant.yaml"), "--out", str(out)]
    arguments += ["--threads", "1"]
    out.mkdir(parents=True, exist_ok=True)
    start = time.perf_counter()
    with (out / "console.log").open("w", encoding="utf-8") as console:
        done = subprocess.run(arguments, stdout=console, stderr=subprocess.STDOUT, check=False)
    result = out / RESULT
    return {
        "exit_code": done.returncode,
        "seconds": round(time.perf_counter() - start, 1),
        "result": file_hash(result) if result.exists() else None,
    }


def trial_tables(folder: Path) -> list[Path]:
    """Trial files of a folder; companions are found by the diagnosis itself."""
    return sorted(p for p in folder.glob("*.csv") if not p.stem.endswith(("_emg", "_force")))


def _with_hidden(case: ScoredCase, shrinks: Shrinks) -> ScoredCase:
    """A single with what its answer and the injected effect remove of the hidden gap."""
    if case.status != "single" or case.verdict is None:
        return case
    [best, *_] = case.verdict["candidates"]
    oracle = case.true_candidate
    removed = None if oracle is None else shrinks(case, oracle)
    if oracle is not None and best["label"] == oracle["label"]:
        return replace(case, hidden=removed, oracle=removed)
    claimed = shrinks(case, best) if case.right_single and case.claims_gap else None
    return replace(case, hidden=claimed, oracle=removed)


def folder_request(folder: Path, config: Path, cache: Path) -> Request:
    """How the trials of a case folder are read and its model is made."""
    return Request(
        tests=tuple(trial_tables(folder / "test")),
        references=tuple(trial_tables(folder / "reference")),
        out=cache,
        participant=folder / "participant.yaml",
        config=config,
        cache=cache,
        seed=1,
        threads=1,
        command="",
    )


def _scored_case(files: BlindFiles, keys: Path, name: str, record: dict) -> ScoredCase:
    entry = record["cases"].get(name)
    if entry is None:
        raise DataError(f"{files.answers}: no answer for case {name}; run `gap blind answer`.")
    result = files.answers / name / RESULT
    document = None
    if entry["result"] is not None:
        if not result.exists() or file_hash(result) != entry["result"]:
            raise DataError(f"{result}: not the answer that was recorded; restore it.")
        document = json.loads(result.read_text(encoding="utf-8"))
    key = json.loads((keys / f"{name}.json").read_text(encoding="utf-8"))
    folders = (files.cases / name, files.answers / name)
    return ScoredCase(*folders, key, document, entry["seconds"])


def _look(number: int, known: bool) -> str:
    """What a score card is worth as evidence."""
    if known:
        return "open draw: its seed was known"
    return "first look" if number == 1 else f"look {number}: keys were open"


def _looks(keys: Path) -> list[dict[str, Any]]:
    """Who opened the keys before. It is noted beside them, because score cards can be deleted."""
    path = keys / LOOKS
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else []


def _case_names(cases: Path) -> list[str]:
    names = sorted(path.name for path in cases.iterdir() if path.is_dir())
    if not names:
        raise DataError(f"{cases}: no case folders; draw cases first.")
    return names


def _key_hash(keys: Path, name: str, salt: str) -> str:
    path = keys / f"{name}.json"
    if not path.is_file():
        raise DataError(f"{path}: missing; expected the key of case {name}.")
    return hashlib.sha256(bytes.fromhex(salt) + path.read_bytes()).hexdigest()


def _read(path: Path, schema: str) -> dict[str, Any]:
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, json.JSONDecodeError) as error:
        raise DataError(f"{path}: {error}; expected a document '{schema}'.") from error
    if document.get("schema") != schema:
        raise DataError(f"{path}: schema {document.get('schema')!r}; expected '{schema}'.")
    return document


def _write(path: Path, document: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


def _today() -> str:
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
