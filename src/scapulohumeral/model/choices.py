"""What the model of a participant leaves open, and the words that each choice may take.

Each word is a model that somebody has used or that a reason can be given for; config/config.yaml
says which the study takes and why.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Literal, get_args

from scapulohumeral.errors import ConfigError

Masses = Literal["published", "divided", "anthropometric"]
SerratusPath = Literal["flattened", "flattened_rescaled", "as_scaled"]
Paths = Literal["das3", "published"]
Fibres = Literal["recorded_range", "suspended", "published"]
GirdleStops = Literal["hanging", "wide"]
Glenohumeral = Literal["spring", "capsule"]


@dataclass(frozen=True)
class ModelChoices:
    """Choices that a participant's OpenSim model is made with.

    Attributes
    ----------
    masses : "published" as in the scaled models, "divided" by the 1.4 that the authors' program ran
        with, or "anthropometric" fractions of body mass for arm and girdle, with the mass centre
        and inertia of an upper arm
    serratus_path : over a thorax surface "flattened" until the attachments stay outside,
        "flattened_rescaled" with slack and optimal lengths that follow the shorter path, or
        "as_scaled", where poses with an attachment inside the surface are left out of the fit
    paths : of the other muscles, as in "das3", or "published": those that the authors set by hand,
        all fitted as by the authors
    fibres : "recorded_range" lengthens fibres that recorded elevations would stretch too far,
        "suspended" does so, but lets recorded elevations stretch the muscles that carry the girdle
        further, all alike, so that it hangs where it was recorded; "published" are those that the
        authors set by hand
    girdle_stops : where SC and AC have their stops: "hanging" lets the clavicle fall to the end of
        DAS3's range, or to where it is while the arm hangs if that is lower, "wide" stops lie
        beyond every recorded angle
    glenohumeral : what resists a turn of the humerus in the glenoid where the girdle moves freely:
        a weak linear "spring" toward the middle of its range, or a "capsule" that is slack while
        the arm hangs and ends passive elevation
    """

    masses: str = "published"
    serratus_path: str = "flattened"
    paths: str = "das3"
    fibres: str = "recorded_range"
    girdle_stops: str = "hanging"
    glenohumeral: str = "spring"

    def __post_init__(self) -> None:
        """Refuse words that name no choice."""
        for key, allowed in (
            ("masses", get_args(Masses)),
            ("serratus_path", get_args(SerratusPath)),
            ("paths", get_args(Paths)),
            ("fibres", get_args(Fibres)),
            ("girdle_stops", get_args(GirdleStops)),
            ("glenohumeral", get_args(Glenohumeral)),
        ):
            if getattr(self, key) not in allowed:
                raise ConfigError(
                    f"model choice {key}: {getattr(self, key)!r}; choose {', '.join(allowed)}"
                )


def read_choices(values: Mapping[str, str]) -> ModelChoices:
    """Choices from a mapping of names to words; what it leaves out keeps its default.

    Raises
    ------
    ConfigError                      unknown name or word
    """
    names = [field.name for field in fields(ModelChoices)]
    unknown = sorted(set(values) - set(names))
    if unknown:
        raise ConfigError(
            f"model choice(s) {', '.join(unknown)}: unknown. There are: {', '.join(names)}"
        )
    return ModelChoices(**values)
