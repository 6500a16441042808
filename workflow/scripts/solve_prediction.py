"""Rule solve_prediction: predict scapula and clavicle of one condition."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _prediction import prediction_problem

from scapulohumeral.stages.prediction import solve_prediction

solve_prediction(
    *prediction_problem(snakemake),
    solution=(Path(snakemake.output.solution), Path(snakemake.output.summary)),
    solver_log=Path(snakemake.log.solver),
)
