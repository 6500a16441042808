"""Rule benchmark_solver: ratios to a limited-memory Hessian."""

from pathlib import Path

from _log import log_to_file

log_to_file(snakemake)

from _files import model_files, solve_settings

from scapulohumeral.stages.benchmark import benchmark_solver

benchmark_solver(
    trial="frontal",
    files=model_files(snakemake),
    settings=solve_settings(snakemake),
    output=Path(snakemake.output.record),
)
