"""Tables behind the figures of a diagnosis: their names, columns and files ``curves/*.csv``.

A diagnosis holds those it could compute; the report draws those it finds.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import NamedTuple, TypeVar

import pandas as pd

from scapulohumeral.errors import DataError
from scapulohumeral.gap.labels import CURVES

# What the recorded curves of the test trials are compared with.
REFERENCE, MODEL = COMPARED_WITH = ("reference trials", "model")
# How far the likeliest explanation misses the difference.
MISFIT = "misfit"
# Before kind of channels and task whose repeats scatter by a factor more than was told of them.
SCATTER_OF = "scatter_of_"
Row = TypeVar("Row", bound=NamedTuple)


class ShowsRow(NamedTuple):
    """Where the gap shows: z value of a channel and phase, threshold of the whole map.

    `repeated`: whether both halves of the test trials have the region that the point belongs to;
    None outside of regions, and where a task has too few trials for two halves.
    """

    channel: str
    phase_percent: float
    effect_sigma: float
    threshold_sigma: float
    repeated: bool | None


class EntersRow(NamedTuple):
    """Where it enters: generalised force by degree of freedom, or error by EMG channel."""

    kind: str
    name: str
    phase_percent: float
    effect: float
    threshold: float
    unit: str


class OverlayRow(NamedTuple):
    """Mean difference in a task: recorded, by the most probable effect, 95 % without any effect.

    `compared_with` is one of `COMPARED_WITH`.
    """

    task: str
    channel: str
    phase_percent: float
    difference: float
    with_effect: float
    floor_low: float
    floor_high: float
    unit: str
    compared_with: str


class SignatureRow(NamedTuple):
    """The gap, the best signature and what it leaves, on one scale."""

    channel: str
    phase_percent: float
    residual_sigma: float
    signature_sigma: float
    rest_sigma: float


class IsolabilityRow(NamedTuple):
    """Probability that these trials tell two effects apart."""

    label_a: str
    label_b: str
    p_apart: float


class AmplitudeRow(NamedTuple):
    """Amplitude of the best effect, fitted to one task alone, with its 95 % interval."""

    task: str
    parameter: str
    value: float
    low: float
    high: float
    unit: str


class FactorsRow(NamedTuple):
    """How much of its predicted change an effect of a cause makes in a channel of this person."""

    label: str
    effect: str
    channel: str
    factor: float


class LeftOutRow(NamedTuple):
    """Root mean square of a task before and after the cause as the other tasks have it.

    Both in units of what two recordings of one person differ by without a cause.
    """

    task: str
    before: float
    after: float


class ControlsRow(NamedTuple):
    """What disappears on held-out trials without a cause: black box, placebos."""

    name: str
    shrinkage: float


class RobustnessRow(NamedTuple):
    """The verdict of one cell of the robustness grid."""

    cell: str
    verdict: str
    agrees: bool


class ErrorsRow(NamedTuple):
    """What is most probable of the person and the errors.

    Stiffness with which the person keeps a movement and standard deviation of another movement
    [deg], both beside the best effect; shares of what sessions are assumed to change of markers
    and of electrodes; signature error; `SCATTER_OF` each kind and task; `MISFIT`, see
    `isolation.misfit`.
    """

    error: str
    value: float


class BaselinesRow(NamedTuple):
    """What a simple method names as the cause."""

    method: str
    label: str


class HypothesesRow(NamedTuple):
    """What the probability of an answer was made of, in natural logarithms.

    `log_predictive` is the sum over tasks of their density given the others; None with one task.
    `moves`: log odds that the movement was done differently as well; 0 for what is no cause.
    """

    label: str
    log_prior: float
    log_evidence: float
    log_predictive: float | None
    moves: float


class DirectionsRow(NamedTuple):
    """A principal direction of a cause's parameters: see `isolation.hypothesis.Direction`."""

    label: str
    told: float
    asked: float


# Rows of each table; `phase_percent` runs from 0 to 100 over the movement.
ROWS: dict[str, type[NamedTuple]] = {
    "shows": ShowsRow,
    "enters": EntersRow,
    "overlay": OverlayRow,
    "signature": SignatureRow,
    "isolability": IsolabilityRow,
    "amplitude": AmplitudeRow,
    "factors": FactorsRow,
    "left_out": LeftOutRow,
    "controls": ControlsRow,
    "robustness": RobustnessRow,
    "errors": ErrorsRow,
    "baselines": BaselinesRow,
    "hypotheses": HypothesesRow,
    "directions": DirectionsRow,
}
TABLES: dict[str, tuple[str, ...]] = {name: row._fields for name, row in ROWS.items()}


def table_of(kind: type[Row], rows: Iterable[Row]) -> pd.DataFrame:
    """A table with one column per field of its rows, in their order."""
    return pd.DataFrame(list(rows), columns=list(kind._fields))


def check_curves(curves: Mapping[str, pd.DataFrame]) -> None:
    """Refuse tables of other names or columns than `TABLES` lists.

    Raises
    ------
    DataError                        names the table, what was found and what was expected
    """
    for name, table in curves.items():
        if name not in TABLES:
            raise DataError(f"curves, '{name}': unknown; expected one of {', '.join(TABLES)}.")
        if tuple(table.columns) != TABLES[name]:
            raise DataError(
                f"curves, '{name}': columns {', '.join(map(str, table.columns))}; expected "
                f"{', '.join(TABLES[name])}."
            )


def read_table(out: Path, name: str) -> pd.DataFrame:
    """A written table.

    Raises
    ------
    DataError                        it was not written
    """
    path = out / CURVES / f"{name}.csv"
    if not path.exists():
        raise DataError(
            f"{path}: not there; expected an answer of this version. Diagnose the case again."
        )
    return pd.read_csv(path)


def read_pairs(out: Path, name: str) -> dict[str, str]:
    """A written table of two columns as first -> second; empty if it was not written."""
    path = out / CURVES / f"{name}.csv"
    if not path.exists():
        return {}
    with path.open(encoding="utf-8", newline="") as stream:
        return {row[TABLES[name][0]]: row[TABLES[name][1]] for row in csv.DictReader(stream)}


def write_curves(curves: Mapping[str, pd.DataFrame], out: Path) -> None:
    """Write each table to ``out/curves/NAME.csv``."""
    check_curves(curves)
    folder = out / CURVES
    folder.mkdir(parents=True, exist_ok=True)
    for name, table in curves.items():
        text = table.to_csv(index=False, float_format="%.6g", lineterminator="\n")
        (folder / f"{name}.csv").write_text(text, encoding="utf-8")
