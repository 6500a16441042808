"""Files and settings that all solve rules name alike."""

from pathlib import Path
from typing import Any

from scapulohumeral.problems.model_files import ModelFiles
from scapulohumeral.problems.posed_problem import SolveSettings


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
