"""One diagnosis from files to files: read, build the model, diagnose, write the answer.

The input is refused before anything long runs. Whatever happens to a solve, ``result.json`` is
valid or absent, never half an answer or that of an earlier run.

What solves and draws is imported once the input is accepted: a refusal need not wait for it.
"""

from __future__ import annotations

import hashlib
import json
import logging
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scapulohumeral.configuration.check import read_simulator
from scapulohumeral.configuration.simulator import Simulator
from scapulohumeral.errors import REFUSED, ConfigError, DataError, ModelError, StoppedError
from scapulohumeral.gap.labels import CURVES
from scapulohumeral.gap.recording.case import Case, GapTrial, case_hash, make_case
from scapulohumeral.gap.recording.fit_together import (
    check_repeats,
    check_tasks,
    check_units,
    not_compared,
    unlike_envelopes,
    unlike_others,
)
from scapulohumeral.gap.recording.marks import unmeasured
from scapulohumeral.gap.recording.one_movement import aligned, stated
from scapulohumeral.gap.recording.participant_file import (
    ParticipantFile,
    by_file,
    check_groups,
    find_participant,
    read_participant_file,
)
from scapulohumeral.gap.recording.trials import check_entries, read_trials, trial_files
from scapulohumeral.gap.settings import (
    SETTINGS,
    VIEWS,
    GapSettings,
    View,
    read_diagnosis_config,
    read_settings,
    sections_read,
    with_problem_of,
)
from scapulohumeral.instructions import kept_instruction_hash
from scapulohumeral.laboratory.folders import check_kept, unwritable
from scapulohumeral.provenance import MODEL_TABLES

if TYPE_CHECKING:
    from scapulohumeral.gap.nominal.participant_model import ParticipantModel
    from scapulohumeral.gap.result import Diagnosis

ANSWERED, FAILED = 0, 3
RESULT, REPORT, LOG = "result.json", "report.html", "run.log"
COMMAND = "scapulohumeral.gap.cli"
# What makes an answer of files: not the command, the page or the benchmark.
ANSWERING = (
    "scapulohumeral.gap.settings:read_settings",
    "scapulohumeral.gap.run:read_case",
    "scapulohumeral.gap.nominal.participant_model:participant_model",
    "scapulohumeral.gap.nominal.simulator:simulating_model",
    "scapulohumeral.gap.nominal.opensim_process:build",
    "scapulohumeral.gap.pipeline:diagnose",
)
PACKAGE = "scapulohumeral"

Config = Mapping[str, Any]

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Request:
    """What the command was asked for; `participant` None: beside the test files.

    `config`: of the study, `settings`: of diagnoses. `view` says whether trials are compared with
    the tracked or the predicted motion, `simulated` whether they are simulations, `simulator` what
    made them, `one_movement` that both sides recorded the same movements.
    """

    tests: tuple[Path, ...]
    references: tuple[Path, ...]
    out: Path
    participant: Path | None
    config: Path
    cache: Path
    seed: int
    threads: int
    command: str
    view: View = "tracking"
    settings: Path = SETTINGS
    simulated: bool = False
    simulator: Path | None = None
    one_movement: bool = False


def run(request: Request) -> int:
    """Diagnose a case and write the answer into ``request.out``.

    Returns
    -------
    int      0: ``result.json`` holds an answer; 2: the input was refused and there is no
             ``result.json``; 3: a solve failed and ``result.json`` says so

    Raises
    ------
    ConfigError                      nothing can be written into the folder for the answer, or it
                                     holds files that no diagnosis wrote
    """
    _prepare(request)
    with _logging(request.out / LOG):
        log.info("%s", request.command)
        try:
            _check_options(request)
            whole = read_diagnosis_config(request.config, request.settings)
            simulator = None
            if request.simulator is not None:
                simulator = read_simulator(request.simulator)
                whole = with_problem_of(whole, simulator.variant)
            config = sections_read(whole, *VIEWS)
            # Contradictions are refused before a model is built.
            settings = read_settings(config, request.view, request.simulated)
            case = read_case(request, config)
            # Before minutes of solves, who sees a slip can stop and correct it.
            for remark in _remarks(case):
                log.warning("%s", remark)
            return _answer(request, case, config, simulator, settings)
        except (ConfigError, DataError, ModelError) as error:
            log.error("refused: %s", error)
            print(f"Refused: {error}", file=sys.stderr)
            return REFUSED


