"""Rule solve_prediction: predict scapula and clavicle of one condition."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.problems.problem_choices import ProblemChoices
from scapulohumeral.stages.prediction import (
    Condition,
    PredictionFiles,
    PredictionSettings,
    solve_prediction,
)

chosen = dict(snakemake.params.condition)
optional = {key: snakemake.input.get(key) for key in ("calibration", "neighbour", "arm")}
solve_prediction(
    condition=Condition(
        name=snakemake.wildcards.condition, **{**chosen, "muscles": tuple(chosen["muscles"])}
    ),
    files=PredictionFiles(
        model=model_files(snakemake),
        channels=Path(snakemake.input.channels),
        tracked=[Path(path) for path in snakemake.input.tracked],
        **{key: path and Path(path) for key, path in optional.items()},
    ),
    settings=PredictionSettings(
        solve=solve_settings(snakemake),
        pause_s=snakemake.params.pause_s,
        guidance=tuple(snakemake.params.guidance),
        capacity_steps=tuple(snakemake.params.capacity_steps),
        choices=ProblemChoices(**snakemake.params.problem),
        variant=snakemake.wildcards.get("variant", "study"),
    ),
    solution=(Path(snakemake.output.solution), Path(snakemake.output.summary)),
    solver_log=Path(snakemake.log.solver),
)
