"""Rule summarise_tracking: one table row per tracking solve."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.summary import summarise

summarise([Path(path) for path in snakemake.input.summaries]).to_csv(
    snakemake.output.summary, index=False
)
