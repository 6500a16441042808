"""Solve a problem that former.py has written, with the sources of this tree.

    python present.py FOLDER EQUATIONS [FOLDER OF THE NEIGHBOUR]

Writes how it was solved (`present.json`), the solution (`present.npz`), and how far objective and
constraints of the two codes are apart at the point that former.py chose (`difference.json`).
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from measured import measure, read_point, write_point

from scapulohumeral.dynamics import compiled
from scapulohumeral.dynamics.hill import HillConstants, MuscleParameters
from scapulohumeral.dynamics.muscle_forces import MuscleForces
from scapulohumeral.dynamics.parameters import pack
from scapulohumeral.model.muscle_paths.geometry import load_geometry
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.objective import Objective, Trajectory, Weights
from scapulohumeral.ocp.problem import Problem
from scapulohumeral.ocp.solving import initial_guess
from scapulohumeral.ocp.solving.coarse_to_fine import coarse_nodes, solve_coarse_to_fine
from scapulohumeral.ocp.solving.solver import SolverSettings, Start


@dataclass(frozen=True, eq=False)
class FormerProblem:
    """The former problem in the terms of this tree."""

    forces: MuscleForces
    muscles: MuscleParameters
    parameters: np.ndarray
    objective: Objective
    angles: np.ndarray

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return len(self.objective.reference)

    def problem(self, nodes: int, hessian: str) -> Problem:
        """The problem on a mesh."""
        objective = self.objective if nodes == self.nodes else self.objective.on_nodes(nodes)
        return Problem(self.forces, self.muscles, self.parameters, objective, hessian)

    def cold_start(self) -> Trajectory:
        """Start from the recording."""
        return initial_guess.from_motion(
            self.forces, self.muscles, self.parameters, self.angles, self.objective.step
        )


def blocks(arrays: Mapping[str, np.ndarray], kind: str) -> dict[str, np.ndarray]:
    """Arrays of one kind by name."""
    return {k.removeprefix(kind): v for k, v in arrays.items() if k.startswith(kind)}


def read_problem(
    about: dict[str, Any], arrays: Mapping[str, np.ndarray], equations: Path
) -> FormerProblem:
    """The former problem; what this tree has added to problems is switched off in it."""
    errors = pose_errors(about["formulation"])
    known = len(about["error_groups"])
    if tuple(about["error_groups"]) != errors.groups[:known]:
        raise SystemExit("the tracking errors of the two codes differ: compare them anew")
    more = errors.function.function.size1_in(1) - arrays["reference"].shape[1]
    weights = {**about["weights"], "tracked": tuple(about["weights"]["tracked"])}
    return FormerProblem(
        forces=MuscleForces(
            compiled.load(equations / about["formulation"]), load_geometry(Path(about["geometry"]))
        ),
        muscles=MuscleParameters(
            names=tuple(about["muscles"]),
            constants=HillConstants(**about["hill"]),
            **blocks(arrays, "muscle_"),
        ),
        parameters=pack({"spring_torque": np.zeros(4), **blocks(arrays, "parameter_")}),
        objective=Objective(
            errors=errors,
            # The added errors weigh nothing.
            reference=np.pad(arrays["reference"], ((0, 0), (0, more))),
            weights=Weights(**weights, anchor=0.0),
            step=about["step"],
            glenoid=tuple(about["glenoid"]),
            superior_inferior_share=about["superior_inferior_share"],
            activity=arrays["activity"],
        ),
        angles=arrays["angles"],
    )


def difference(former: FormerProblem, arrays: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Relative difference of the objective, and largest of the constraints, at one point."""
    problem = former.problem(former.nodes, "gauss-newton")
    free = problem.layout.join(Trajectory(**blocks(arrays, "start_")))
    gap = np.abs(problem.con(free) - arrays["constraints"]).max()
    return {
        "objective": float(abs(problem.obj(free) / arrays["objective"] - 1.0)),
        "constraints": float(gap / np.abs(arrays["constraints"]).max()),
    }


def main(folder: Path, equations: Path, neighbour: str = "") -> None:
    """Solve the problem of a folder."""
    with np.load(folder / "problem.npz") as stored:
        arrays = dict(stored)
    about = json.loads(str(arrays["about"]))
    former = read_problem(about, arrays, equations)
    settings = SolverSettings(
        strategy=about["strategy"],
        tolerance=about["tolerance"],
        max_iterations=about["max_iterations"],
    )
    # As solve_posed does.
    settings = replace(settings, coarse=coarse_nodes(former.nodes))

    def start() -> Start:
        if neighbour:
            return Start(*read_point(Path(neighbour) / "present.npz"))
        given = Trajectory(**blocks(arrays, "start_"))
        x = former.cold_start() if about["from_recording"] else given
        return Start(former.problem(former.nodes, "gauss-newton").layout.join(x))

    result = measure(
        lambda: solve_coarse_to_fine(former.problem, former.nodes, start(), settings),
        folder / "present.json",
    )
    write_point(result.point, folder / "present.npz")
    text = json.dumps(difference(former, arrays)) + "\n"
    (folder / "difference.json").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), *sys.argv[3:])
