"""Rule benchmark_peer: the tracking problem by CasADi alone, or a part of it by opty alone."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.stages.peers.casadi_alone import casadi_solve
from scapulohumeral.stages.peers.limited import measured_within
from scapulohumeral.stages.peers.opty_alone import opty_build
from scapulohumeral.stages.tracking import pose_tracking, read_trial

files, settings = model_files(snakemake), solve_settings(snakemake)
posed = pose_tracking(read_trial(files, "frontal"), files, settings)
limit_s, peer = snakemake.params.limit_s, snakemake.wildcards.peer
if peer == "casadi":
    # As much again for building.
    work, most_s = casadi_solve(posed, files.equations, settings.tolerance, limit_s), 2 * limit_s
else:
    work, most_s = opty_build(posed, int(peer.removeprefix("opty_"))), limit_s
measured_within(most_s, work, Path(snakemake.log.peer), Path(snakemake.output.record))
