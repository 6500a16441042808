"""The unit of EMG in an answer where envelopes are no shares of a maximal contraction.

They are brought to the height that the model predicts (:mod:`..residual.emg_level`), channel by
channel, so that what an answer says of them is a share as predicted, and not what the file holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from scapulohumeral.gap.recording.observables import EMG_UNIT
from scapulohumeral.gap.result import Diagnosis, Entered, GroupShrinkage, Regions, Shown

AS_PREDICTED = "fraction_of_mvc_as_predicted"

T = TypeVar("T", Shown, Entered, GroupShrinkage)


def as_predicted(done: Diagnosis) -> Diagnosis:
    """The same answer, whose EMG has the height that was predicted."""
    regions, shrinkage, unit = done.regions, done.shrinkage, AS_PREDICTED
    if regions is not None:
        regions = Regions(_renamed(regions.shows, unit), _renamed(regions.enters, unit))
    if shrinkage is not None:
        shrinkage = replace(shrinkage, groups=_renamed(shrinkage.groups, unit))
    curves = {
        name: table.assign(unit=table["unit"].replace(EMG_UNIT, unit)) if "unit" in table else table
        for name, table in done.curves.items()
    }
    return replace(done, regions=regions, shrinkage=shrinkage, curves=curves)


def _renamed(rows: Sequence[T], unit: str) -> tuple[T, ...]:
    return tuple(replace(row, unit=unit) if row.unit == EMG_UNIT else row for row in rows)
