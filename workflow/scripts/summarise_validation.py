"""Rule summarise_validation: excitations of daily tasks against EMG."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.validation import summarise_validation

summarise_validation(
    solutions=[Path(path) for path in snakemake.input.solutions],
    channels=Path(snakemake.input.channels),
    envelopes=[Path(path) for path in snakemake.input.envelopes],
    summary=Path(snakemake.output.summary),
)
