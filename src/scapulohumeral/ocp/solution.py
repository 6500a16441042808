"""Stored solutions: arrays and a header in one file, sealed if the solve failed.

Letters: N nodes, Nq coordinates, M muscles.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from scapulohumeral.errors import SolveError
from scapulohumeral.ocp.solving.solver import Start

SCHEMA = "solution/1"


@dataclass(frozen=True, eq=False)
class Solution:
    """One optimal control solution.

    Attributes
    ----------
    header : participant, trial, formulation, status, solver statistics, hashes, versions
    time_s : (N,)
    q : (N, Nq), u : (N, 10) generalised coordinates and speeds
    activation, excitation, muscle_force_N, fibre_length : (N, M); the last over optimal length
    reaction_N : (N, 3) force of the glenoid on the humeral head, scapula axes
    angles_rad, reference_rad : (N, 10) joint Euler angles of solution and recording
    pose, reference_pose : (N, 13) unit quaternions SC, AC, GH and elbow angle
    muscles : (M,) names
    free, multipliers, lower, upper : last iterate and multipliers, for warm starts
    """

    header: dict[str, Any]
    time_s: np.ndarray
    q: np.ndarray
    u: np.ndarray
    activation: np.ndarray
    excitation: np.ndarray
    muscle_force_N: np.ndarray  # noqa: N815 - unit
    fibre_length: np.ndarray
    reaction_N: np.ndarray  # noqa: N815 - unit
    angles_rad: np.ndarray
    reference_rad: np.ndarray
    pose: np.ndarray
    reference_pose: np.ndarray
    muscles: np.ndarray
    free: np.ndarray
    multipliers: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    @property
    def optimal(self) -> bool:
        """Whether the solve reached its tolerance; what failed is no result."""
        return self.header["status"] == "optimal"

    @property
    def start(self) -> Start:
        """Primal and dual warm start from this solution."""
        return Start(self.free, self.multipliers, self.lower, self.upper)


def write_solution(solution: Solution, path: Path) -> None:
    """Write a solution as ``.npz`` without pickles."""
    arrays = {f.name: getattr(solution, f.name) for f in fields(Solution) if f.name != "header"}
    header = {"schema": SCHEMA, **solution.header}
    np.savez_compressed(path, header=np.array(json.dumps(header)), **arrays)


def read_solution(path: Path, allow_failed: bool = False) -> Solution:
    """Read a solution.

    Raises
    ------
    SolveError
        If the solve failed and ``allow_failed`` is not set: its trajectories are no result.
    """
    with np.load(path, allow_pickle=False) as data:
        header = json.loads(str(data["header"]))
        if header["status"] != "optimal" and not allow_failed:
            raise SolveError(
                f"{path}: this solve failed ({header['message']}; largest violation "
                f"{header['constraint_violation']:.1e}). Its trajectories are no result; "
                "look at the solver log, then solve again"
            )
        arrays = {f.name: data[f.name] for f in fields(Solution) if f.name != "header"}
    return Solution(header=header, **arrays)