def read_case(request: Request, config: Config) -> Case:
    """Read and check all files of a case; records of one movement are put side by side.

    Raises
    ------
    ConfigError, DataError           names file, row, column, what was expected, and the remedy
    """
    masses = config["model"]["masses"]
    file = read_participant_file(request.participant or find_participant(request.tests), masses)
    check_groups(file.participant, MODEL_TABLES)
    (tests, notes), (references, skipped) = map(trial_files, (request.tests, request.references))
    notes += skipped
    described = [(file, references)] if request.participant else by_file(references, file, masses)
    test, reference = _read([(file, tests)], notes), _read(described, notes)
    case = make_case(file.participant, test, reference, request.seed, request.threads, notes)
    check_tasks(case)
    check_repeats(case)
    check_units(case)
    for note in case.notes:
        log.info("%s", note)
    if request.one_movement:
        return stated(case)
    return case if request.simulated else aligned(case)


def _read(
    described: Sequence[tuple[ParticipantFile, Sequence[Path]]], notes: list[str]
) -> list[GapTrial]:
    """Trials of one side, by the participant files that describe them; `notes` gets remarks."""
    trials = []
    for file, paths in described:
        notes += check_entries(file.path, file.trials, paths)
        read, ignored = read_trials(paths, file.trials, tuple(file.participant.emg_channels))
        trials += read
        notes += ignored
    return trials


def settings_hash(config: Config, settings: GapSettings) -> str:
    """Hash of all that an answer is made by beside code, model and trials.

    Weights of evidence count by their values, not by the name of their file.
    """
    whole = {
        "config": config,
        "view": settings.view,
        "simulated": settings.of_simulations,
        "weights": asdict(settings.weighing),
    }
    return hashlib.sha256(json.dumps(whole, sort_keys=True).encode()).hexdigest()


def _answer(
    request: Request,
    case: Case,
    config: Config,
    simulator: Simulator | None,
    settings: GapSettings,
) -> int:
    """Build the model, diagnose and write; a failed solve becomes a diagnosis that says so."""
    from scapulohumeral.gap.curve_files import check_curves
    from scapulohumeral.gap.nominal.participant_model import ModelSettings, participant_model
    from scapulohumeral.gap.nominal.simulator import simulating_model
    from scapulohumeral.gap.pipeline import diagnose
    from scapulohumeral.gap.result import to_json

    # Weights that cannot be read are refused before a model is built.
    settled = settings_hash(config, settings)
    model = None
    try:
        if simulator is None:
            model = participant_model(case, ModelSettings.of(config), request.cache)
        else:
            model = simulating_model(simulator)
        log.info("model %s", model.hash)
        diagnosis = diagnose(case, model, settings)
    except (ConfigError, DataError, ModelError, StoppedError):
        raise
    except Exception as error:
        # Also a defect of the program: whoever reads result.json learns that there is no verdict.
        diagnosis = _failed(case, error)
    diagnosis = _completed(diagnosis, case, model, settled)
    try:
        text = to_json(diagnosis)
        check_curves(diagnosis.curves)
    except DataError as error:
        diagnosis = _completed(_failed(case, error), case, model, settled)
        text = to_json(diagnosis)
    (request.out / RESULT).write_text(text, encoding="utf-8")
    _illustrate(diagnosis, request)
    log.info("status %s", diagnosis.status)
    return FAILED if diagnosis.status == "failed" else ANSWERED


@cache
def answering_code() -> str:
    """Hash of the instructions that make an answer: other words in the code change nothing."""
    return kept_instruction_hash(ANSWERING, PACKAGE)


