"""Orientations of segments, as quaternions or matrices in axes of the ISB, come back as angles."""

from pathlib import Path

import made_recordings as made
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from scapulohumeral.errors import ConfigError
from scapulohumeral.laboratory.checks import Limits
from scapulohumeral.laboratory.convert import Outcome, Settings, convert_orientations
from scapulohumeral.laboratory.motions.orientations import ISB_AXES, read_orientation_map

pytestmark = pytest.mark.unit
MODEL = made.tables()
NAMES = {
    "thorax": "trunk", "clavicle_r": "clav", "scapula_r": "scap", "humerus_r": "arm", "ulna_r": "f",
}  # fmt: skip
MAP = """schema: orientation_map/1
side: {side}
axes: isb
segments: {{thorax: trunk, clavicle: clav, scapula: scap, humerus: arm, forearm: f}}
"""


def isb_orientations(angles: np.ndarray) -> dict[str, np.ndarray]:
    """Segments in the laboratory, axes of the ISB; y of the forearm from US to the elbow."""
    frames = {name: r for name, (_, r) in made.segments(angles, MODEL).items()}
    points = made.landmarks(angles, MODEL)
    along = (points["EL"] + points["EM"]) / 2.0 - points["US"]
    y = along @ made.TO_LABORATORY
    y = y / np.linalg.norm(y, axis=1, keepdims=True)
    x = np.cross(y, [0.3, 0.2, 0.9])
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    frames["ulna_r"] = np.stack([x, y, np.cross(x, y)], axis=-1)
    return {NAMES[n]: made.TO_LABORATORY @ r @ ISB_AXES.T for n, r in frames.items()}


def write(path: Path, frames: dict[str, np.ndarray], kind: str, decimals: int = 9) -> None:
    """Write orientations as a table of quaternions or matrices, at 120 Hz."""
    columns = {"time_s": np.round(np.arange(made.FRAMES) / 120.0, decimals)}
    for name, r in frames.items():
        if kind == "matrix":
            cells = {f"{name}_r{i + 1}{j + 1}": r[:, i, j] for i in range(3) for j in range(3)}
        else:
            q = Rotation.from_matrix(r).as_quat(scalar_first=True)
            cells = {f"{name}_q{i}": q[:, i] for i in range(4)}
        columns |= cells
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9f")


def convert(folder: Path, text: str) -> Outcome:
    """Convert the table that was written."""
    (folder / "map.yaml").write_text(text, encoding="utf-8")
    read = read_orientation_map(folder / "map.yaml")
    settings = Settings(MODEL, Limits())
    [outcome] = convert_orientations([folder / "trial.csv"], read, settings, lambda line: None)
    return outcome


@pytest.mark.parametrize("kind", ["quaternion", "matrix"])
@pytest.mark.parametrize("side", ["right", "left"])
def test_joint_angles_come_back(tmp_path: Path, kind: str, side: str) -> None:
    angles = made.arm_angles()
    angles[:, 2] += 0.4  # axial rotation of the clavicle is measured here, not estimated
    frames = isb_orientations(angles)
    if side == "left":
        # A left arm in the mirror; z of the ISB points right on both sides.
        isb, lab = np.diag([1.0, 1.0, -1.0]), np.diag([-1.0, 1.0, 1.0])
        frames = {name: lab @ r @ isb for name, r in frames.items()}
    write(tmp_path / "trial.csv", frames, kind)
    outcome = convert(tmp_path, MAP.format(side=side))
    assert outcome.converted is not None, outcome.refusal
    error = np.rad2deg(outcome.converted.angles_rad - angles)
    assert np.abs(error).max() < 0.01
    assert {c.status for c in outcome.converted.channels.values()} == {"measured"}


def test_sensors_are_turned_into_their_segments(tmp_path: Path) -> None:
    angles = made.arm_angles()
    frames = isb_orientations(angles)
    turn = Rotation.from_rotvec([0.3, -0.5, 0.2])
    frames["arm"] = frames["arm"] @ turn.as_matrix()
    write(tmp_path / "trial.csv", frames, "quaternion")
    q = ", ".join(f"{v:.9f}" for v in turn.as_quat(scalar_first=True))
    outcome = convert(
        tmp_path, MAP.format(side="right") + f"sensor_in_segment: {{humerus: [{q}]}}\n"
    )
    assert outcome.converted is not None, outcome.refusal
    assert np.abs(np.rad2deg(outcome.converted.angles_rad - angles)).max() < 0.01


