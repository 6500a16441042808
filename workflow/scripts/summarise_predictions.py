"""Rule summarise_predictions: tables of all predictions."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.prediction_summary import summarise_predictions

summarise_predictions(
    solutions=[Path(path) for path in snakemake.input.solutions],
    summaries=[Path(path) for path in snakemake.input.summaries],
    models={Path(path).stem: Path(path) for path in snakemake.input.models},
    tracked=[Path(path) for path in snakemake.input.tracked],
    summary=Path(snakemake.output.summary),
    rhythm=Path(snakemake.output.rhythm),
)
