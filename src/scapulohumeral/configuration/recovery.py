"""Keys of the recovery of known muscle parameters, no part of the study: config/recovery.yaml."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from scapulohumeral.configuration.fields import FolderName, Real, Section, Share, key
from scapulohumeral.model.choices import SerratusPath


@dataclass(frozen=True)
class RecoveryPlant(Section):
    """How a simulated arm differs in structure from the model that is calibrated to its EMG."""

    factors: Annotated[
        Literal["own", "none"],
        key("Muscle parameters: the factors of config/plant, or none at all [no unit]."),
    ]
    activation_power: Annotated[
        Real, key("Power of the activations that the arm minimises [1].", ge=2, le=5)
    ]
    serratus_path: Annotated[SerratusPath, key("Surface under serratus anterior [no unit].")]
    tendon_strain: Annotated[
        Real, key("Strain of tendons at maximum isometric force [1].", ge=0, le=0.1)
    ]
    cross_talk: Annotated[Share, key("Share of a neighbour that an electrode sees [1].")]
    mvc_effort: Annotated[Real, key("Excitation reached in maximal contractions [1].", gt=0, le=1)]


@dataclass(frozen=True)
class Recovery(Section):
    """Whose model is calibrated to the EMG of which simulated arms."""

    participant: Annotated[FolderName, key("Whose model is calibrated [no unit].")]
    plants: Annotated[
        dict[str, RecoveryPlant], key("Simulated arms by name [no unit].", min_length=1)
    ]
