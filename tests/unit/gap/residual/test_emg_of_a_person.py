"""What EMG is taken to scatter by, against repeats of a person (config/recordings/hand_load)."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.special import gammaln

from scapulohumeral.gap.effects.observation import Observation
from scapulohumeral.gap.recording.observables import KINEMATIC_CHANNELS, phase_functions
from scapulohumeral.gap.residual import noise
from scapulohumeral.gap.residual.residual import compress
from scapulohumeral.gap.settings import SETTINGS, read_diagnosis_config, read_settings
from scapulohumeral.provenance import CONFIG_FOLDER

pytestmark = pytest.mark.unit

TABLE = CONFIG_FOLDER / "recordings" / "hand_load" / "emg.csv"
# Published as good as the same as that of the middle part.
LEFT_OUT = "EMG_trap_low"
PRIOR = read_settings(read_diagnosis_config(Path(CONFIG_FOLDER / "config.yaml"), SETTINGS)).noise
NODES = 21
FUNCTIONS = phase_functions(NODES, 6)
# Degrees of freedom of the scale of a trial: what prior knowledge and a repeat are worth.
DEGREES = 4.0


@pytest.fixture(scope="module")
def conditions() -> dict[str, np.ndarray]:
    """Repeats (3, N, C) of abduction and flexion, with and without a load."""
    table = pd.read_csv(TABLE).drop(columns=LEFT_OUT)
    phase = np.linspace(0.0, 1.0, NODES)
    found: dict[str, list[np.ndarray]] = {}
    for trial, rows in table.groupby("trial"):
        time = rows["time_s"].to_numpy()
        own = (time - time[0]) / (time[-1] - time[0])
        curves = rows.filter(like="EMG").to_numpy()
        found.setdefault(trial[:-1], []).append(
            np.stack([np.interp(phase, own, c) for c in curves.T], 1)
        )
    return {name: np.stack(repeats) for name, repeats in found.items()}


def log_density(conditions: dict[str, np.ndarray], prior: noise.NoisePrior) -> float:
    """Of what repeats differ by, with Student's t tails for every contrast of a condition."""
    total = 0.0
    for repeats in conditions.values():
        covariance = assumed(repeats.mean(axis=0), prior)
        _, logdet = np.linalg.slogdet(covariance)
        for contrast in contrasts(repeats):
            size = len(contrast)
            squares = contrast @ np.linalg.solve(covariance, contrast)
            constant = gammaln((DEGREES + size) / 2.0) - gammaln(DEGREES / 2.0)
            total += constant - 0.5 * size * np.log(np.pi * DEGREES) - 0.5 * logdet
            total -= 0.5 * (DEGREES + size) * np.log1p(squares / DEGREES)
    return total


def assumed(mean: np.ndarray, prior: noise.NoisePrior) -> np.ndarray:
    """Covariance of one trial with mean EMG (N, C), without repeats to tell."""
    still = np.tile(np.eye(4)[0], (NODES, 3))
    names = tuple(f"EMG_{i}" for i in range(mean.shape[1]))
    record = Observation(1.0, np.hstack([still, np.zeros((NODES, 1))]), names, mean, None)
    every = (*KINEMATIC_CHANNELS, *names)
    alone = noise.Repeats(record, (np.zeros((1, NODES, len(every))),))
    found = noise.trial_noise({"a": alone}, every, FUNCTIONS, prior).covariances["a"]
    first = len(KINEMATIC_CHANNELS) * FUNCTIONS.shape[1]
    return found[first:, first:]


def contrasts(repeats: np.ndarray) -> np.ndarray:
    """Independent contrasts (L - 1, D) of repeats (L, N, C), each as large as one trial varies."""
    count = len(repeats)
    directions = np.linalg.qr(np.column_stack([np.ones(count), np.eye(count)[:, 1:]]))[0][:, 1:]
    return compress([np.tensordot(directions.T, repeats, 1)], FUNCTIONS).T


def test_repeats_of_a_person_are_not_smooth_and_partly_in_step(conditions, monkeypatch):
    """Evidence of more than 20 to 1 for each, in 8 contrasts."""
    now = log_density(conditions, PRIOR)
    for other in (0.0, 2.5):
        apart = replace(PRIOR, emg_alike=other * PRIOR.emg_alike)
        assert now - log_density(conditions, apart) > (np.log(20.0) if other == 0.0 else 0.0)
    for other in (0.5, 2.0):
        quieter = replace(PRIOR, emg_relative=other * PRIOR.emg_relative)
        assert now > log_density(conditions, quieter)
    monkeypatch.setattr(noise, "SMOOTH_EMG", noise.SMOOTH_POSTURE)
    assert now - log_density(conditions, PRIOR) > np.log(20.0)
