"""Files and settings that all solve rules name alike."""

from pathlib import Path
from typing import Any

from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.problems.posed_problem import SolveSettings
from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.stages.prediction import Condition, PredictionFiles, PredictionSettings


def model_files(snakemake: Any) -> ModelFiles:
    """The model of a participant from the inputs of a rule."""
    return ModelFiles(
        participant=Path(snakemake.input.participant),
        model=Path(snakemake.input.model),
        thorax=Path(snakemake.input.thorax),
        geometry=Path(snakemake.input.geometry),
        equations=Path(snakemake.input.equations),
    )


def solve_settings(snakemake: Any) -> SolveSettings:
    """How a problem is posed and solved, from the parameters of a rule."""
    keys = ("time_step_s", "tolerance", "max_iterations", "hessian", "weights")
    return SolveSettings(**{key: snakemake.params[key] for key in keys})


def prediction_problem(snakemake: Any) -> tuple[Condition, PredictionFiles, PredictionSettings]:
    """What is predicted, from which files and how."""
    chosen = dict(snakemake.params.condition)
    optional = {key: snakemake.input.get(key) for key in ("calibration", "neighbour", "arm")}
    return (
        Condition(
            name=snakemake.wildcards.condition, **{**chosen, "muscles": tuple(chosen["muscles"])}
        ),
        PredictionFiles(
            model=model_files(snakemake),
            channels=Path(snakemake.input.channels),
            tracked=[Path(path) for path in snakemake.input.tracked],
            **{key: path and Path(path) for key, path in optional.items()},
        ),
        PredictionSettings(
            solve=solve_settings(snakemake),
            pause_s=snakemake.params.pause_s,
            guidance=tuple(snakemake.params.guidance),
            capacity_steps=tuple(snakemake.params.capacity_steps),
            choices=ProblemChoices(**snakemake.params.problem),
            variant=snakemake.wildcards.get("variant", "study"),
        ),
    )
