"""What made two simulations that are compared: their model as it stands, and their problem.

A model that is scaled and fitted anew for simulated trials is not the one that made them: its
fibres hang and its thorax lies as the trials say, and its muscles are nobody's calibrated ones.
Effects then act on another posture, at another cost.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from scapulohumeral import provenance
from scapulohumeral.configuration.check import REMEDY, checked
from scapulohumeral.configuration.fields import Section, key
from scapulohumeral.documents import read_yaml
from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.nominal.participant_model import ParticipantModel, cached_equations
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.model.record import read_record
from scapulohumeral.provenance import CONFIG_FOLDER
from scapulohumeral.stages.calibration import calibrated_muscles

EXAMPLE = CONFIG_FOLDER / "gap" / "simulators" / "study.yaml"
# Muscle groups that scalers belong to.
CHANNELS = CONFIG_FOLDER / "emg" / "channels.csv"


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
        """All of them."""
        named = (self.model, self.thorax, self.geometry, self.scalers)
        return [Path(name) for name in named if name is not None]


def read_simulator(path: Path) -> Simulator:
    """Read what made simulations; files are named from the folder that the command runs in.

    Raises
    ------
    ConfigError                      a key is refused, or a file that it names is missing
    """
    found = checked(Simulator, read_yaml(path, REMEDY), f"{path}, ", EXAMPLE)
    for file in found.files:
        if not file.is_file():
            raise ConfigError(
                f"{path}: {file} is no file here; expected one of a model that was built. Build "
                "it, or name it from the folder that the command runs in."
            )
    return found


def simulating_model(simulator: Simulator) -> ParticipantModel:
    """The model that made simulations."""
    model = Path(simulator.model)
    record = read_record(model)
    scalers = None if simulator.scalers is None else Path(simulator.scalers)
    equations = cached_equations(provenance.user_cache())
    digest = hashlib.sha256()
    for file in simulator.files:
        digest.update(file.read_bytes())
    return ParticipantModel(
        record=record,
        thorax=json.loads(Path(simulator.thorax).read_text(encoding="utf-8")),
        forces=MuscleForces(compiled.load(equations), load_geometry(Path(simulator.geometry))),
        muscles=calibrated_muscles(record, CHANNELS, scalers),
        hash=digest.hexdigest(),
        folder=model.parent,
        equations=equations,
    )
