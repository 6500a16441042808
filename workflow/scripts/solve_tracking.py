"""Rule solve_tracking: track one recorded motion and store solution and summary."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.stages.tracking import solve_tracking

solve_tracking(
    trial=snakemake.wildcards.trial,
    files=model_files(snakemake),
    settings=solve_settings(snakemake),
    solution=Path(snakemake.output.solution),
    summary=Path(snakemake.output.summary),
    solver_log=Path(snakemake.log.solver),
)