@pytest.mark.parametrize(
    ("sensor", "said"),
    [
        ("humerus: [0, 0, 0, 0]", r"sensor_in_segment.humerus: \[0, 0, 0, 0\] has length 0;"),
        ("scapula: [1, 0, 0, 0]", "sensor_in_segment.scapula: no such segment in segments"),
    ],
)
def test_sensors_that_turn_nothing_are_refused(sensor: str, said: str, tmp_path: Path) -> None:
    text = MAP.format(side="right").replace(" scapula: scap,", "")
    file = tmp_path / "map.yaml"
    file.write_text(f"{text}sensor_in_segment: {{{sensor}}}\n", encoding="utf-8")
    with pytest.raises(ConfigError, match=said):
        read_orientation_map(file)


def test_a_clavicle_of_the_isb_has_no_axial_rotation_of_its_own(tmp_path: Path) -> None:
    """Its X is square to the vertical of the thorax (Wu et al. 2005), however it is turned."""
    angles = made.arm_angles()
    frames = isb_orientations(angles)
    z, up = frames["clav"][:, :, 2], frames["trunk"][:, :, 1]
    x = np.cross(up, z)
    x = x / np.linalg.norm(x, axis=1, keepdims=True)
    frames["clav"] = np.stack([x, np.cross(z, x), z], axis=-1)
    write(tmp_path / "trial.csv", frames, "matrix")
    outcome = convert(tmp_path, MAP.format(side="right"))
    assert outcome.converted is not None, outcome.refusal
    # The scapula rests on the clavicle, which is what the rule assumes.
    assert np.abs(np.rad2deg(outcome.converted.angles_rad - angles)).max() < 0.01
    status = {name: c.status for name, c in outcome.converted.channels.items()}
    assert {status[name] for name in ("SC_x", "AC_y", "AC_z", "AC_x")} == {"estimated"}
    assert {status[name] for name in ("SC_y", "SC_z", "GH_yy", "EL_x")} == {"measured"}


def test_times_in_milliseconds_are_noticed(tmp_path: Path) -> None:
    write(tmp_path / "trial.csv", isb_orientations(made.arm_angles()), "quaternion")
    table = np.loadtxt(tmp_path / "trial.csv", delimiter=",", skiprows=1)
    header = (tmp_path / "trial.csv").read_text(encoding="utf-8").splitlines()[0]
    table[:, 0] = 10.0 * np.arange(len(table))
    np.savetxt(tmp_path / "trial.csv", table, delimiter=",", header=header, comments="", fmt="%.9f")
    outcome = convert(tmp_path, MAP.format(side="right"))
    assert [f.name for f in outcome.findings] == ["slow_rate"]
    assert "steps of 10 s between frames" in outcome.findings[0].text
    assert not outcome.usable


@pytest.mark.parametrize("side", ["right", "left"])
def test_a_scapula_of_the_other_arm_is_refused(side: str, tmp_path: Path) -> None:
    frames = isb_orientations(made.arm_angles())
    if side == "right":
        mirror = np.diag([1.0, 1.0, -1.0])
        trunk = frames["trunk"]
        frames = {
            name: trunk @ mirror @ trunk.swapaxes(1, 2) @ r @ mirror for name, r in frames.items()
        }
    write(tmp_path / "trial.csv", frames, "matrix")
    outcome = convert(tmp_path, MAP.format(side=side))
    other = {"right": "left", "left": "right"}[side]
    assert f"Write side: {other} in the map" in str(outcome)


def test_a_filter_hides_no_jump(tmp_path: Path) -> None:
    frames = isb_orientations(made.arm_angles())
    frames["arm"][60] = frames["arm"][60] @ Rotation.from_euler("x", 50, degrees=True).as_matrix()
    write(tmp_path / "trial.csv", frames, "matrix")
    (tmp_path / "map.yaml").write_text(MAP.format(side="right"), encoding="utf-8")
    read = read_orientation_map(tmp_path / "map.yaml")
    settings = Settings(MODEL, Limits(), cutoff_hz=6.0)
    [outcome] = convert_orientations([tmp_path / "trial.csv"], read, settings, lambda line: None)
    assert "humerus_jumps" in {one.name for one in outcome.findings}


def test_rounded_times_become_uniform_ones(tmp_path: Path) -> None:
    write(tmp_path / "trial.csv", isb_orientations(made.arm_angles()), "quaternion", decimals=3)
    outcome = convert(tmp_path, MAP.format(side="right"))
    assert outcome.converted is not None, outcome.refusal
    assert np.diff(outcome.converted.time_s) == pytest.approx(1.0 / 120.0, rel=1e-4)


def test_matrices_column_by_column_are_noticed(tmp_path: Path) -> None:
    """A left-handed matrix is no rotation, nor is one with mixed columns."""
    frames = isb_orientations(made.arm_angles())
    frames["scap"] = frames["scap"][:, :, [1, 0, 2]]
    write(tmp_path / "trial.csv", frames, "matrix")
    outcome = convert(tmp_path, MAP.format(side="right"))
    assert "row 2, columns scap_r11 to scap_r33: no rotation" in outcome.refusal