def _failed(case: Case, error: Exception) -> Diagnosis:
    from scapulohumeral.gap.result import failed_diagnosis

    log.exception("failed")
    reason = f"{type(error).__name__}: {error}"
    print(f"Failed: {reason}. See {LOG}.", file=sys.stderr)
    return failed_diagnosis(case, reason)


def _completed(
    diagnosis: Diagnosis, case: Case, model: ParticipantModel | None, settled: str
) -> Diagnosis:
    """A diagnosis with the fields that follow from the case alone."""
    from scapulohumeral.gap.result import describe_inputs

    hashes = {
        "code": answering_code(),
        "config": settled,
        "model": None if model is None else model.hash,
        "inputs": case_hash(case),
        "null_bank": diagnosis.hashes.get("null_bank"),
    }
    return replace(
        diagnosis,
        mode=case.mode,
        inputs=describe_inputs(case),
        warnings=(*diagnosis.warnings, *_remarks(case)),
        hashes=hashes,
    )


def _remarks(case: Case) -> list[str]:
    """What is to be said of the trials themselves, a sentence each."""
    return [
        *not_compared(case),
        *unlike_others(case),
        *unlike_envelopes(case),
        *unmeasured(case.compared),
    ]


def _illustrate(diagnosis: Diagnosis, request: Request) -> None:
    """Write curves and page. The answer stands without them, so their defect is only reported."""
    from scapulohumeral.gap.curve_files import write_curves
    from scapulohumeral.gap.output.page import write_report

    try:
        write_curves(diagnosis.curves, request.out)
        write_report(diagnosis, request.command, request.out)
    except Exception as error:
        log.exception("no report")
        print(f"No {REPORT}: {error}. {RESULT} is complete; see {LOG}.", file=sys.stderr)


def _check_options(request: Request) -> None:
    """Refuse numbers and folders of the command that fail only after minutes of solving."""
    if request.simulator is not None and not (request.simulated and request.view == "prediction"):
        raise ConfigError(
            f"--simulator {request.simulator} says how scapula and clavicle of simulations are "
            "predicted; expected it with --simulated --view prediction. Add both, or leave it out."
        )
    if request.one_movement and request.simulated:
        raise ConfigError(
            "--one-movement with --simulated: simulations have no errors of measurement, which is "
            "all that two records of one movement differ by. Leave one of them out."
        )
    for option, value, least in (("--seed", request.seed, 0), ("--threads", request.threads, 1)):
        if value < least:
            raise ConfigError(f"{option} {value}; expected {least} or more. Raise it.")
    blocked = next(path for path in (request.cache, *request.cache.parents) if path.exists())
    if not blocked.is_dir():
        raise ConfigError(f"--cache: {blocked} is a file; expected a folder. Name another one.")


def _prepare(request: Request) -> None:
    """Make the folder for the answer, without that of an earlier run, which is not this one's.

    Only what a diagnosis wrote is removed: its log lies beside it.
    """
    out = request.out
    files = (out / RESULT, out / REPORT, *(out / CURVES).glob("*.csv"))
    earlier = [path for path in files if path.exists()]
    check_kept((*request.tests, *request.references), earlier)
    if earlier and not (out / LOG).is_file():
        raise ConfigError(
            f"--out {out}: holds {earlier[0].relative_to(out)} and no {LOG}, so it is not the "
            "folder of an earlier answer. Name another one."
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
        for path in earlier:
            path.unlink()
        (out / LOG).open("a").close()
    except OSError as error:
        raise unwritable(out, error) from error


@contextmanager
def _logging(path: Path) -> Iterator[None]:
    """Send the messages of the package to a file."""
    package = logging.getLogger("scapulohumeral")
    handler = logging.FileHandler(path, mode="w", encoding="utf-8")
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    level = package.level
    package.addHandler(handler)
    package.setLevel(logging.INFO)
    try:
        yield
    finally:
        package.removeHandler(handler)
        package.setLevel(level)
        handler.close()
