"""Rule hold_girdle: what it costs a prediction to have its girdle where a motion has it."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _prediction import prediction_problem

from scapulohumeral.stages.checks.held_girdle import held_girdle

table = held_girdle(
    *prediction_problem(snakemake),
    solution=Path(snakemake.input.solution),
    shares=snakemake.params.shares,
)
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
