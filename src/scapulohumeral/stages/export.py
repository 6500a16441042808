"""Solutions as files of OpenSim: a motion (.mot) and the states of the model (.sto).

Letters: N nodes, C = 14 coordinates, M muscles.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scapulohumeral.model.record import ModelRecord, read_record
from scapulohumeral.model.rotations import ANGLE_NAMES, Array, continuous_angles
from scapulohumeral.ocp.solution import Solution, read_solution

# Joint of each coordinate of the model; paths of states name it.
COORDINATE_JOINTS = {
    "TH_x": "base", "TH_y": "base", "TH_z": "base",
    "SC_y": "sc1", "SC_z": "sc2", "SC_x": "sc3",
    "AC_y": "ac1", "AC_z": "ac2", "AC_x": "ac3",
    "GH_y": "gh1", "GH_z": "gh2", "GH_yy": "gh3",
    "EL_x": "hu", "PS_y": "ur",
}  # fmt: skip
# Nine digits are more than the tolerance of a solve.
NUMBER = "%.9g"


def export_opensim(solution: Path, model: Path, motion: Path, states: Path) -> None:
    """Write a solution for OpenSim.

    A failed solve is written too, because a look at its motion helps to find the reason; both
    files then say so in their first line and in the key ``status``.

    Parameters
    ----------
    solution : Path                  stored solution, "solution/1"
    model : Path                     model record, "model/1": locked pronation
    motion : Path                    .mot to write: coordinates in degrees
    states : Path                    .sto to write: coordinates [rad], speeds [rad/s], activations

    Notes
    -----
    The thorax coordinates TH_* are zero and the pronation PS_y is locked. The model file has more
    muscle elements than are simulated, so a reader has to allow missing states.
    """
    solved = read_solution(solution, allow_failed=True)
    record = read_record(model)
    coordinates = opensim_coordinates(solved, record)
    speeds = np.gradient(coordinates, solved.time_s, axis=0)
    paths = [f"/jointset/{joint}/{name}" for name, joint in COORDINATE_JOINTS.items()]
    labels = [f"{path}/{kind}" for path in paths for kind in ("value", "speed")]
    labels += [f"/forceset/{muscle}/activation" for muscle in solved.muscles]
    pairs = np.stack([coordinates, speeds], axis=2).reshape(len(coordinates), -1)
    columns = np.hstack([pairs, solved.activation])
    _write(motion, solved, list(COORDINATE_JOINTS), np.rad2deg(coordinates), in_degrees=True)
    _write(states, solved, labels, columns, in_degrees=False)


def opensim_coordinates(solution: Solution, record: ModelRecord) -> Array:
    """All coordinates of the model over time, shape (N, C) [rad], without jumps of full turns."""
    angles = continuous_angles(solution.angles_rad, solution.reference_rad[0])
    values = dict(zip(ANGLE_NAMES, angles.T, strict=True))
    values["PS_y"] = np.full(len(angles), record.pronation_rad)
    zero = np.zeros(len(angles))
    return np.column_stack([values.get(name, zero) for name in COORDINATE_JOINTS])


def _write(
    path: Path, solution: Solution, labels: Sequence[str], values: Array, in_degrees: bool
) -> None:
    """Write a table in OpenSim's storage format."""
    header = solution.header
    name = "_".join(header[key] for key in ("participant", "trial", "formulation"))
    optimal = header["status"] == "optimal"
    lines = [
        name if optimal else f"{name}: NOT CONVERGED, no result",
        "version=1",
        f"nRows={len(values)}",
        f"nColumns={len(labels) + 1}",
        f"inDegrees={'yes' if in_degrees else 'no'}",
        f"status={header['status']}",
        "endheader",
        "\t".join(["time", *labels]),
    ]
    rows = np.column_stack([solution.time_s, values])
    lines += ["\t".join(NUMBER % number for number in row) for row in rows]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
