"""Recordings of a made-up person: the model's landmarks, moved by known joint angles.

Letters: T frames, N markers.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

import ezc3d
import numpy as np
from scipy.spatial.transform import Rotation

from scapulohumeral.laboratory.girdle_rules import rest_scapula_in_clavicle
from scapulohumeral.model.tables import ModelTables, read_tables

TABLES_FOLDER = Path(__file__).parents[2] / "config" / "model"
RATE_HZ = 100.0
FRAMES = 120
# Laboratory axes of the thorax: the person looks along +y, leans by 8 deg, z is up.
LEAN_DEG = 8.0
TO_LABORATORY = Rotation.from_euler("x", LEAN_DEG, degrees=True).as_matrix() @ np.array(
    [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]
)
PLACE = np.array([0.3, -0.2, 1.4])
LANDMARKS = ("IJ", "PX", "C7", "T8", "SC", "AC", "AA", "TS", "AI", "GH", "EL", "EM", "US")
MAP = """schema: marker_map/1
side: {side}
up: "+z"
landmarks: {{IJ: mIJ, PX: mPX, C7: mC7, T8: mT8, SC: mSC, AC: mAC, AA: mAA, TS: mTS, AI: mAI,
  EL: mEL, EM: mEM, GH: mGH, US: mUS}}
glenohumeral: {{method: marker}}
"""


def tables() -> ModelTables:
    """Tables of the model."""
    return read_tables(TABLES_FOLDER)


def arm_angles(frames: int = FRAMES) -> np.ndarray:
    """Joint angles (T, 10) [rad] of an elevation whose scapula rests on the clavicle."""
    share = (1.0 - np.cos(np.linspace(0.0, 2.0 * np.pi, frames))) / 2.0
    rest = Rotation.from_matrix(rest_scapula_in_clavicle()).as_euler("YZX", degrees=True)
    angles = np.zeros((frames, 10))
    angles[:, :3] = [-28.0, 8.0, 5.0] + np.outer(share, [-15.0, 14.0, 30.0])
    angles[:, 3:6] = rest
    angles[:, 6:9] = [20.0, 12.0, 30.0] + np.outer(share, [25.0, 60.0, -20.0])
    angles[:, 9] = 30.0 + 40.0 * share
    return np.deg2rad(angles)


def segments(angles: np.ndarray, model: ModelTables) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Origins (T, 3) [m] and rotations (T, 3, 3) of segments in the thorax."""
    place = {name: np.array(joint.location_m) for name, joint in model.joints.items()}
    turn = {
        joint: Rotation.from_euler(order, angles[:, k : k + 3]).as_matrix()
        for joint, order, k in (("SC", "YZX", 0), ("AC", "YZX", 3), ("GH", "YZY", 6))
    }
    count = len(angles)
    thorax = (np.zeros((count, 3)), np.tile(np.eye(3), (count, 1, 1)))
    clavicle = (np.tile(place["sc1"], (count, 1)), turn["SC"])
    scapula = (clavicle[0] + turn["SC"] @ place["ac1"], turn["SC"] @ turn["AC"])
    humerus = (scapula[0] + scapula[1] @ place["gh1"], scapula[1] @ turn["GH"])
    # Body-fixed, as OpenSim has it.
    fixed = Rotation.from_euler("XYZ", model.joints["hu"].orientation_rad)
    axis = np.array(model.coordinates["EL_x"].axis)
    axis = axis / np.linalg.norm(axis)
    bend = fixed * Rotation.from_rotvec(angles[:, 9:] * axis)
    ulna = (humerus[0] + humerus[1] @ place["hu"], humerus[1] @ bend.as_matrix())
    return {
        "thorax": thorax,
        "clavicle_r": clavicle,
        "scapula_r": scapula,
        "humerus_r": humerus,
        "ulna_r": ulna,
    }


