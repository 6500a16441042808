"""The unit of EMG in an answer: what the envelopes of this participant are fractions of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TypeVar

from scapulohumeral.gap.recording.observables import EMG_UNIT
from scapulohumeral.gap.result import Diagnosis, Entered, GroupShrinkage, Regions, Shown

T = TypeVar("T", Shown, Entered, GroupShrinkage)


def in_unit_of_emg(done: Diagnosis, unit: str) -> Diagnosis:
    """The same answer with the unit of its envelopes, for that of channels of EMG in general.

    Parameters
    ----------
    done : an answer
    unit : of the participant file, such as "fraction_of_max"
    """
    regions, shrinkage = done.regions, done.shrinkage
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
