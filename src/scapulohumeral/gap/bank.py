"""The null bank: how far effect-free cases come toward the thresholds that are simulated for them.

Simulated thresholds know the noise of a case and what sessions are assumed to change, but not how
far a model that is wrong in detail leads the tests astray. The bank holds, for each effect-free
case of plants that differ from the model, both test values over their thresholds. The largest of
them, but for the share of false alarms allowed, multiplies all thresholds. Never below one: a bank
of gentle plants is no reason to believe more than the simulation does.
"""

from __future__ import annotations

import ast
import hashlib
import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path

from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.settings import GapSettings

SCHEMA = "null-bank/1"
# Without a bank that fits, thresholds are higher by this factor.
# ASSUME: a little more than any effect-free case of the banks built so far has needed, 1.30 with
# reference trials and 2.19 without.
UNCHECKED = {"reference": 1.5, "no_reference": 2.5}
# Modules that tests and thresholds are made by. Model and solver are left out: they move both
# sides of the ratio, and a bank that every edit of them made stale would never be there.
STATISTICS = (
    "attribute.py", "evidence.py", "floor.py", "forward.py", "gather.py", "habits.py", "locate.py",
    "movement.py", "observe.py", "pairs.py", "records.py", "signatures.py",
)  # fmt: skip
# Settings that neither tests nor thresholds read.
AFTERWARDS = ("short_list", "refits", "temperature", "null_bank")


@dataclass(frozen=True)
class NullCase:
    """One effect-free case.

    Attributes
    ----------
    mode : "reference" or "no_reference"; emg, contact : what is recorded beside motion
    max_t, glr : test values over their thresholds
    """

    mode: str
    emg: bool
    contact: bool
    max_t: float
    glr: float

    @property
    def largest(self) -> float:
        """Factor on both thresholds below which the case would have been a false alarm."""
        return max(self.max_t, self.glr)


@dataclass(frozen=True)
class NullBank:
    """Effect-free cases, and the hash of the code and settings that they were tested with."""

    hash: str
    cases: tuple[NullCase, ...]


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
    uncalibrated = "probabilities are not calibrated"
    mode_cases = [case for case in bank.cases if case.mode == mode] if bank else []
    with_emg = [case for case in mode_cases if case.emg == emg]
    alike = [case for case in with_emg if case.contact == contact]
    cases = (alike if (len(alike) + 1) * alpha >= 1.0 else with_emg) or mode_cases
    if not cases:
        return UNCHECKED[mode], (
            f"thresholds are simulated and raised by {UNCHECKED[mode]}, as no effect-free case of "
            f"this kind has checked them; {uncalibrated}"
        )
    ordered = sorted(case.largest for case in cases)
    rank = min(math.ceil((len(ordered) + 1) * (1.0 - alpha)), len(ordered))
    allowed = 100.0 * (len(ordered) + 1 - rank) / (len(ordered) + 1)
    return max(ordered[rank - 1], 1.0), (
        f"thresholds were checked on {len(ordered)} effect-free cases, which vouch for at most "
        f"{allowed:.0f} % false alarms; {uncalibrated}"
    )


def bank_hash(settings: GapSettings) -> str:
    """Hash of what the bank depends on: the statistics, the effects, and the settings.

    Settings of what follows the tests are left out.
    """
    tests = {k: v for k, v in vars(settings).items() if k not in AFTERWARDS}
    return hashlib.sha256((_code_hash() + repr(tests)).encode()).hexdigest()


@cache
def _code_hash() -> str:
    folder = Path(__file__).parent
    files = [*(folder / name for name in STATISTICS), *(folder / "effects").glob("*.py")]
    parts = [f"{file.name}\n{instructions(file.read_text(encoding='utf-8'))}" for file in files]
    return hashlib.sha256("\n".join(sorted(parts)).encode()).hexdigest()


def instructions(source: str) -> str:
    """Python source without comments, docstrings and layout: other words make no bank stale."""
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if not isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef):
            continue
        if ast.get_docstring(node) is not None:
            node.body = node.body[1:] or [ast.Pass()]
    return ast.unparse(tree)


def write_bank(path: Path, cases: Sequence[NullCase], settings: GapSettings) -> None:
    """Write a bank as a small table."""
    rows = ",\n  ".join(json.dumps(asdict(case)) for case in cases)
    head = f'{{"schema": "{SCHEMA}",\n "hash": "{bank_hash(settings)}",\n'
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'{head} "cases": [\n  {rows}\n ]}}\n', encoding="utf-8")


def read_bank(path: Path, settings: GapSettings) -> tuple[NullBank | None, str]:
    """The null bank and, if there is none that fits, the reason.

    Raises
    ------
    ConfigError                      the file is no bank
    """
    if not path.is_file():
        return None, "no null bank of effect-free cases"
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        bank = NullBank(document["hash"], tuple(NullCase(**row) for row in document["cases"]))
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path}: {error}; expected a null bank. Build it again.") from error
    if bank.hash != bank_hash(settings):
        return None, "the null bank was built with other code or settings and is not used"
    return bank, ""
