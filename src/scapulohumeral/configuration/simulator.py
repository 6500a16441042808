"""What made simulations that a diagnosis compares, ``config/gap/simulators``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from scapulohumeral.configuration.fields import Section, key


@dataclass(frozen=True)
class Simulator(Section):
    """Files of a model, and the problem that was solved with it."""

    model: Annotated[str, key("Model record [no unit].", min_length=1)]
    thorax: Annotated[str, key("Ellipsoid of the thorax [no unit].", min_length=1)]
    geometry: Annotated[str, key("Muscle geometry in quaternions [no unit].", min_length=1)]
    scalers: Annotated[
        str | None, key("Calibration whose scalers the muscles have, or none [no unit].")
    ]
    variant: Annotated[
        str, key("Whose problem, of `variants.named` in config.yaml, or study [no unit].")
    ]

    @property
    def files(self) -> list[Path]:
        """All of them, named from the folder that a command runs in."""
        named = (self.model, self.thorax, self.geometry, self.scalers)
        return [Path(name) for name in named if name is not None]
