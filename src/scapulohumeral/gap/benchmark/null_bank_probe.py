"""Whether the null bank still says what the code says: some of its probes are computed again.

The hash of a bank tells that code has changed, not whether the change matters: names that change,
or a function that is split, leave every number as it was. Rows that agree show it.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from scapulohumeral.errors import ConfigError, DataError
from scapulohumeral.gap.detection.null_bank import NullBank, NullCase, Probe

# Largest difference of a ratio of test value to threshold: one part in a hundred, or half a
# hundredth of a threshold where ratios are small. Ratios of different cases differ by tenths;
# solvers and machines, by their last digits.
RELATIVE, ABSOLUTE = 0.01, 0.005

# Rows of a case folder, by the present code.
Computed = Callable[[Path], Probe]


@dataclass(frozen=True)
class Row:
    """A row of a probe as it is in the bank, and as it is now; `now` None: there is none."""

    case: str
    stored: NullCase
    now: NullCase | None

    @property
    def agrees(self) -> bool:
        """Whether all ratios are the same within the tolerance."""
        return self.now is not None and all(
            math.isclose(then, now, rel_tol=RELATIVE, abs_tol=ABSOLUTE)
            for then, now in zip(self.stored.ratios, self.now.ratios, strict=True)
        )

    def __str__(self) -> str:
        """One line for the reader."""
        kind = [self.stored.mode, *(["EMG"] if self.stored.emg else [])]
        kind += ["joint force"] if self.stored.contact else []
        then = _written(self.stored)
        now = "missing" if self.now is None else _written(self.now)
        return (
            f"{self.case}, {', '.join(kind)}: {then} in the bank, {now} now: "
            f"{'agrees' if self.agrees else 'DIFFERS'}"
        )


def _written(row: NullCase) -> str:
    return " ".join(f"{ratio:.4f}" for ratio in row.ratios)


def recomputed(
    bank: NullBank, number: int, cases: Path, computed: Computed, seed: int
) -> list[Row]:
    """Compute some probes of a bank again.

    Parameters
    ----------
    bank : whether its hash fits or not
    number : of probes to compute, chosen at random by `seed`
    cases : folder of their cases, drawn again
    computed : gives the rows of a case

    Raises
    ------
    ConfigError                      the bank has fewer probes
    DataError                        the case of a probe is not in the folder
    """
    if not 1 <= number <= len(bank.probes):
        raise ConfigError(
            f"--recompute {number}: the bank has {len(bank.probes)} probes; expected at most as "
            "many, and one at least. `gap bank probe` adds some while the bank fits."
        )
    rows: list[Row] = []
    for probe in random.Random(seed).sample(bank.probes, number):
        folder = cases / probe.case
        if not folder.is_dir():
            raise DataError(
                f"{cases}: no case {probe.case}, a probe of the bank. Draw the probes again, by "
                "the same generator and seed: `snakemake --cores 2 results/gap/bank/probes`."
            )
        rows += _compared(probe, computed(folder))
    return rows


def _compared(stored: Probe, now: Probe) -> Sequence[Row]:
    found = {(row.mode, row.emg, row.contact): row for row in now.rows}
    return [
        Row(stored.case, row, found.get((row.mode, row.emg, row.contact))) for row in stored.rows
    ]
