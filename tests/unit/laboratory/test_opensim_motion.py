"""Motions of another OpenSim model, moved by OpenSim itself, come back as joint angles."""

from pathlib import Path

import made_recordings as made
import numpy as np
import pytest

from scapulohumeral.errors import ModelError
from scapulohumeral.laboratory.checks import Limits
from scapulohumeral.laboratory.convert import Outcome, Settings, convert_motions
from scapulohumeral.laboratory.motions.opensim_motion import read_model_map
from scapulohumeral.model.opensim_model import build_model
from scapulohumeral.model.rotations import ANGLE_NAMES

pytestmark = pytest.mark.opensim
MODEL = made.tables()
MAP = (made.TABLES_FOLDER.parent / "recordings" / "das3.yaml").read_text(encoding="utf-8")


@pytest.fixture(scope="module", name="osim")
def osim_fixture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The base model as a file of its own."""
    path = tmp_path_factory.mktemp("model") / "base.osim"
    model = build_model(MODEL)
    model.finalizeConnections()
    model.printToXML(str(path))
    return path


def write_motion(path: Path, angles: np.ndarray, prefix: str, degrees: str) -> None:
    """Write joint angles [rad] as a motion, the trunk turned and leaning."""
    names = ["TH_x", "TH_y", *ANGLE_NAMES]
    trunk = np.tile([0.15, 0.7], (len(angles), 1))
    table = np.hstack([trunk, angles]) * (180.0 / np.pi if degrees == "yes" else 1.0)
    labels = [f"/jointset/x/{name}/value" if prefix else name for name in names]
    lines = [path.stem, "version=1", f"nRows={len(angles)}", f"nColumns={len(names) + 1}"]
    lines += [f"inDegrees={degrees}", "endheader", "\t".join(["time", *labels])]
    for k, row in enumerate(table):
        lines.append("\t".join([f"{k / made.RATE_HZ:.6f}", *(f"{v:.10f}" for v in row)]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def convert(folder: Path, osim: Path, files: list[Path]) -> list[Outcome]:
    """Convert motions of the base model."""
    (folder / "map.yaml").write_text(MAP, encoding="utf-8")
    read = read_model_map(folder / "map.yaml")
    return convert_motions(files, osim, read, Settings(MODEL, Limits()), lambda line: None)


def test_angles_come_back_from_degrees_and_radians(tmp_path: Path, osim: Path) -> None:
    angles = made.arm_angles()
    files = [tmp_path / "a.mot", tmp_path / "b.sto"]
    write_motion(files[0], angles, "", "yes")
    write_motion(files[1], angles, "path", "no")
    for outcome in convert(tmp_path, osim, files):
        assert outcome.converted is not None, outcome.refusal
        assert np.abs(np.rad2deg(outcome.converted.angles_rad - angles)).max() < 0.02
        assert outcome.converted.channels["SC_x"].status == "estimated"


def test_a_motion_of_another_model_is_refused(tmp_path: Path, osim: Path) -> None:
    file = tmp_path / "a.mot"
    write_motion(file, made.arm_angles(), "", "yes")
    text = file.read_text(encoding="utf-8")
    for name in ("TH_x", "TH_y", *ANGLE_NAMES):
        text = text.replace(f"\t{name}", f"\tother_{name}")
    file.write_text(text, encoding="utf-8")
    [outcome] = convert(tmp_path, osim, [file])
    assert "expected coordinates of the model" in outcome.refusal


def test_a_model_that_is_none_is_named_with_the_reason(tmp_path: Path) -> None:
    write_motion(tmp_path / "a.mot", made.arm_angles(), "", "yes")
    (tmp_path / "bad.osim").write_text("<xml>", encoding="utf-8")
    with pytest.raises(
        ModelError, match=r"bad\.osim: OpenSim cannot read it: \S.*Correct the model"
    ):
        convert(tmp_path, tmp_path / "bad.osim", [tmp_path / "a.mot"])


def test_a_recording_of_markers_is_no_motion(tmp_path: Path, osim: Path) -> None:
    made.write_c3d(tmp_path / "a.c3d", made.marked(made.landmarks(made.arm_angles(), MODEL)))
    [outcome] = convert(tmp_path, osim, [tmp_path / "a.c3d"])
    assert "'.c3d'; expected .mot or .sto" in outcome.refusal


def test_a_marker_that_the_model_lacks_is_named(tmp_path: Path, osim: Path) -> None:
    write_motion(tmp_path / "a.mot", made.arm_angles(), "", "yes")
    (tmp_path / "map.yaml").write_text(MAP.replace("EL: EL", "EL: EpL"), encoding="utf-8")
    read = read_model_map(tmp_path / "map.yaml")
    with pytest.raises(ModelError, match="no marker 'EpL' for EL"):
        convert_motions(
            [tmp_path / "a.mot"], osim, read, Settings(MODEL, Limits()), lambda line: None
        )
