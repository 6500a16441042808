"""Rule fit_thorax: ellipsoid on which the recorded scapula of a participant slides."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.thorax import fit_participant_thorax

fit_participant_thorax(
    model=Path(snakemake.input.model),
    participant=Path(snakemake.input.participant),
    thorax=Path(snakemake.output.thorax),
)
