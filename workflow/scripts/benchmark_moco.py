"""Rule benchmark_moco: the tracked motion by OpenSim Moco."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.peers.limited import measured_within
from scapulohumeral.stages.peers.moco import moco_solve

files = (Path(snakemake.input.model), Path(snakemake.input.states))
measured_within(
    snakemake.params.limit_s,
    moco_solve(snakemake.wildcards.tool, *files, snakemake.params.time_step_s),
    Path(snakemake.log.peer),
    Path(snakemake.output.record),
)
