"""Rule spread_scalers: how uncertain a prediction is because calibrated scalers are."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _prediction import prediction_problem

from scapulohumeral.stages.checks.scaler_spread import scaler_spread

table = scaler_spread(Path(snakemake.input.solution), *prediction_problem(snakemake))
table.to_csv(snakemake.output.table, index=False, float_format="%.4g")
