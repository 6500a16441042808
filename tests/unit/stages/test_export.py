"""Export to OpenSim: what is written can be read back, with units, names and without jumps."""

from pathlib import Path

import numpy as np
import pytest
import synthetic_study

from scapulohumeral.model.rotations import euler_to_quaternion, relative_angle
from scapulohumeral.model.tables import read_tables
from scapulohumeral.ocp.solution import Solution, write_solution
from scapulohumeral.stages.export import (
    COORDINATE_JOINTS,
    export_opensim,
)

pytestmark = pytest.mark.unit

Storage = tuple[dict[str, str], list[str], np.ndarray]


def read_storage(path: Path) -> Storage:
    """Own reader of OpenSim's storage format: header, labels, numbers with time first."""
    head, body = path.read_text(encoding="utf-8").split("endheader\n")
    name, *pairs = head.splitlines()
    labels, *rows = (line.split("\t") for line in body.splitlines())
    header = {"name": name} | dict(pair.split("=") for pair in pairs)
    return header, labels, np.array(rows, float)


def export(solved: Solution, folder: Path) -> tuple[Storage, Storage]:
    """Export a solution and read both files."""
    write_solution(solved, folder / "solution.npz")
    model = synthetic_study.write_model(folder / "model.json", solved.header["participant"])
    files = {"motion": folder / "a.mot", "states": folder / "a.sto"}
    export_opensim(folder / "solution.npz", model, **files)
    return read_storage(files["motion"]), read_storage(files["states"])


@pytest.mark.parametrize("formulation", synthetic_study.FORMULATIONS)
def test_motion_is_read_back(formulation: str, tmp_path: Path) -> None:
    solved = synthetic_study.solution("par1", "sagittal", formulation)
    (header, labels, numbers), _ = export(solved, tmp_path)
    assert header["inDegrees"] == "yes"
    assert header["name"] == f"par1_sagittal_{formulation}"
    assert (header["nRows"], header["nColumns"]) == (str(len(numbers)), str(len(labels)))
    np.testing.assert_allclose(numbers[:, 0], solved.time_s, rtol=1e-8)
    columns = dict(zip(labels, numbers.T, strict=True))
    for name in ("TH_x", "TH_y", "TH_z"):
        assert not columns[name].any()
    np.testing.assert_allclose(columns["PS_y"], 120.0)
    names = ("SC_y", "SC_z", "SC_x"), ("AC_y", "AC_z", "AC_x"), ("GH_y", "GH_z", "GH_yy")
    for place, (joint, sequence) in enumerate(zip(names, ("YZX", "YZX", "YZY"), strict=True)):
        angles = np.deg2rad([columns[name] for name in joint]).T
        own = solved.pose[:, 4 * place : 4 * place + 4]
        assert relative_angle(euler_to_quaternion(angles, sequence), own).max() < 1e-7
    np.testing.assert_allclose(np.deg2rad(columns["EL_x"]), solved.pose[:, 12], atol=1e-8)


def test_states_have_paths_radians_and_activations(tmp_path: Path) -> None:
    solved = synthetic_study.solution("par3", "frontal", "quaternion")
    (_, _, degrees), (header, labels, numbers) = export(solved, tmp_path)
    assert header["inDegrees"] == "no"
    columns = dict(zip(labels, numbers.T, strict=True))
    elbow = columns["/jointset/hu/EL_x/value"]
    np.testing.assert_allclose(elbow, np.deg2rad(degrees[:, 13]), atol=1e-8)
    speed = np.gradient(elbow, solved.time_s)
    np.testing.assert_allclose(columns["/jointset/hu/EL_x/speed"], speed, atol=1e-5)
    np.testing.assert_allclose(
        columns["/forceset/supra_1/activation"], solved.activation[:, 3], rtol=1e-8
    )
    assert len(labels) == 1 + 2 * len(COORDINATE_JOINTS) + len(solved.muscles)


def test_joints_of_the_coordinates_are_those_of_the_model(repository: Path) -> None:
    coordinates = read_tables(repository / "config/model").coordinates
    assert {name: c.joint for name, c in coordinates.items()} == COORDINATE_JOINTS
    assert list(coordinates) == list(COORDINATE_JOINTS)


def test_failed_solve_says_so_in_both_files(tmp_path: Path) -> None:
    solved = synthetic_study.solution("par2", "frontal", "euler", status="failed")
    for header, _, _ in export(solved, tmp_path):
        assert "NOT CONVERGED" in header["name"]
        assert header["status"] == "failed"
