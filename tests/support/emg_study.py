"""Channels and settings of the study, for tests of the EMG pipeline."""

import numpy as np
import yaml
from places import REPOSITORY

from scapulohumeral.emg.channels import read_channels
from scapulohumeral.emg.quality import QualityLimits
from scapulohumeral.emg.recording import Recording
from scapulohumeral.emg.settings import EnvelopeSettings
from scapulohumeral.emg.synthesis import SimulationSettings

CONFIG = REPOSITORY / "config"
SECTION = yaml.safe_load((CONFIG / "config.yaml").read_text(encoding="utf-8"))["emg"]

CHANNELS = read_channels(CONFIG / "emg" / "channels.csv")
ENVELOPE = EnvelopeSettings(**SECTION["envelope"])
LIMITS = QualityLimits(**SECTION["quality"])
SIMULATION = SimulationSettings(**SECTION["simulation"])


def recording(volts: np.ndarray, rate_hz: float = 2000.0, start_s: float = 0.0) -> Recording:
    """A measured recording of one or more channels."""
    names = tuple(f"channel_{k}" for k in range(volts.shape[1]))
    return Recording("signal.csv", names, start_s, rate_hz, volts, simulated=False)
