"""OpenSim reads the exported files. Run as ``pytest -m opensim``: opensim excludes casadi."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import opensim
import pytest
from places import SUPPORT

pytestmark = pytest.mark.opensim

# The export reads a solution, which loads casadi, so it needs a process of its own.
EXPORT = """
import sys
from pathlib import Path
import synthetic_study
from scapulohumeral.ocp.solution import write_solution
from scapulohumeral.stages.export import export_opensim
folder = Path(sys.argv[1])
write_solution(synthetic_study.solution("par2", "sagittal", "quaternion"), folder / "a.npz")
model = synthetic_study.write_model(folder / "m.json", "par2")
export_opensim(folder / "a.npz", model, folder / "a.mot", folder / "a.sto")
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with a.mot and a.sto of the same solution."""
    path = tmp_path_factory.mktemp("export")
    # opensim puts its own libraries first for every process started from here.
    environment = {key: value for key, value in os.environ.items() if key != "LD_LIBRARY_PATH"}
    command = [sys.executable, "-c", EXPORT, str(path)]
    subprocess.run(command, check=True, cwd=SUPPORT, env=environment)
    return path


def test_both_files_hold_the_same_motion(folder: Path) -> None:
    motion = opensim.TimeSeriesTable(str(folder / "a.mot"))
    states = opensim.TimeSeriesTable(str(folder / "a.sto"))
    assert motion.getTableMetaDataAsString("inDegrees") == "yes"
    assert states.getTableMetaDataAsString("inDegrees") == "no"
    assert states.getTableMetaDataAsString("status") == "optimal"
    assert motion.getNumRows() == states.getNumRows() == 40
    for name, path in (("GH_z", "/jointset/gh2/GH_z"), ("EL_x", "/jointset/hu/EL_x")):
        degrees = motion.getDependentColumn(name).to_numpy()
        radians = states.getDependentColumn(f"{path}/value").to_numpy()
        np.testing.assert_allclose(np.deg2rad(degrees), radians, atol=1e-8)
        assert "/forceset/supra_1/activation" in states.getColumnLabels()