def landmarks(angles: np.ndarray, model: ModelTables) -> dict[str, np.ndarray]:
    """Positions (T, 3) [m] of the model's landmarks in laboratory axes, z up."""
    frames = segments(angles, model)
    # The marker AC of the model lies 0.06 mm off its joint; the clavicle ends in the joint.
    points = {
        name: frames[marker.segment][0] + frames[marker.segment][1] @ np.array(marker.location_m)
        for name, marker in model.markers.items()
        if name in LANDMARKS
    }
    points["SC"], points["AC"] = frames["clavicle_r"][0], frames["scapula_r"][0]
    return {name: p @ TO_LABORATORY.T + PLACE for name, p in points.items()}


def marked(points: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Landmarks under the labels of the made-up laboratory."""
    return {f"m{name}": track for name, track in points.items()}


def write_c3d(
    path: Path,
    points: Mapping[str, np.ndarray],
    unit: str = "mm",
    rate_hz: float = RATE_HZ,
    analog: Mapping[str, np.ndarray] | None = None,
    analog_rate_hz: float = 2000.0,
    first_frame: int = 1,
) -> None:
    """Write markers (T, 3) [m], NaN where not seen, and analog channels [V] as C3D."""
    file = ezc3d.c3d()
    scale = {"mm": 1e3, "m": 1.0, "cm": 1e2}.get(unit, 1.0)
    tracks = np.array(list(points.values())).transpose(2, 0, 1) * scale
    file["parameters"]["POINT"]["LABELS"]["value"] = list(points)
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["RATE"]["value"] = [rate_hz]
    # The library counts from zero.
    file["header"]["points"]["first_frame"] = first_frame - 1
    file["data"]["points"] = np.concatenate([tracks, np.ones((1, *tracks.shape[1:]))])
    if analog is not None:
        file["parameters"]["ANALOG"]["LABELS"]["value"] = list(analog)
        file["parameters"]["ANALOG"]["UNITS"]["value"] = ["V"] * len(analog)
        file["parameters"]["ANALOG"]["RATE"]["value"] = [analog_rate_hz]
        file["data"]["analogs"] = np.array(list(analog.values()))[None]
    file.write(str(path))


def write_trc(
    path: Path,
    points: Mapping[str, np.ndarray],
    unit: str = "mm",
    start_s: float = 0.0,
    first_frame: int = 1,
) -> None:
    """Write markers (T, 3) [m] as TRC; empty cells where not seen."""
    scale = {"mm": 1e3, "m": 1.0}.get(unit, 1.0)
    count, frames = len(points), len(next(iter(points.values())))
    keys = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate"
    lines = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        keys,
        f"{RATE_HZ}\t{RATE_HZ}\t{frames}\t{count}\t{unit}\t{RATE_HZ}",
        "Frame#\tTime\t" + "\t\t\t".join(points),
        "\t\t" + "\t".join(f"{a}{i}" for i in range(1, count + 1) for a in "XYZ"),
    ]
    for k in range(frames):
        cells = np.concatenate([track[k] for track in points.values()]) * scale
        text = ["" if np.isnan(cell) else f"{cell:.6f}" for cell in cells]
        lines.append("\t".join([str(k + first_frame), f"{start_s + k / RATE_HZ:.5f}", *text]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_csv(path: Path, points: Mapping[str, np.ndarray], unit: str = "mm") -> None:
    """Write markers (T, 3) [m] as CSV; empty cells where not seen."""
    scale = {"mm": 1e3, "m": 1.0}.get(unit, 1.0)
    header = ["time_s", *(f"{name}_{axis}_{unit}" for name in points for axis in "xyz")]
    lines = [",".join(header)]
    for k in range(len(next(iter(points.values())))):
        cells = np.concatenate([track[k] for track in points.values()]) * scale
        text = ["" if np.isnan(cell) else f"{cell:.6f}" for cell in cells]
        lines.append(",".join([f"{k / RATE_HZ:.5f}", *text]))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_map(path: Path, text: str = MAP, side: str = "right") -> Path:
    """Write the marker map of the made-up laboratory."""
    path.write_text(text.format(side=side) if text is MAP else text, encoding="utf-8")
    return path


WRITERS = {".c3d": write_c3d, ".trc": write_trc, ".csv": write_csv}


def without(points: Mapping[str, np.ndarray], names: Sequence[str]) -> dict[str, np.ndarray]:
    """Landmarks but for some."""
    return {name: track for name, track in points.items() if name not in names}
