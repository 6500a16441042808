"""What an effect is: its parameters, and what it needs to be seen.

Letters: P parameters.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.effects.body import Body
from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.model.rotations import Array


@dataclass(frozen=True)
class Param:
    """One amplitude of an effect.

    Attributes
    ----------
    name, unit : as in answers; unit "1" for pure numbers
    off : value at which the effect is absent
    low, high : bounds
    typical : a value that matters clinically
    prior_sd : spread on the internal scale, see :meth:`internal`
    source : where bounds and spread come from
    transform : "lin", or "log" for factors
    """

    name: str
    unit: str
    off: float
    low: float
    high: float
    typical: float
    prior_sd: float
    source: str
    transform: Literal["lin", "log"] = "lin"

    def __post_init__(self) -> None:
        """Refuse bounds that exclude the nominal model, and bounds without a source."""
        if not self.low <= self.off <= self.high or not self.source:
            raise ConfigError(
                f"parameter {self.name}: off {self.off}, bounds {self.low} to {self.high}, source "
                f"'{self.source}'; expected off inside the bounds, and a source"
            )

    def internal(self, value: float) -> float:
        """Scale on which amplitudes are fitted: 0 is off; logarithms of factors."""
        if self.transform == "log":
            return float(np.log(value / self.off))
        return value - self.off

    def physical(self, internal: float) -> float:
        """Inverse of :meth:`internal`."""
        if self.transform == "log":
            return float(self.off * np.exp(internal))
        return self.off + internal

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds on the internal scale."""
        return self.internal(self.low), self.internal(self.high)


@dataclass(frozen=True)
class Setup:
    """What the members of the families are: muscle groups and recorded channels.

    Attributes
    ----------
    groups : muscle groups that move the shoulder
    channels : recorded EMG channels
    neighbours : pairs of channels between which cross-talk is considered
    contact : whether the joint force is recorded
    of_one_person : whether a person is compared with the same person, not with the model
    simulated : whether the trials are simulations, which no measurement can spoil
    unmeasured : segments that a rule stands for: an effect on their record alone cannot show
    of_one_movement : whether both sides recorded the same movements, of one body
    """

    groups: tuple[str, ...]
    channels: tuple[str, ...]
    neighbours: tuple[tuple[str, str], ...]
    contact: bool
    of_one_person: bool = False
    simulated: bool = False
    unmeasured: frozenset[str] = frozenset()
    of_one_movement: bool = False

    @property
    def observables(self) -> frozenset[str]:
        """Kinds of observables that are recorded."""
        return frozenset(
            kind
            for kind, present in (
                ("kinematics", True),
                ("emg", bool(self.channels)),
                ("contact_force", self.contact),
            )
            if present
        )


@dataclass(frozen=True)
class Effect:
    """One unmodelled effect. Families derive from it and change either the body or the record.

    Attributes
    ----------
    side : "body", "control", "input" or "measurement"
    family : name of the family; member : muscle group, joint, segment or channel, or None
    params : the first is the primary amplitude
    needs : kinds of observables without which it cannot be seen
    mimics : families easily taken for it; splitting : trial or sensor that tells them apart
    order : pairs (i, j) of parameters of which the first is never above the second
    """

    order: ClassVar[tuple[tuple[int, int], ...]] = ()

    side: str
    family: str
    member: str | None
    params: tuple[Param, ...]
    needs: frozenset[str]
    mimics: tuple[str, ...]
    splitting: str

    @property
    def label(self) -> str:
        """Name in answers, ``side/family[/member]``."""
        return "/".join(filter(None, (self.side, self.family, self.member)))

    @property
    def off(self) -> Array:
        """Values (P,) at which the effect is absent."""
        return np.array([param.off for param in self.params])

    @property
    def changes_body(self) -> bool:
        """Whether the effect needs another optimal solution, or only another record of it."""
        return type(self).apply is not Effect.apply

    @property
    def spoils_motion(self) -> bool:
        """Whether it changes nothing but the record of the motion."""
        return not self.changes_body and self.needs == KINEMATICS

    def physical(self, internal: Array) -> Array:
        """Values (P,) from the internal scale (P,)."""
        return np.array([p.physical(x) for p, x in zip(self.params, internal, strict=True)])

    def apply(self, body: Body, values: Array) -> Body:
        """The body with the effect of values (P,)."""
        return body

    def observe(self, observed: Observation, values: Array) -> Observation:
        """What is recorded with the effect of values (P,)."""
        return observed


KINEMATICS = frozenset({"kinematics"})
EMG = frozenset({"emg"})
