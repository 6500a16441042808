"""The null bank: how far effect-free cases come toward the thresholds that are simulated for them.

Simulated thresholds know the noise of a case and what sessions are assumed to change, but not how
far a model that is wrong in detail leads the tests astray. The bank holds, for each effect-free
case of plants that differ from the model, all test values over their thresholds. The largest of
them, but for the share of false alarms allowed, multiplies all thresholds. Never below one: a bank
of gentle plants is no reason to believe more than the simulation does.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.settings import GapSettings
from scapulohumeral.instructions import kept_instruction_hash
from scapulohumeral.provenance import CONFIG_FOLDER

SCHEMA = "null-bank/3"
# Without a bank that fits, simulated thresholds stay as they are: no effect-free case of the
# present bank comes nearer to its own than 0.6 of it with reference trials, and 0.85 without.
# Simulated thresholds hold the scatter of real repeats.
UNCHECKED = 1.0
# What tests and thresholds are computed by: rows of a case, the order of its trials, and what of a
# trial is looked at.
STATISTICS = (
    "scapulohumeral.gap.benchmark.null_bank_build:null_cases",
    "scapulohumeral.gap.recording.case:make_case",
    "scapulohumeral.gap.recording.movement_window:movement_window",
    "scapulohumeral.gap.recording.movement_window:smoothed",
)
PACKAGE = "scapulohumeral.gap"
# Model and solver, outside of the package or handed in, move both sides of the ratio, and a bank
# that every edit of them made stale would never be there. Values of settings are hashed themselves.
LEFT_OUT = ("scapulohumeral.gap.nominal.participant_model", "scapulohumeral.gap.settings")
# Settings that neither tests nor thresholds read.
AFTERWARDS = ("short_list", "refits", "calibration", "null_bank")


@dataclass(frozen=True)
class NullCase:
    """One effect-free case.

    Attributes
    ----------
    mode : "reference" or "no_reference"; emg, contact : what is recorded beside motion
    max_t, glr, on_record : test values over their thresholds
    """

    mode: str
    emg: bool
    contact: bool
    max_t: float
    glr: float
    on_record: float

    @property
    def ratios(self) -> tuple[float, ...]:
        """All test values over their thresholds."""
        return self.max_t, self.glr, self.on_record

    @property
    def largest(self) -> float:
        """Factor on all thresholds below which the case would have been a false alarm."""
        return max(self.ratios)


@dataclass(frozen=True)
class Probe:
    """Rows of one effect-free case with a model of its own, to be computed again at any time.

    They vouch for the code, not for thresholds, and are not counted among the cases.
    """

    case: str
    rows: tuple[NullCase, ...]


@dataclass(frozen=True)
class NullBank:
    """Effect-free cases, and the hash of the code and settings that they were tested with."""

    hash: str
    cases: tuple[NullCase, ...]
    probes: tuple[Probe, ...] = ()


def inflation(
    bank: NullBank | None, mode: str, emg: bool, contact: bool, alpha: float
) -> tuple[float, str]:
    """Factor on simulated thresholds for cases of a kind, and what to say about it.

    Parameters
    ----------
    bank : None without one that fits
    mode, emg, contact : kind of the case. With too few cases of the kind to vouch for `alpha`, all
        with as much EMG count, with none of these all of the mode
    alpha : false alarms allowed
    """
    mode_cases = [case for case in bank.cases if case.mode == mode] if bank else []
    with_emg = [case for case in mode_cases if case.emg == emg]
    alike = [case for case in with_emg if case.contact == contact]
    cases = (alike if (len(alike) + 1) * alpha >= 1.0 else with_emg) or mode_cases
    if not cases:
        return UNCHECKED, (
            "thresholds are simulated: no effect-free case of this kind has checked them"
        )
    ordered = sorted(case.largest for case in cases)
    rank = min(math.ceil((len(ordered) + 1) * (1.0 - alpha)), len(ordered))
    allowed = 100.0 * (len(ordered) + 1 - rank) / (len(ordered) + 1)
    return max(ordered[rank - 1], 1.0), (
        f"thresholds were checked on {len(ordered)} effect-free cases, which vouch for at most "
        f"{allowed:.0f} % false alarms"
    )


def bank_file(settings: GapSettings) -> Path:
    """File of the bank, wherever the configuration that names it lies."""
    return CONFIG_FOLDER / settings.null_bank


def bank_hash(settings: GapSettings) -> str:
    """Hash of what the bank depends on: tests, thresholds and effects, and the settings.

    Settings of what follows the tests are left out. Whole numbers count as real ones.
    """
    tests = {k: _real(v) for k, v in asdict(settings).items() if k not in AFTERWARDS}
    return hashlib.sha256((code_hash() + json.dumps(tests, sort_keys=True)).encode()).hexdigest()


@cache
def code_hash() -> str:
    """Hash of the instructions that a bank is made by."""
    return kept_instruction_hash(STATISTICS, PACKAGE, without=LEFT_OUT)


def _real(value: Any) -> Any:
    """A setting with real numbers in place of whole ones, and lists in place of tuples."""
    if isinstance(value, Mapping):
        return {key: _real(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_real(one) for one in value]
    return float(value) if isinstance(value, int) and not isinstance(value, bool) else value


def write_bank(
    path: Path, cases: Sequence[NullCase], settings: GapSettings, probes: Sequence[Probe] = ()
) -> None:
    """Write a bank as a small table, stamped with the hash of the present code and settings."""
    named = [{"case": probe.case, **asdict(row)} for probe in probes for row in probe.rows]
    tables = {"cases": [asdict(case) for case in cases], "probes": named}
    blocks = (
        f' "{name}": [\n  ' + ",\n  ".join(map(json.dumps, rows)) + "\n ]"
        for name, rows in tables.items()
    )
    head = f'{{"schema": "{SCHEMA}",\n "hash": "{bank_hash(settings)}",\n'
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(head + ",\n".join(blocks) + "}\n", encoding="utf-8")


def read_bank(path: Path, settings: GapSettings) -> tuple[NullBank | None, str]:
    """The null bank and, if there is none that fits, the reason.

    Raises
    ------
    ConfigError                      the file is no bank
    """
    if not path.is_file():
        return None, f"no null bank of effect-free cases: {path.name} is not there"
    bank = load_bank(path)
    if bank.hash != bank_hash(settings):
        return None, "the null bank was built with other code or settings and is not used"
    return bank, ""


def load_bank(path: Path) -> NullBank:
    """A null bank, whether it fits or not.

    Raises
    ------
    ConfigError                      the file is no bank
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != SCHEMA:
            raise ValueError(f"schema {document['schema']}, expected {SCHEMA}")
        cases = tuple(NullCase(**row) for row in document["cases"])
        probes: dict[str, list[NullCase]] = {}
        for row in document["probes"]:
            probes.setdefault(row.pop("case"), []).append(NullCase(**row))
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: {error}; expected a null bank. Build it again.") from error
    named = tuple(Probe(case, tuple(rows)) for case, rows in probes.items())
    return NullBank(document["hash"], cases, named)
