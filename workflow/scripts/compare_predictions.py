"""Rule compare_predictions: predictions against recordings and against published predictions."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _against import against_files, fitted_region

from scapulohumeral.stages.distances.against import compare

compare(
    against_files(snakemake),
    fitted_region(snakemake),
    Path(snakemake.output.recording),
    Path(snakemake.output.published),
)
