"""The model that made two simulations, as it stands.

A model that is scaled and fitted anew for simulated trials is not the one that made them: its
fibres hang and its thorax lies as the trials say, and its muscles are nobody's calibrated ones.
Effects then act on another posture, at another cost.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from scapulohumeral.configuration.simulator import Simulator
from scapulohumeral.errors import ConfigError
from scapulohumeral.gap.nominal.participant_model import (
    BuiltFiles,
    ParticipantModel,
    read_model,
)
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
    scalers = None if simulator.scalers is None else Path(simulator.scalers)
    return read_model(
        BuiltFiles(Path(simulator.model), Path(simulator.thorax), Path(simulator.geometry)),
        lambda record: calibrated_muscles(record, CHANNELS, scalers),
        digest.hexdigest(),
    )
