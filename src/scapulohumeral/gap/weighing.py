"""How evidence becomes probability: weights that were fitted to opened cases, not chosen.

``scapulohumeral gap calibrate`` writes them into ``config/gap/calibration.json``.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path

from scapulohumeral.errors import ConfigError

SCHEMA = "gap-calibration/5"
# Weights of the file, and those that were in use before them.
WEIGHTS, BEFORE = "weights", "before"


@dataclass(frozen=True)
class Weighing:
    """Weights of evidence, between 0 and 1.

    Attributes
    ----------
    evidence : of the log evidence of all tasks
    held_out : of the log predictive density of tasks given the others
    unknown : largest probability of none of these that evidence may give
    misled : share of all probability that goes by what is believed before any data
    foreign : share of all probability that belongs to none of these, beside what evidence says: a
        cause that is not in the library often looks like one that is
    moved : share of what is left that belongs to another movement, where that is an answer and the
        first cause needs another movement beside it
    moving : power of the odds by which the first cause needs that
    fading : power of their odds against the first cause by which both shares fall where evidence is
        for that cause; with 0 they stay
    silent, silent_motion, silent_alone : least probability of no gap where none is found and the p
        value is 1: with reference trials and EMG or joint force, with reference trials of motion
        alone, without reference trials
    silent_power : power of the p value by which the odds of that are multiplied
    least : probability from which on an answer belongs to the 90 % set
    """

    evidence: float
    held_out: float
    unknown: float
    misled: float
    foreign: float
    moved: float
    moving: float
    fading: float
    silent: float
    silent_motion: float
    silent_alone: float
    silent_power: float
    least: float

    def __post_init__(self) -> None:
        """Refuse what is no weight."""
        for name, value in vars(self).items():
            if not 0.0 <= value <= 1.0:
                raise ConfigError(f"{name}: {value}; expected 0 to 1. Calibrate again.")
        if self.whole <= 0.0:
            raise ConfigError("evidence and held_out: 0; expected one above 0. Calibrate again.")

    @property
    def whole(self) -> float:
        """Weight of evidence on the whole."""
        return self.evidence + self.held_out

    @property
    def temperature(self) -> float:
        """By what log evidence is divided on the whole: intervals widen by its square root."""
        return 1.0 / self.whole


def read_weighing(path: Path, which: str = WEIGHTS) -> Weighing:
    """Weights of a file that ``gap calibrate`` has written, or those before them.

    Raises
    ------
    ConfigError                      the file cannot be read, or a value is no weight
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != SCHEMA:
            raise ValueError(f"schema {document['schema']}, expected {SCHEMA}")
        return Weighing(**{f.name: float(document[which][f.name]) for f in fields(Weighing)})
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ConfigError(
            f"{path}: {error}; expected weights as `scapulohumeral gap calibrate` writes them. "
            "Restore the file or calibrate again."
        ) from error
