"""The model that made two simulations, as it stands.

A model that is scaled and fitted anew for simulated trials is not the one that made them: its
fibres hang and its thorax lies as the trials say, and its muscles are nobody's calibrated ones.
Effects then act on another posture, at another cost.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

from scapulohumeral import provenance
from scapulohumeral.configuration.simulator import Simulator
from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.nominal.participant_model import ParticipantModel, cached_equations
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.model.record import read_record
from scapulohumeral.provenance import CONFIG_FOLDER
from scapulohumeral.stages.calibration import calibrated_muscles

# Muscle groups that scalers belong to.
CHANNELS = CONFIG_FOLDER / "emg" / "channels.csv"


def simulating_model(simulator: Simulator) -> ParticipantModel:
    """The model that made simulations.

    Raises
    ------
    ConfigError                      one of its files is missing
    """
    digest = hashlib.sha256()
    for file in simulator.files:
        if not file.is_file():
            raise ConfigError(
                f"simulator: {file} is no file here; expected one of a model that was built. Build "
                "it, or name it from the folder that the command runs in."
            )
        digest.update(file.read_bytes())
    model = Path(simulator.model)
    record = read_record(model)
    scalers = None if simulator.scalers is None else Path(simulator.scalers)
    equations = cached_equations(provenance.user_cache())
    return ParticipantModel(
        record=record,
        thorax=json.loads(Path(simulator.thorax).read_text(encoding="utf-8")),
        forces=MuscleForces(compiled.load(equations), load_geometry(Path(simulator.geometry))),
        muscles=calibrated_muscles(record, CHANNELS, scalers),
        hash=digest.hexdigest(),
        folder=model.parent,
        equations=equations,
    )
