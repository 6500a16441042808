"""The blind benchmark: seal keys, answer cases, check every hash, score once.

Commit and reveal: whoever draws the cases publishes SHA-256(salt + key) of every key and a hash of
every case; whoever answers records hashes of the answers and of the code that made them; only then
are keys and salts opened, and a score counts only if all hashes agree. Whoever opens them is noted
before that, be it to score, to fit weights or to tell limits: a later score is labelled as such for
ever.

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
from functools import cache, partial
from pathlib import Path
from typing import Any

from scapulohumeral.configuration.check import STUDY
from scapulohumeral.errors import DataError
from scapulohumeral.gap.benchmark.open_keys import key_file, looks, now, opened_keys
from scapulohumeral.gap.benchmark.score_card import REGISTERED, score_card
from scapulohumeral.gap.benchmark.scored_case import HiddenGap, ScoredCase
from scapulohumeral.gap.parallel import side_by_side
from scapulohumeral.gap.run import (
    COMMAND,
    PACKAGE,
    RESULT,
    Request,
    answering_code,
    settings_hash,
)
from scapulohumeral.gap.settings import VIEWS, read_diagnosis_config, read_settings, sections_read
from scapulohumeral.instructions import kept_instruction_hash
from scapulohumeral.provenance import file_hash, files_below

SEAL_SCHEMA, ANSWER_SCHEMA, SCORE_SCHEMA = "blind-seal/1", "blind-answers/1", "blind-scores/1"
SALTS, ANSWERS = "salts.json", "answers.json"
SALT_BYTES = 32
# Gap on the hidden task before and after a candidate of an answer; None: unknown.
Shrinks = Callable[[ScoredCase, Mapping[str, Any]], HiddenGap | None]
# What makes a score card: `score`, and what it is given.
SCORING = (
    "scapulohumeral.gap.benchmark.protocol:score",
    "scapulohumeral.gap.benchmark.noise_free.hidden_task:hidden_shrinkage",
)
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
        name: {
            "key": _key_hash(key_file(keys, name).read_bytes(), salts[name]),
            "inputs": folder_hash(cases / name),
        }
        for name in names
    }
    _write(keys / SALTS, salts)
    document = {"schema": SEAL_SCHEMA, "date": now(), "known": known, "rules": REGISTERED}
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
    record: dict[str, Any] = {"schema": ANSWER_SCHEMA, "date": now(), **made_by, "cases": {}}
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
    DataError                        as :func:`opened_cases`
    """
    cases = opened_cases(files, keys, "scores")
    *before, _ = looks(keys)
    sealed = _read(files.published, SEAL_SCHEMA)
    record = _read(files.answers / ANSWERS, ANSWER_SCHEMA)
    if shrinks is not None:
        cases = side_by_side(partial(_with_hidden, shrinks=shrinks), [(c,) for c in cases], jobs)
    other_rules = _rules_since(sealed)
    card: dict[str, Any] = {
        "schema": SCORE_SCHEMA,
        "look": _look(len(before) + 1, sealed.get("known", False), bool(other_rules)),
        "earlier_looks": before,
        "sealed": {
            "date": sealed["date"],
            "hash": file_hash(files.published),
            "other_rules": other_rules,
        },
        "answered": _answered(record),
        "scored": {"date": now(), "cases": len(cases), "code": scoring_code()},
        **score_card(cases),
    }
    _write(out, card)
    return card


def _rules_since(sealed: Mapping[str, Any]) -> dict[str, Any]:
    """Rules as they were sealed, of those that scores are no longer made by; None: there was none.

    Scores are made by the present ones, which stand in the card as a whole.
    """
    rules = sealed.get("rules", {})
    names = sorted(rules.keys() | REGISTERED.keys())
    return {k: rules.get(k) for k in names if rules.get(k) != REGISTERED.get(k)}


@cache
def scoring_code() -> str:
    """Hash of the instructions that make a score card."""
    return kept_instruction_hash(SCORING, PACKAGE)


def _answered(record: Mapping[str, Any]) -> dict[str, Any]:
    return {"date": record["date"], "code": record["code"]}


def opened_cases(files: BlindFiles, keys: Path, why: str) -> list[ScoredCase]:
    """All cases with their answers and keys, once every hash agrees.

    Answers are checked before the keys are opened.

    Parameters
    ----------
    files : cases, published hashes, answers
    keys : folder of keys and salts; the look at them is noted there
    why : they are opened

    Raises
    ------
    DataError                        a key, answer or case does not fit its hash, or is missing;
                                     answers are to other cases, or of other code than recorded
    """
    sealed = _read(files.published, SEAL_SCHEMA)["cases"]
    record = _read(files.answers / ANSWERS, ANSWER_SCHEMA)
    # Records of earlier draws do not say.
    if record.get("sealed", file_hash(files.published)) != file_hash(files.published):
        raise DataError(
            f"{files.answers / ANSWERS}: answers to other cases than {files.published} has, or "
            "this was changed since; restore it, or name the answers to its cases."
        )
    documents = {name: _document(files, name, hashes, record) for name, hashes in sealed.items()}
    opened = opened_keys(keys, sorted(sealed), why, answered=_answered(record))
    salts = json.loads((keys / SALTS).read_text(encoding="utf-8"))
    cases = []
    for name, key in opened.items():
        if _key_hash(key, salts.get(name, "")) != sealed[name]["key"]:
            raise DataError(f"{keys / name}.json: not the key that was sealed; restore it.")
        folders = (files.cases / name, files.answers / name)
        seconds = record["cases"][name]["seconds"]
        cases.append(ScoredCase(*folders, json.loads(key), documents[name], seconds))
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


def _document(
    files: BlindFiles, name: str, sealed: Mapping[str, str], record: Mapping[str, Any]
) -> dict[str, Any] | None:
    """The answer to a case, None if there is none, once its hashes agree with the record."""
    if folder_hash(files.cases / name) != sealed["inputs"]:
        raise DataError(f"{files.cases / name}: changed after sealing; restore it.")
    entry = record["cases"].get(name)
    if entry is None:
        raise DataError(f"{files.answers}: no answer for case {name}; run `gap blind answer`.")
    if entry["result"] is None:
        return None
    result = files.answers / name / RESULT
    if not result.exists() or file_hash(result) != entry["result"]:
        raise DataError(f"{result}: not the answer that was recorded; restore it.")
    document: dict[str, Any] = json.loads(result.read_text(encoding="utf-8"))
    code = document.get("hashes", {}).get("code")
    if code != record["code"]:
        raise DataError(
            f"{result}: by code {code}; expected {record['code']}, which {ANSWERS} records. Code "
            "changed while cases were answered: answer them all by one, into another folder."
        )
    return document


def _look(number: int, known: bool, other_rules: bool) -> str:
    """What a score card is worth as evidence."""
    look = "first look" if number == 1 else f"look {number}: keys were open"
    if known:
        look = "open draw: its seed was known"
    return f"{look}; by other rules than were sealed" if other_rules else look


def _case_names(cases: Path) -> list[str]:
    names = sorted(path.name for path in cases.iterdir() if path.is_dir())
    if not names:
        raise DataError(f"{cases}: no case folders; draw cases first.")
    return names


def _key_hash(key: bytes, salt: str) -> str:
    return hashlib.sha256(bytes.fromhex(salt) + key).hexdigest()


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
