"""The equations of motion against OpenSim's inverse dynamics, an independent implementation.

Run as ``pytest -m opensim``. The equations need casadi, so they run in a process of their own.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from opensim_dynamics import inverse_dynamics
from places import REPOSITORY, SUPPORT

from scapulohumeral.model.choices import ModelChoices
from scapulohumeral.model.muscle_paths.pose_region import recorded_angles
from scapulohumeral.model.opensim_model import model_record, participant_model
from scapulohumeral.model.participant import read_participant
from scapulohumeral.model.record import write_record
from scapulohumeral.model.tables import read_tables

pytestmark = pytest.mark.opensim

POSES = 100


@pytest.fixture(scope="module")
def torques(tmp_path_factory, equations_folder):
    """Torques (P, 10) [N m] of OpenSim and of both formulations, by name."""
    folder = tmp_path_factory.mktemp("torques")
    tables = read_tables(REPOSITORY / "config" / "model")
    participant = read_participant(REPOSITORY / "config" / "participants", "par2")
    model = participant_model(tables, participant, ModelChoices())
    record = model_record(model, participant, tables, ModelChoices())
    write_record(record, folder / "record.json")
    rng = np.random.default_rng(1)
    recorded = recorded_angles(participant)
    recorded = recorded[np.abs(np.sin(recorded[:, 7])) > 0.2]  # away from gimbal lock
    states = {
        "angles": recorded[rng.choice(len(recorded), POSES)] + rng.uniform(-0.1, 0.1, (POSES, 10)),
        "rates": 3.0 * rng.normal(size=(POSES, 10)),
        "accelerations": 10.0 * rng.normal(size=(POSES, 10)),
    }
    np.savez(folder / "states.npz", **states)
    script = SUPPORT / "rigid_body_torques.py"
    paths = [equations_folder, *(folder / f for f in ("record.json", "states.npz", "torques.npz"))]
    environment = {**os.environ, "PYTHONPATH": str(REPOSITORY / "src")}
    # opensim puts its own folder there when imported, with a casadi library in it.
    environment.pop("LD_LIBRARY_PATH", None)
    subprocess.run([sys.executable, script, *paths], check=True, env=environment)
    with np.load(folder / "torques.npz") as data:
        ours = {name: data[name] for name in data.files}
    return {"opensim": inverse_dynamics(model, *states.values()), **ours}


@pytest.mark.parametrize("formulation", ["euler", "quaternion"])
def test_torques_are_those_of_opensim(torques, formulation):
    expected = torques["opensim"]
    scale = np.abs(expected).max(axis=0)
    assert scale.min() > 1.0
    # The accelerations of the quaternion formulation come from differences.
    tolerance = 1e-9 if formulation == "euler" else 1e-7
    np.testing.assert_allclose(torques[formulation] / scale, expected / scale, atol=tolerance)
