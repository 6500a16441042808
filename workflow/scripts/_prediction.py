"""A prediction from the inputs and parameters of its rule."""

from pathlib import Path
from typing import Any

from _files import model_files, solve_settings

from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.stages.prediction import Condition, PredictionFiles, PredictionSettings


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
