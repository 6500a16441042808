"""Rule collect_peers: this solver and its peers in one record."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.peers.collected import collect

collect(
    solver=Path(snakemake.input.solver),
    peers=[Path(path) for path in snakemake.input.peers],
    output=Path(snakemake.output.record),
)
