"""Rule tabulate_tried: variants of the study's model against the recordings of all participants."""

from _log import log_to_file

log_to_file(snakemake)

from _against import against_files, fitted_region

from scapulohumeral.report.prediction.against import distances_to_recordings
from scapulohumeral.report.prediction.tried import tried_table

distances = distances_to_recordings(against_files(snakemake), fitted_region(snakemake))
tried_table(distances).to_csv(snakemake.output.table, index=False, float_format="%.4g")
