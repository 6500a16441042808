"""Keys of the sensitivity of predictions, no part of the study: ``config/sensitivity.yaml``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from scapulohumeral.configuration.fields import (
    ConditionName,
    FolderName,
    Once,
    Real,
    Section,
    Seed,
    TrialName,
    key,
)

Weight = Literal[
    "activation",
    "trajectory_quaternion",
    "regularisation",
    "reaction_rate",
    "excitation_rate",
    "w_gh",
]


@dataclass(frozen=True)
class Sensitivity(Section):
    """What is changed in one prediction, one thing at a time."""

    participant: Annotated[FolderName, key("Whose prediction is solved again [no unit].")]
    planes: Annotated[
        list[TrialName], key("Recorded elevations it follows [no unit].", min_length=1), Once
    ]
    condition: Annotated[ConditionName, key("Condition of config.yaml [no unit].")]
    factor: Annotated[
        Real, key("Every weight is divided and multiplied by this [1].", gt=1, le=1000)
    ]
    weights: Annotated[
        list[Weight], key("Weights of the prediction, and w_gh of the condition [no unit]."), Once
    ]
    time_steps_s: Annotated[
        list[Annotated[Real, key("Mesh interval [s].", ge=0.005, le=0.2)]],
        key("Mesh intervals beside that of config.yaml [s]."),
        Once,
    ]
    scapula_turns_deg: Annotated[
        list[Annotated[Real, key("Turn [deg].", ge=-60, le=60)]],
        key("Turns of the scapula of the start, upward positive [deg]."),
        Once,
    ]
    random_seeds: Annotated[
        list[Annotated[Seed, key("Seed [1].")]], key("Seeds of random starts [1]."), Once
    ]
    random_turn_deg: Annotated[
        Real, key("Largest turn of clavicle and scapula of a random start [deg].", gt=0, le=60)
    ]
