"""Rule solve_tracking: track one recorded motion and store solution and summary."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from scapulohumeral.stages.model_files import ModelFiles
from scapulohumeral.stages.posed_problem import SolveSettings
from scapulohumeral.stages.tracking import solve_tracking

solve_tracking(
    trial=snakemake.wildcards.trial,
    files=ModelFiles(
        participant=Path(snakemake.input.participant),
        model=Path(snakemake.input.model),
        thorax=Path(snakemake.input.thorax),
        geometry=Path(snakemake.input.geometry),
        equations=Path(snakemake.input.equations),
    ),
    settings=SolveSettings(**dict(snakemake.params.items())),
    solution=Path(snakemake.output.solution),
    summary=Path(snakemake.output.summary),
    solver_log=Path(snakemake.log.solver),
)
