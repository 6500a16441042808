"""Kinds of values in a configuration: numbers, names, lists, each with meaning and range."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, TypeVar

from pydantic import AfterValidator, ConfigDict, Field, Strict
from pydantic.fields import FieldInfo

# Numbers as numbers: a quoted one, or true, is a slip.
Real = Annotated[float, Strict(), Field(allow_inf_nan=False)]
Whole = Annotated[int, Strict()]

LARGEST_SEED = 2**32 - 1

Item = TypeVar("Item")


@dataclass(frozen=True)
class Section:
    """A mapping of a configuration file. Keys that it does not name are refused."""

    __pydantic_config__: ClassVar[ConfigDict] = ConfigDict(extra="forbid")


def key(description: str, **bounds: Any) -> FieldInfo:
    """What a key means, with its unit in brackets at the end, and the range of its values.

    Parameters
    ----------
    description : quoted when a value is refused
    bounds : as pydantic has them: `gt`, `ge`, `le`, `pattern`, `min_length`
    """
    return Field(description=description, **bounds)


def _once(items: list[Item]) -> list[Item]:
    twice = [item for item in dict.fromkeys(items) if items.count(item) > 1]
    if twice:
        raise ValueError(f"expected every name once, not {', '.join(map(str, twice))} again")
    return items


def _rising(bounds: list[float]) -> list[float]:
    low, high = bounds
    if not low < high:
        raise ValueError("expected the lower one first, and the higher one above it")
    return bounds


def _holding(inside: float) -> AfterValidator:
    """Bounds that hold what is changed least."""

    def check(bounds: list[float]) -> list[float]:
        low, high = bounds
        if not low <= inside <= high:
            raise ValueError(f"expected {inside:g} between them")
        return bounds

    return AfterValidator(check)


# Names of participants, trials, conditions, muscle groups.
FolderName = Annotated[str, key("Name of a folder.", pattern=r"^[a-z0-9]+$")]
TrialName = Annotated[str, key("Name of a trial.", pattern=r"^[a-z0-9_]+$")]
ConditionName = Annotated[str, key("Name of a condition.", pattern=r"^[a-z0-9_]+$")]
Once = AfterValidator(_once)

# Lower and upper bound; nothing turned, or nothing scaled, lies between them.
Angles = Annotated[
    list[Annotated[Real, key("Angle [deg].", ge=-90, le=90)]],
    Field(min_length=2, max_length=2),
    AfterValidator(_rising),
    _holding(0.0),
]
Factors = Annotated[
    list[Annotated[Real, key("Factor [1].", gt=0, le=10)]],
    Field(min_length=2, max_length=2),
    AfterValidator(_rising),
    _holding(1.0),
]
Share = Annotated[Real, key("Share of a whole [1].", ge=0, le=1)]
Seed = Annotated[Whole, Field(ge=0, le=LARGEST_SEED)]
