"""Stored solutions, judged by equations and an integrator instead of by their summaries.

Run by the rule test_results. Limits: over the solutions of par2 the largest drift in one interval
of 0.04 s is 0.03 deg and 1.1 deg/s for tracked motions; five times that is allowed.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from reintegration import QUATERNIONS, midpoint_residuals, reintegrated
from result_files import paths, some_paths

from scapulohumeral.dynamics.parameters import pack, unpack
from scapulohumeral.dynamics.participant_parameters import muscle_parameters
from scapulohumeral.ocp.solution import Solution, read_solution
from scapulohumeral.problems.model_files import ModelFiles, ShoulderModel, load_model

pytestmark = pytest.mark.results

LARGEST_NORM_RMSE = 1e-10
LARGEST_NORM_DRIFT = 1e-8
LARGEST_DRIFT_DEG = 0.15
LARGEST_SPEED_DRIFT_DEG_S = 5.0
# Of the equations as they are discretised; the solver scales the forces by 100 N.
LARGEST_RESIDUAL = {"kinematic": 1e-6, "torque": 1e-6, "force": 1e-4, "activation": 1e-6}
# A composite motion has three times the intervals of an elevation, which repeat themselves.
EVERY = {"solutions": 1, "predictions": 5, "task_predictions": 5}


def model_of(files, participant: str, formulation: str) -> ShoulderModel:
    """The model that a participant's solutions were made with."""

    def only(name: str, ending: str) -> Path:
        [path] = [p for p in paths(files, name) if p.as_posix().endswith(ending)]
        return path

    return load_model(
        ModelFiles(
            participant=Path(),
            model=only("models", f"/{participant}.json"),
            thorax=only("thorax", f"/{participant}_thorax.json"),
            geometry=only("geometry", f"/{participant}/{formulation}.npz"),
            equations=only("equations", f"/{formulation}"),
        )
    )


def parameters_of(solution: Solution, model: ShoulderModel) -> np.ndarray:
    """Run-time parameters (P,) of the equations that a solution was made with."""
    condition, load = solution.header.get("condition"), solution.header["hand_load_kg"]
    # A condition makes it a prediction, in which the girdle moves freely.
    made = model.parameters if condition is None else model.free_parameters
    values = {name: block.copy() for name, block in unpack(made(load)).items()}
    stiffness = (condition or {}).get("girdle_stiffness_Nm_per_rad")
    if stiffness is not None:
        values["joint_stiffness"][:2] = stiffness
    return pack(values)


def solved(files, name: str) -> list[tuple[Path, Solution, ShoulderModel]]:
    """Solutions that did not fail, with their models."""
    found = []
    for path in some_paths(files, name):
        solution = read_solution(path, allow_failed=True)
        if solution.header["status"] == "optimal":
            about = (solution.header[key] for key in ("participant", "formulation"))
            model = model_of(files, *about)
            found.append((path, solution, model))
    if not found:
        pytest.skip(f"no {name} that did not fail")
    return found


@pytest.mark.parametrize("name", EVERY)
def test_quaternions_keep_unit_length_at_the_nodes(files, name: str) -> None:
    for path, solution, _ in solved(files, name):
        if solution.q.shape[1] != 13:
            continue
        norms = np.array([np.linalg.norm(solution.q[:, part], axis=1) for part in QUATERNIONS])
        assert np.sqrt(np.mean((norms - 1.0) ** 2)) <= LARGEST_NORM_RMSE, path


def test_tracked_solutions_meet_the_discretised_equations(files) -> None:
    """Generic muscles and what the hand holds, so all parameters are known here."""
    for path, solution, model in solved(files, "solutions"):
        muscles = muscle_parameters(model.record)
        parameters = parameters_of(solution, model)
        found = midpoint_residuals(solution, model.forces, parameters, muscles)
        for name, limit in LARGEST_RESIDUAL.items():
            assert found[name] <= limit, f"{path}: {name} {found[name]:.1e}"
        stored = json.loads(path.with_name(f"{path.stem}.summary.json").read_text("utf-8"))
        assert stored["constraint_violation"] <= LARGEST_RESIDUAL["kinematic"], path


@pytest.mark.parametrize("name", EVERY)
def test_integrating_again_ends_at_the_next_node(files, name: str) -> None:
    """Quaternion solves; Euler angles are there to show a singularity, where no mesh is fine."""
    for path, solution, model in solved(files, name):
        if solution.header["formulation"] != "quaternion":
            continue
        parameters = parameters_of(solution, model)
        drift = reintegrated(solution, model.forces, parameters, EVERY[name])
        # A small turn moves a quaternion by half of its angle.
        q_deg, u_deg_s = np.rad2deg(2.0 * np.abs(drift.q)), np.rad2deg(np.abs(drift.u))
        said = f"{path}: {q_deg.max():.3f} deg, {u_deg_s.max():.2f} deg/s in one interval"
        print(said)
        assert q_deg.max() <= LARGEST_DRIFT_DEG, said
        assert u_deg_s.max() <= LARGEST_SPEED_DRIFT_DEG_S, said
        assert np.abs(drift.norm).max() <= LARGEST_NORM_DRIFT, said
