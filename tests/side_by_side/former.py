"""Pose and solve one problem with the sources of the former commit; run inside its checkout.

    python former.py prediction/par2/cuff_w2 FOLDER FOLDER_OF_NEIGHBOUR CALIBRATIONS

Writes the problem in numbers (`problem.npz`), how it was solved (`former.json`) and the solution
(`former.npz`) to FOLDER. Imports follow the former tree.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import yaml
from measured import measure, read_point, write_point

from scapulohumeral.dynamics.parameters import unpack
from scapulohumeral.ocp.cost_terms import pose_errors
from scapulohumeral.ocp.objective import SUPERIOR_INFERIOR_SHARE
from scapulohumeral.ocp.solution import read_solution
from scapulohumeral.ocp.solver import Start
from scapulohumeral.ocp.transcription import REACTION_UNIT_N
from scapulohumeral.stages.calibration import calibrated_muscles
from scapulohumeral.stages.composite import compose
from scapulohumeral.stages.model_files import ModelFiles, load_model
from scapulohumeral.stages.posed_problem import SolveSettings, solve_posed
from scapulohumeral.stages.prediction import Condition, PredictionSettings, _Scene
from scapulohumeral.stages.tracking import pose_tracking, read_trial


def model_files(participant: str, formulation: str) -> ModelFiles:
    """Model files of a participant in the checkout."""
    return ModelFiles(
        participant=Path(f"config/participants/{participant}/participant.yaml"),
        model=Path(f"results/models/{participant}.json"),
        thorax=Path(f"results/models/{participant}_thorax.json"),
        geometry=Path(f"results/muscle_geometry/{participant}/{formulation}.npz"),
        equations=Path(f"results/equations/{formulation}"),
    )


def solve_settings(config: dict, problem: str, max_iterations: int) -> SolveSettings:
    """Settings of the configuration for one kind of problem."""
    keys = ("time_step_s", "tolerance", "hessian")
    solve = {key: config["solve"][key] for key in keys}
    weights = config["weights"][problem]
    return SolveSettings(**solve, max_iterations=max_iterations, weights=weights)


def tracking(config: dict, participant: str, name: str):
    """Files, settings and problem of a tracking solve, which starts from the recording."""
    trial, formulation = name.rsplit("_", 1)
    files = model_files(participant, formulation)
    settings = solve_settings(config, "tracking", config["solve"]["max_iterations"])
    return files, settings, pose_tracking(read_trial(files, trial), files, settings), None


def prediction(config: dict, participant: str, name: str, calibrations: Path):
    """Files, settings, problem and start of a prediction; the start of `direct` ones is given."""
    files = model_files(participant, "quaternion")
    chosen = config["prediction"]["conditions"][name]
    condition = Condition(name=name, **{**chosen, "muscles": tuple(chosen["muscles"])})
    settings = PredictionSettings(
        solve=solve_settings(config, "prediction", config["prediction"]["max_iterations"]),
        pause_s=config["composite"]["pause_s"],
        guidance=(),
        capacity_steps=(),
    )
    generic = condition.parameters == "generic"
    model = load_model(files)
    muscles = calibrated_muscles(
        model.record,
        Path("config/emg/channels.csv"),
        None if generic else calibrations / f"{participant}.json",
    )
    tracked = [
        read_solution(Path(f"results/tracking/{participant}/{plane}_quaternion.npz"))
        for plane in config["planes"]
    ]
    composite = compose(tracked, settings.solve.time_step_s, settings.pause_s)
    posed = _Scene(model, composite, muscles, condition, settings).posed(condition.capacity)
    return files, settings.solve, posed, composite.trajectory


def write_problem(
    path: Path,
    files: ModelFiles,
    settings: SolveSettings,
    posed,
    start,
    from_recording: bool,
) -> None:
    """The problem in SI units, with its objective and constraints at a point to compare there."""
    problem = posed.problem("gauss-newton")
    weights = dict(vars(posed.objective.weights))
    weights["reaction_rate"] = weights["regularisation"] / REACTION_UNIT_N**2
    muscles = dict(vars(posed.muscles))
    about = {
        "formulation": posed.model.forces.dynamics.name,
        "geometry": str(files.geometry.resolve()),
        "step": posed.objective.step,
        "glenoid": posed.objective.glenoid,
        "superior_inferior_share": SUPERIOR_INFERIOR_SHARE,
        "weights": weights,
        "error_groups": pose_errors(posed.model.forces.dynamics.name).groups,
        "tolerance": settings.tolerance,
        "max_iterations": settings.max_iterations,
        "strategy": settings.hessian,
        "from_recording": from_recording,
        "muscles": muscles.pop("names"),
        "hill": vars(muscles.pop("constants")),
    }
    free = problem.layout.join(start)
    np.savez(
        path,
        about=json.dumps(about),
        reference=posed.objective.reference,
        activity=posed.objective.activity,
        angles=posed.target.reference_rad,
        objective=problem.obj(free),
        constraints=problem.con(free),
        **{f"parameter_{name}": block for name, block in unpack(posed.parameters).items()},
        **{f"muscle_{name}": values for name, values in muscles.items()},
        **{f"start_{kind}": getattr(start, kind) for kind in ("q", "u", "a", "e")},
        start_reaction=REACTION_UNIT_N * start.reaction,
    )


def main(case: str, folder: Path, neighbour: str = "", calibrations: str = "") -> None:
    """Pose, solve and write one case."""
    config = yaml.safe_load(Path("config/config.yaml").read_text(encoding="utf-8"))
    kind, participant, name = case.split("/")
    if kind == "tracking":
        files, settings, posed, given = tracking(config, participant, name)
    else:
        files, settings, posed, given = prediction(config, participant, name, Path(calibrations))
    before = Start(*read_point(Path(neighbour) / "former.npz")) if neighbour else given
    result = measure(
        lambda: solve_posed(
            posed, posed.cold_start() if before is None else before, settings, None
        ),
        folder / "former.json",
    )
    write_point(result.point, folder / "former.npz")
    start = posed.cold_start() if given is None else given
    write_problem(folder / "problem.npz", files, settings, posed, start, given is None)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), *sys.argv[3:])
