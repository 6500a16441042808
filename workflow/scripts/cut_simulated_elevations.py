"""Rule cut_simulated_elevations: the elevations of a composite motion as trials."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.gap.benchmark.simulated_motions import write_elevations

write_elevations(Path(snakemake.input.motion), Path(snakemake.output.trials))
