"""Rule fit_thorax: ellipsoid on which the recorded scapula of a participant slides."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.thorax import fit_thorax

fit_thorax(
    model=Path(snakemake.input.model),
    recordings=[Path(path) for path in snakemake.input.recordings],
    thorax=Path(snakemake.output.thorax),
)
