"""Rule export_opensim: write a solution as motion (.mot) and states (.sto) of OpenSim."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.export import export_opensim

export_opensim(
    solution=Path(snakemake.input.solution),
    model=Path(snakemake.input.model),
    motion=Path(snakemake.output.motion),
    states=Path(snakemake.output.states),
)
